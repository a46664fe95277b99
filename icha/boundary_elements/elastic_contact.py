"""Elastic contact of bonded cells: an active set, whose pressures conjugate gradients find.

Given cells stay in contact, under pressure or tension. Other cells join where the surfaces would overlap, and leave
again in tension: a Newton method for the complementarity of pressure and gap (Hintermueller, Ito & Kunisch, SIAM
J. Optim. 13 (2003) 865). Bonds only pull: a partial cell closes under pressure.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from icha.boundary_elements.cells import find_among, merge_cells, rim_of
from icha.boundary_elements.front import average_fractions, bond_compliance
from icha.boundary_elements.half_space import HalfSpace, Operator
from icha.contact.model import FullContact, NotConverged
from icha.support.parallel import blocks, on_cores

# Relative error of displacements in single precision; fraction of a cell that counts as none, for the same reason.
ROUNDING, NO_CONTACT = 5e-7, 1e-9
# A correction must reduce the error at least to this part; otherwise the iteration has stagnated.
LARGEST_REMAINDER = 0.5
# Part of the error that one correction leaves: while the active set changes, and the smallest in single precision.
_COARSE_PART, _FINE_PART = 0.1, 1e-4
# Smallest compliance of the half-space, 2/q at the shortest wave, in h/E*.
_SMALLEST_COMPLIANCE = np.sqrt(2) / np.pi
# Typical compliance of the half-space per cell, in h/E*, to scale the preconditioner at soft bonds.
_TYPICAL_COMPLIANCE = 2.5
_MAX_CHANGES, _MAX_ITERATIONS = 200, 300
# Rows of a field that one core works on.
_ROWS = 1024


@dataclass(frozen=True, eq=False)
class Contact:
    """Cells in contact. Lengths in cells, pressures in E*.

    Parameters
    ----------
    cells : (k,) int, ascending.
    fraction : (k,), share of the cell's area that is in contact, 0 < f <= 1.
    pressure : (k,), mean of each cell; negative in tension.
    """

    cells: np.ndarray
    fraction: np.ndarray
    pressure: np.ndarray

    def close_cells(self, cells: np.ndarray) -> Contact:
        """Return the contact with these cells, (m,), ascending, fully in contact."""
        present, index = find_among(cells, self.cells)
        fraction = self.fraction.copy()
        fraction[index] = 1.0
        return Contact(*merge_cells(self.cells, cells[~present], (fraction, 1.0), (self.pressure, 0.0)))

    def apply_step(self, fraction_change: np.ndarray, pressure_change: np.ndarray) -> Contact:
        """Return the contact after changes (k,), without cells that lose contact."""
        fraction = np.clip(self.fraction + fraction_change, 0.0, 1.0)
        touching = fraction > NO_CONTACT
        return Contact(self.cells[touching], fraction[touching], (self.pressure + pressure_change)[touching])

    @property
    def bond_compliance(self) -> np.ndarray:
        """Compliance of the bond of each cell, (k,)."""
        return bond_compliance(self.fraction)


@dataclass(frozen=True, eq=False)
class Topography:
    """Heights of a surface in cells, (n, n) or (t, n, n), in double and single precision; largest absolute height."""

    double: np.ndarray
    single: np.ndarray
    largest: float

    @classmethod
    def of(cls, heights: np.ndarray) -> Topography:
        """Topography of heights in double precision."""
        return cls(heights, heights.astype(np.float32), float(max(heights.max(), -heights.min())))

    @property
    def rounding(self) -> float:
        """Error of displacements in single precision, in cells."""
        return ROUNDING * self.largest

    def gap(self, displacement: np.ndarray, separation: float, contact: Contact) -> np.ndarray:
        """Turn a field of displacements into the gap, in place.

        In contact, heights are subtracted in double precision. The result keeps the precision of the field.
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
    """Contact in elastic equilibrium at a separation.

    Parameters
    ----------
    gap : (n, n), at the nodes.
    separation : mean separation.
    misfit : (k,), error of the displacement in contact, not larger than the tolerance.
    tolerance : of the displacement in contact.
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
    """Solve the elastic contact at a separation, or under a load, from the pressures of a given contact.

    Parameters
    ----------
    tolerance : largest error of the displacement in contact, in cells. If it is larger than the rounding of single
        precision, everything is computed in single precision.
    separation : mean separation, in cells; not used under a load.
    load : mean pressure in E*; needs at least one cell in contact.
    sticky : whether cells of the given contact stay in contact under tension.

    Raises
    ------
    FullContact
        If the contact covers the surface at a given separation, which is the mean gap.
    """
    dtype = np.float32 if tolerance > topography.rounding else float
    keep, gap, before, changing = np.full(len(contact.cells), sticky), None, np.inf, not sticky
    for _ in range(_MAX_CHANGES):
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
    """Scale the pressures to the load, if there is one; without a load the contact must not cover the surface."""
    if load is None and len(contact.cells) == space.size and (contact.fraction >= 1).all():
        raise FullContact("the contact covers the whole surface")
    if load is None or not len(contact.cells):
        return contact
    scaled = contact.pressure * (load * space.size / np.sum(contact.pressure))
    return Contact(contact.cells, contact.fraction, scaled)


def _next_active_set(contact, keep, joining, smallest):
    """Contact after partial cells under pressure closed, cells in tension left, and others (m,) joined.

    keep : (k,) bool, cells that do not leave. smallest : smallest pressure at which a cell that is not kept may stay.
    None if nothing changes.
    """
    closing = (contact.pressure > 0) & (contact.fraction < 1)
    staying = keep | (contact.pressure >= smallest)
    if not closing.any() and staying.all() and not len(joining):
        return None
    fraction = np.where(closing, 1.0, contact.fraction)
    cells, *values, keep = merge_cells(
        contact.cells[staying],
        joining,
        (fraction[staying], 1.0),
        (contact.pressure[staying], 0.0),
        (keep[staying], False),
    )
    return Contact(cells, *values), keep


def _compute_gap(space, topography, contact, separation, load, dtype, out=None):
    """Compute the gap everywhere, the misfit in contact, and the separation, which follows from a load."""
    cells = contact.cells
    displacement = space.displacement(cells, contact.pressure.astype(dtype), out=out)
    if load is not None:
        separation = float(np.mean(topography.double.ravel()[cells] - displacement.ravel()[cells]))
    gap = topography.gap(displacement, separation, contact)
    return gap, -gap.ravel()[cells] - contact.bond_compliance * contact.pressure, separation


def _correct_pressures(space, contact, misfit, part, zero_sum):
    """Correct the pressures so that a part of the misfit is left; zero_sum: as of `solve_pressures`."""
    operator = space.restrict_to(contact.cells)
    error = np.abs(misfit).max()
    change, _ = solve_pressures(operator, contact.bond_compliance, misfit / error, max(part, operator.error), zero_sum)
    return Contact(contact.cells, contact.fraction, contact.pressure + error * change)


def _overlapping_cells(gap, cells, tolerance):
    """Cells, ascending, out of contact at which the surfaces overlap by more than a tolerance."""

    def find(rows):
        return rows.start * gap[0].size + np.flatnonzero(gap[rows] < -tolerance)

    overlapping = np.concatenate(on_cores(find, blocks(len(gap), _ROWS)))
    return overlapping[~find_among(overlapping, cells)[0]]


def solve_pressures(
    operator: Operator, bonds: np.ndarray, wanted: np.ndarray, accuracy: float, zero_sum: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Solve (K + bonds) p = wanted by preconditioned conjugate gradients, in single precision.

    Parameters
    ----------
    operator : the half-space K of k cells.
    bonds : (k,), compliance of the bonds.
    wanted : (k,), displacements in cells.
    accuracy : largest error of a displacement, in cells.
    zero_sum : whether the pressures sum up to zero, and `wanted` is met up to a constant.

    Returns
    -------
    Pressures (k,) and the error that is left, (k,).
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
    space: HalfSpace,
    topography: Topography,
    contact: Contact,
    *,
    separation: float = 0.0,
    load: float | None = None,
) -> ElasticContact:
    """Solve the contact without adhesion at a separation (cells) or under a mean pressure (E*).

    contact : contact close to the solution; a load needs at least one cell in contact. Raises as `solve_active_set`.
    """
    if not len(contact.cells):
        cells = np.flatnonzero(topography.double > separation)
        contact = Contact(cells, np.ones(len(cells)), np.zeros(len(cells)))

    def solve(start, tolerance):
        return solve_active_set(space, topography, start, tolerance, separation=separation, load=load, sticky=False)

    return solve(solve(contact, 2 * topography.rounding), 2e-6 * topography.rounding)


@dataclass(frozen=True, eq=False)
class AdhesiveContact(ElasticContact):
    """Elastic contact of bonded cells, with what its front depends on.

    Parameters
    ----------
    energy : elastic, of half-space and bonds, in E* cells^3.
    energy_error : largest amount by which the energy may be underestimated.
    mean_fraction : (k,), Gaussian mean of the fractions, the cell itself included (`average_fractions`).
    rim : (m,) int, cells next to contact, ascending.
    mean_fraction_rim : (m,), the same on the rim.
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
    """Solve the pressures at a separation; parameters as of `solve_active_set`.

    Given cells stay in contact. A partial cell under pressure closes. Overlapping cells join.

    background : part of the mean fraction that is due to contact outside of a window, (t, n, n).
    """
    state = solve_active_set(space, topography, contact, tolerance, separation=separation)
    overlap = topography.double.ravel()[state.cells] - separation
    # The energy is the maximum of this functional of the pressures: their error enters squared.
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
