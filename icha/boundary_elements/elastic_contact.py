"""Elastic contact of bonded cells, solved with an active set of cells and conjugate gradients for their pressures.

The cells of the initial contact stay in contact, under pressure or tension. Other cells join the active set where the
surfaces overlap, and leave the set when they are in tension. The iteration is a Newton method for the complementarity
of pressure and gap (Hintermueller, Ito & Kunisch, SIAM J. Optim. 13 (2003) 865). A bond transmits only tension, so that
a partial cell under pressure becomes a closed cell, with the fraction of contact 1.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from icha.boundary_elements.cells import find_among, merge_cells, rim_of
from icha.boundary_elements.front import average_fractions, bond_compliance
from icha.boundary_elements.half_space import HalfSpace, Operator
from icha.contact.model import FullContact, NotConverged
from icha.support.parallel import blocks, on_cores

# Relative error of displacements in single precision. A cell is open if its fraction of contact is at most NO_CONTACT.
ROUNDING, NO_CONTACT = 5e-7, 1e-9
# The iteration has stagnated if the error after a correction exceeds this part of the error before it.
LARGEST_REMAINDER = 0.5
# A correction reduces the error to _COARSE_PART of its value while the active set changes, and later to not less than
# _FINE_PART, because single precision allows no smaller value.
_COARSE_PART, _FINE_PART = 0.1, 1e-4
# Smallest compliance of the half-space, 2/q at the shortest wave, in h/E*.
_SMALLEST_COMPLIANCE = np.sqrt(2) / np.pi
# Typical compliance of the half-space per cell, in h/E*, to scale the preconditioner at soft bonds.
_TYPICAL_COMPLIANCE = 2.5
# Largest number of changes of the active set. Largest number of iterations of the conjugate gradients.
_MAX_CHANGES, _MAX_ITERATIONS = 200, 300
# Rows of a field that one core processes at a time.
_ROWS = 1024


@dataclass(frozen=True, eq=False)
class Contact:
    """Cells in contact, with their fractions of contact and their pressures.

    Parameters
    ----------
    cells : (k,) int, flat indices of the cells in contact, ascending.
    fraction : (k,), fraction of contact f of each cell, 0 < f <= 1: tension over strength at the front;
        0 for rim cells of `ActiveCells`.
    pressure : (k,), force on each cell divided by the area of the whole cell, in E*; negative in tension.
    """

    cells: np.ndarray
    fraction: np.ndarray
    pressure: np.ndarray

    def close_cells(self, cells: np.ndarray) -> Contact:
        """Return the contact after the given cells, (m,), ascending, closed fully; new cells get zero pressure."""
        present, index = find_among(cells, self.cells)
        fraction = self.fraction.copy()
        fraction[index] = 1.0
        return Contact(*merge_cells(self.cells, cells[~present], (fraction, 1.0), (self.pressure, 0.0)))

    def apply_step(self, fraction_change: np.ndarray, pressure_change: np.ndarray) -> Contact:
        """Return the contact after changes (k,) of fraction and pressure, without cells whose fraction falls to 0."""
        fraction = np.clip(self.fraction + fraction_change, 0.0, 1.0)
        touching = fraction > NO_CONTACT
        return Contact(self.cells[touching], fraction[touching], (self.pressure + pressure_change)[touching])

    @property
    def bond_compliance(self) -> np.ndarray:
        """Compliance of the bond of each cell, (k,), in cell sizes per E*."""
        return bond_compliance(self.fraction)


@dataclass(frozen=True, eq=False)
class Topography:
    """Heights of a surface in cell sizes, (n, n) or (t, n, n), in two precisions; -inf where there is no surface.

    `largest` is the largest finite absolute value.
    """

    double: np.ndarray
    single: np.ndarray
    largest: float

    @classmethod
    def of(cls, heights: np.ndarray) -> Topography:
        """Return the topography of given heights (in double precision, in cell sizes)."""
        lowest = np.min(heights, where=heights > -np.inf, initial=np.inf)
        return cls(heights, heights.astype(np.float32), float(max(heights.max(), -lowest)))

    @property
    def rounding(self) -> float:
        """Rounding error of displacements in single precision, in cell sizes."""
        return ROUNDING * self.largest

    def gap(self, displacement: np.ndarray, separation: float, contact: Contact) -> np.ndarray:
        """Convert a field of displacements to the gap, displacement + separation - height, in place.

        At cells in contact the gap is computed from heights in double precision. The field keeps its precision.
        """
        heights = self.single if displacement.dtype == np.float32 else self.double
        inside = displacement.ravel()[contact.cells] - (self.double.ravel()[contact.cells] - separation)

        def subtract_heights(rows):
            displacement[rows] -= heights[rows]
            displacement[rows] += displacement.dtype.type(separation)

        on_cores(subtract_heights, blocks(len(heights), _ROWS))
        displacement.ravel()[contact.cells] = inside
        return displacement


@dataclass(frozen=True, eq=False)
class ElasticContact(Contact):
    """Contact in elastic equilibrium at one separation; lengths in cell sizes.

    Parameters
    ----------
    gap : (n, n), gap at the grid nodes.
    separation : mean separation.
    misfit : (k,), displacement that each cell in contact still lacks, -gap - c p, with its bond compliance c.
    tolerance : largest allowed error of the displacements of cells in contact.
    """

    gap: np.ndarray = field(repr=False)
    separation: float
    misfit: np.ndarray = field(repr=False)
    tolerance: float


def solve_active_set(
    space: HalfSpace,
    topography: Topography,
    contact: Contact,
    tolerance: float,
    *,
    separation: float = 0.0,
    load: float | None = None,
    sticky: bool = True,
) -> ElasticContact:
    """Find the cells in contact and their pressures at a separation or under a load, starting from a given contact.

    Parameters
    ----------
    contact : initial contact; its cells and pressures are the start of the iteration.
    tolerance : largest allowed error of displacements in contact, in cell sizes. With a tolerance above the rounding
        error of single precision, all fields are computed in single precision.
    separation : mean separation, in cell sizes; ignored if `load` is given.
    load : nominal pressure, in E*, or None. One factor scales all pressures to a load; their sum must not be 0.
    sticky : whether the cells of the initial contact stay in contact under tension.

    Raise `FullContact` if all cells close at a given separation: no equilibrium exists, because the mean gap would be
    zero. Raise `NotConverged` if the cells in contact or the pressures do not converge.
    """
    dtype = np.float32 if tolerance > topography.rounding else float
    keep, gap, before, changing = np.full(len(contact.cells), sticky), None, np.inf, not sticky
    for _ in range(_MAX_CHANGES):
        full = len(contact.cells) == space.size and (contact.fraction >= 1).all()
        if load is None and full and space.mean_is_fixed:
            raise FullContact("the contact covers the whole surface")
        contact = _scale_to_load(space, contact, load)
        if gap is None:
            gap, misfit, separation = _compute_gap(space, topography, contact, separation, load, dtype)
        error = np.abs(misfit).max(initial=0.0)
        if not error <= tolerance:
            part = _COARSE_PART if changing and dtype == np.float32 else _FINE_PART
            contact = _correct_pressures(space, contact, misfit, max(part, 0.5 * tolerance / error), load is not None)
            gap, misfit, separation = _compute_gap(space, topography, contact, separation, load, dtype, gap)
        left = np.abs(misfit).max(initial=0.0)
        joining = _overlapping_cells(gap, contact.cells, max(tolerance, left))
        # Compliance is of order one (h/E*), so that the displacement error also bounds the pressure error.
        changed = _next_active_set(contact, keep, joining, left if dtype is float and not sticky else 0.0)
        if changed is None:
            if left <= tolerance:
                cells, fraction, pressure = contact.cells, contact.fraction, contact.pressure
                return ElasticContact(cells, fraction, pressure, gap, separation, misfit, tolerance)
            if not left <= LARGEST_REMAINDER * before:
                if dtype == np.float32 and np.isfinite(left):
                    # Displacements much larger than the heights are rounded more.
                    dtype, gap, before = float, None, np.inf
                    continue
                raise NotConverged(f"the pressures in contact did not converge (displacement error {left:.1e} cells)")
            before, changing = left, False
            continue
        before, changing = np.inf, True
        if len(changed[0].cells) == len(contact.cells) + len(joining) and load is None:
            contact, keep = changed
            misfit = -gap.ravel()[contact.cells] - contact.bond_compliance * contact.pressure
        else:
            (contact, keep), gap = changed, None
    raise NotConverged("the active set of the contact did not converge")


def _scale_to_load(space, contact, load):
    """Return the contact with its pressures scaled to a given load; without a load, return the contact unchanged."""
    if load is None or not len(contact.cells):
        return contact
    scaled = contact.pressure * (load * space.size / np.sum(contact.pressure))
    return Contact(contact.cells, contact.fraction, scaled)


def _next_active_set(contact, keep, joining, smallest):
    """Close partial cells under pressure, remove cells with a pressure below `smallest`, add cells `joining`, (m,).

    keep : (k,) bool, sticky cells, which stay under any pressure.
    Return the new contact and its `keep`; None if nothing changes.
    """
    to_close = (contact.pressure > 0) & (contact.fraction < 1)
    staying = keep | (contact.pressure >= smallest)
    if not to_close.any() and staying.all() and not len(joining):
        return None
    fraction = np.where(to_close, 1.0, contact.fraction)
    fractions, pressures = (fraction[staying], 1.0), (contact.pressure[staying], 0.0)
    cells, *values, keep = merge_cells(contact.cells[staying], joining, fractions, pressures, (keep[staying], False))
    return Contact(cells, *values), keep


def _compute_gap(space, topography, contact, separation, load, dtype, out=None):
    """Compute gap, misfit of cells in contact, and separation; under a load, cells in contact have zero mean gap."""
    cells = contact.cells
    displacement = space.displacement(cells, contact.pressure.astype(dtype), out=out)
    if load is not None:
        separation = float(np.mean(topography.double.ravel()[cells] - displacement.ravel()[cells]))
    gap = topography.gap(displacement, separation, contact)
    return gap, -gap.ravel()[cells] - contact.bond_compliance * contact.pressure, separation


def _correct_pressures(space, contact, misfit, part, zero_sum):
    """Reduce the largest misfit to max(part, operator.error) times its value; zero_sum as in `solve_pressures`."""
    operator = space.restrict_to(contact.cells)
    error = np.abs(misfit).max()
    change, _ = solve_pressures(operator, contact.bond_compliance, misfit / error, max(part, operator.error), zero_sum)
    return Contact(contact.cells, contact.fraction, contact.pressure + error * change)


def _overlapping_cells(gap, cells, tolerance):
    """Find the cells out of contact, ascending, at which the surfaces overlap by more than a tolerance."""

    def find(rows):
        return rows.start * gap[0].size + np.flatnonzero(gap[rows] < -tolerance)

    overlapping = np.concatenate(on_cores(find, blocks(len(gap), _ROWS)))
    return overlapping[~find_among(overlapping, cells)[0]]


def solve_pressures(
    operator: Operator, bonds: np.ndarray, wanted: np.ndarray, accuracy: float, zero_sum: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Solve (K + bonds) p = wanted for the pressures p by preconditioned conjugate gradients, in single precision.

    Parameters
    ----------
    operator : compliance K of the half-space between k cells.
    bonds : (k,), compliance of the bond of each cell.
    wanted : (k,), prescribed displacement of each cell, in cell sizes or scaled.
    accuracy : largest allowed error of a displacement, in the unit of `wanted`; after _MAX_ITERATIONS it may be larger.
    zero_sum : if True, the pressures sum to zero, and the displacements may differ from `wanted` by a constant.

    Returns
    -------
    Pressures (k,) in E*, with the scale of `wanted`, and remaining errors of the displacements (k,).
    """
    scale = np.sqrt(_TYPICAL_COMPLIANCE / (_TYPICAL_COMPLIANCE + bonds)).astype(np.float32)
    bonds, residual = bonds.astype(np.float32), wanted.astype(np.float32)
    pressure, direction, rho = np.zeros_like(residual), np.zeros_like(residual), np.float32(1.0)
    for iteration in range(_MAX_ITERATIONS):
        if np.abs(residual).max(initial=0.0) <= accuracy:
            break
        z = scale * operator.approximate_inverse(scale * residual)
        if zero_sum:
            z -= np.mean(z)
        new_rho = np.vdot(residual, z)
        direction = z + (new_rho / rho) * direction if iteration else z
        rho = new_rho
        image = operator.displacement(direction) + bonds * direction
        step = rho / np.vdot(direction, image)
        pressure += step * direction
        residual -= step * image
        if zero_sum:
            residual -= np.mean(residual)
    return pressure, residual


def solve_nonadhesive_contact(
    space: HalfSpace, topography: Topography, contact: Contact, *, separation: float = 0.0, load: float | None = None
) -> ElasticContact:
    """Solve the contact without adhesion at a separation (in cell sizes) or under a nominal pressure (in E*).

    contact : start of the iteration, with pressures if a load is given. Without a load it may be empty; then the
        iteration starts from the cells that are higher than the separation.
    """
    if not len(contact.cells):
        cells = np.flatnonzero(topography.double > separation)
        contact = Contact(cells, np.ones(len(cells)), np.zeros(len(cells)))

    def solve(start, tolerance):
        return solve_active_set(space, topography, start, tolerance, separation=separation, load=load, sticky=False)

    return solve(solve(contact, 2 * topography.rounding), 2e-6 * topography.rounding)


@dataclass(frozen=True, eq=False)
class AdhesiveContact(ElasticContact):
    """Elastic contact of bonded cells, with the quantities that decide how its front moves.

    Parameters
    ----------
    energy : elastic energy of half-space and bonds, in E* times cell size^3.
    energy_error : largest error of `energy`; apart from rounding, `energy` is never too large (`solve_bonded_contact`).
    mean_fraction : (k,), Gaussian average of the fractions around each cell (`average_fractions`).
    rim : (m,) int, open cells that share an edge with a cell in contact, ascending.
    mean_fraction_rim : (m,), Gaussian average of the fractions around each cell of the rim.
    """

    energy: float
    energy_error: float
    mean_fraction: np.ndarray = field(repr=False)
    rim: np.ndarray = field(repr=False)
    mean_fraction_rim: np.ndarray = field(repr=False)


def solve_bonded_contact(
    space: HalfSpace,
    topography: Topography,
    separation: float,
    contact: Contact,
    tolerance: float,
    background: np.ndarray | None = None,
) -> AdhesiveContact:
    """Solve the elastic contact at a separation; all cells of `contact` stay bonded. Add energy and mean fractions.

    Partial cells under pressure close, and overlapping cells join the contact. Parameters as in `solve_active_set`.

    background : in windows, part of the mean fraction due to contact outside the window, (t, n, n); otherwise None.
    """
    state = solve_active_set(space, topography, contact, tolerance, separation=separation)
    overlap = topography.double.ravel()[state.cells] - separation
    # The energy is the maximum of a functional of the pressures, so that errors of the pressures enter squared.
    energy = 0.5 * float(np.sum(state.pressure * (overlap + state.misfit)))
    error = 0.5 * float(np.sum(state.misfit**2 / (_SMALLEST_COMPLIANCE + state.bond_compliance)))
    if state.gap.dtype == np.float32:
        error += 0.2 * ROUNDING * float(np.sum(np.abs(state.pressure * overlap)))
    mean_fraction = average_fractions(space.field(state.cells, state.fraction, state.gap.dtype))
    if background is not None:
        mean_fraction += background
    rim = rim_of(state.cells, space.shape)
    mean_fraction = mean_fraction.ravel().astype(float)
    return AdhesiveContact(
        **vars(state),
        energy=energy,
        energy_error=error,
        mean_fraction=mean_fraction[state.cells],
        rim=rim,
        mean_fraction_rim=mean_fraction[rim],
    )
