"""Contact at a finite range of attraction, solved by the boundary-element code Tamaas.

Tamaas is installed with the extra `tamaas` and shares no code with ICHA. Only modules of `icha.references` need Tamaas.
The constant `REFERENCES` lists the publications on the methods of Tamaas.

Tamaas minimises the energy of an elastic half-space in contact with the nodes of the topography. Without adhesion, the
unknowns are the pressures at a given load (Polonsky & Keer). With adhesion, the unknowns are the gaps at a given mean
gap (Rey et al.), and the traction at a gap u is -(dgamma/rho) exp(-u/rho). The load control of Tamaas converges to
wrong states with adhesion. Therefore ICHA searches for the mean gap at which the contact carries a given load.

The gap is zero in contact, and attraction acts in a cohesive zone around the contact. In the law of Johnson, Kendall
and Roberts (JKR), a contact area A lowers the energy by dgamma A. At a finite range, the energetic area replaces A. The
energetic area is the integral of exp(-u/rho) over the nominal area. At fixed mean gap, the derivative of the energy
with respect to dgamma equals minus the energetic area. The energetic area is larger than the area of zero gap. As the
range decreases, both areas tend to the contact area of JKR. The energetic area is close to this limit at much larger
ranges than the area of zero gap.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.fft
import tamaas
import tamaas.utils
import xarray as xr

from icha.asperity.cohesive_zone import longest_spacing, resolution_problem, strength_number
from icha.asperity.material import Material
from icha.boundary_elements.patches import BEYOND_EDGES
from icha.contact.model import GAP_BINS, PRESSURE_BINS, gap_bins
from icha.datasets.attributes import COMPUTED, file_attributes
from icha.datasets.build import bin_values, build_dataset, get_values
from icha.datasets.variables.boundary_elements import SOLUTION
from icha.datasets.variables.terms import MATERIAL, ROUGHNESS
from icha.support.rules import POSITIVE, REFINEMENT, TOLERANCE
from icha.surfaces.surface import Surface

# Tamaas stops at this relative error of the energy that it minimises.
DEFAULT_TOLERANCE = 1e-8
# The search for the mean gap at a load ends at this relative error of the load. It fails after _MAX_SOLVES solutions.
LOAD_TOLERANCE = 2e-4
_MAX_SOLVES = 20
_MAX_ITERATIONS = 100_000
# Numbers of iterations between two checks of the gap: while no node is in contact, and while nodes are in contact.
_OPEN_ITERATIONS, _TOUCHING_ITERATIONS = 50, 1000
# Lengths in h_rms. If the mean gap increases by _DECAY, the load on rough surfaces decreases by about a factor e. The
# first step of a search follows from this decay. No step is longer than _LONGEST_STEP.
_DECAY, _LONGEST_STEP = 0.4, 0.3

REFERENCES = (
    "L. Frérot et al., J. Open Source Softw. 5 (2020) 2121, doi:10.21105/joss.02121; "
    "I. A. Polonsky and L. M. Keer, Wear 231 (1999) 206-219, doi:10.1016/S0043-1648(99)00113-1; "
    "V. Rey, G. Anciaux and J.-F. Molinari, Comput. Mech. 60 (2017) 69-81, doi:10.1007/s00466-017-1392-5; "
    "V. A. Yastrebov, G. Anciaux and J.-F. Molinari, Tribol. Int. 114 (2017) 161-171, "
    "doi:10.1016/j.triboint.2017.04.023"
)


class NotSolved(RuntimeError):
    """Error: boundary elements at a finite range did not converge; the message describes the last state."""


@dataclass(frozen=True, eq=False)
class NodalState:
    """State of a contact at the nodes of its grid.

    Attributes
    ----------
    surface : rough surface on the grid of the solution.
    gap : (n, n) float, m.
    traction : (n, n) float, Pa, positive in compression.
    contact : (n, n) bool, True where the gap is zero.
    residual : relative error that the solver reports.
    solves : number of solutions by Tamaas until this state was found.
    """

    surface: Surface
    gap: np.ndarray
    traction: np.ndarray
    contact: np.ndarray
    residual: float
    solves: int = 1

    @property
    def mean_separation(self) -> float:
        """Mean gap, m."""
        return float(self.gap.mean())

    @property
    def nominal_pressure(self) -> float:
        """Mean traction over the nominal area, including the attraction, Pa."""
        return float(self.traction.mean())

    @property
    def outside_pressure(self) -> float:
        """Force outside the contact, divided by the nominal area, Pa; zero or negative."""
        return float(self.traction[~self.contact].sum()) / self.contact.size

    def energetic_area_fraction(self, material: Material) -> float:
        """Return the energetic area, divided by the nominal area: the mean of exp(-u/rho) over all nodes."""
        raw = np.count_nonzero(self.contact) / self.contact.size
        if material.surface_energy == 0:
            return raw
        return raw - self.outside_pressure * material.interaction_range / material.surface_energy

    def stored_energy(self, material: Material) -> float:
        """Return elastic energy minus energy of adhesion, in J/m^2 of nominal area; 0 if surfaces do not interact.

        The elastic energy is half the mean of traction times displacement.
        """
        displacement = self.gap + self.surface.heights
        displacement -= displacement.mean()
        elastic = float(np.mean(self.traction * displacement)) / 2
        return elastic - material.surface_energy * self.energetic_area_fraction(material)


def finite_range_solution(
    surface: Surface,
    material: Material,
    reduced_pressure: float,
    *,
    refinement: int = 1,
    tolerance: float = DEFAULT_TOLERANCE,
    seed: int = -1,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Solve the contact of a rough surface with a half-space under one load with Tamaas; return the dataset.

    Parameters
    ----------
    surface, material : as for `icha.simulate`; with adhesion, rho is `material.interaction_range`.
    reduced_pressure : p/(E* h'_rms), positive.
    refinement : number of nodes of the solver per node of the surface, along a side.
    tolerance : relative error at which the solver stops.
    seed : number that the dataset records.
    progress : function that is called with a line of text for every mean gap of the search.

    Returns
    -------
    xarray.Dataset of one state (`icha.datasets.variables.boundary_elements.SOLUTION`). Densities refer to the nominal
    area: the integral of `pressure_density` is the area fraction of the nodes in contact, and the integral of
    `gap_density` is 1 minus this fraction. The bins are those of `icha.simulate`.

    Raises
    ------
    ValueError
        If an argument is out of range, or the grid does not resolve the attraction.
    NotSolved
        If the solver does not reach its tolerance, or if no mean gap gives the load.
    """
    state = contact_state(
        surface, material, reduced_pressure, refinement=refinement, tolerance=tolerance, progress=progress
    )
    return _dataset(surface, material, state, reduced_pressure, tolerance, seed)


def contact_state(
    surface: Surface,
    material: Material,
    reduced_pressure: float,
    *,
    refinement: int = 1,
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Callable[[str], None] | None = None,
) -> NodalState:
    """Return the state at all nodes of a contact under one load; the arguments are those of `finite_range_solution`."""
    target = POSITIVE.validate("reduced_pressure", reduced_pressure) * surface.rms_slope * material.contact_modulus
    fine = refine(surface, material, refinement)
    state = _solve_nonadhesive(fine, material, target, TOLERANCE.validate("tolerance", tolerance))
    if material.surface_energy == 0:
        return state
    contact = GapContact(fine, material, tolerance, state.gap)
    return _find_gap_at_load(contact, target, state.mean_separation, progress)


def refine(surface: Surface, material: Material, refinement: int) -> Surface:
    """Return the surface on a finer grid for the solver; raise `ValueError` if this grid is still too coarse."""
    surface.require_periodic("the solver for finite ranges")
    fine = surface.refined(REFINEMENT.validate("refinement", refinement))
    if problem := resolution_problem(material, fine.spacing):
        raise ValueError(f"interaction_range: {problem}")
    return fine


class _Solver:
    """Solver of Tamaas for one surface, in units of h_rms for lengths and E* for pressures."""

    def __init__(self, fine, variable, tolerance):
        """Set up the solver; the mean of `variable` (tamaas.PolonskyKeerRey.pressure or .gap) is prescribed."""
        # With one thread, sums always have the same order, so the same input gives the same bytes.
        tamaas.initialize(1)
        self.tolerance = tolerance
        self.unit = fine.rms_height
        self.model = tamaas.Model(tamaas.model_type.basic_2d, [fine.period / self.unit] * 2, [fine.grid] * 2)
        self.model.E, self.model.nu = 1.0, 0.0
        self.heights = fine.heights / self.unit
        self.solver = tamaas.PolonskyKeerRey(self.model, self.heights, tolerance, variable, variable)
        self.solver.max_iter = _MAX_ITERATIONS

    def iterate(self, mean):
        """Iterate at most `max_iter` times towards a mean pressure or gap; return the relative error."""
        try:
            with tamaas.utils.log_context(tamaas.LogLevel.error):
                return self.solver.solve(mean)
        except tamaas.FloatingPointError as error:
            raise NotSolved(f"boundary elements: {error}") from None

    def require_converged(self, residual):
        """Return the relative error `residual`; raise `NotSolved` if it exceeds the tolerance."""
        if not residual <= self.tolerance:
            raise NotSolved(f"boundary elements did not converge: error {residual:.3g}, tolerance {self.tolerance:g}")
        return residual


def _solve_nonadhesive(fine, material, pressure, tolerance):
    """Return the state without adhesion at a mean pressure, Pa."""
    solver = _Solver(fine, tamaas.PolonskyKeerRey.pressure, tolerance)
    residual = solver.require_converged(solver.iterate(pressure / material.contact_modulus))
    traction = np.array(solver.model.traction)
    contact = traction > 0
    gap = solver.model.displacement - solver.heights
    # Tamaas gives the displacement only up to an additive constant.
    gap -= gap[contact].mean()
    return NodalState(fine, gap * solver.unit, traction * material.contact_modulus, contact, residual)


class GapContact:
    """Contact at given mean gaps; each solution starts from the gaps of the last solution.

    Tamaas divides its error by the load of the contact, so the solver of Tamaas does not stop if no node is in contact.
    Therefore ICHA interrupts the solver at regular intervals. If no node is in contact, ICHA computes the error
    from the difference between traction and law of attraction.
    """

    def __init__(self, fine, material, tolerance, gap=None):
        """Set up the solver; the first solution starts from `gap`, an (n, n) array of gaps in m."""
        self.fine, self.material = fine, material
        self.solver = _Solver(fine, tamaas.PolonskyKeerRey.gap, tolerance)
        unit = self.solver.unit
        if material.surface_energy > 0:
            # Tamaas stores only a reference to the object, so the object must exist as long as the solver.
            self.attraction = tamaas.ExponentialAdhesionFunctional(self.solver.heights)
            self.attraction.parameters = {
                "rho": material.interaction_range / unit,
                "surface_energy": material.adhesion_length / unit,
            }
            self.solver.solver.addFunctionalTerm(self.attraction)
        if gap is not None:
            self.start_from(gap)
        self.solves = 0

    def start_from(self, gap):
        """Start the next solution from the given gaps, (n, n), in m."""
        self.solver.model["gap"][:] = np.maximum(gap, 0.0) / self.solver.unit

    def solve(self, separation):
        """Return the state at a mean gap, m."""
        unit, model = self.solver.unit, self.solver.model
        self.solves += 1
        if self.material.surface_energy == 0 and separation >= self.fine.heights.max():
            self.start_from(separation - self.fine.heights)
            nothing = np.zeros_like(self.fine.heights)
            return NodalState(self.fine, separation - self.fine.heights, nothing, nothing > 0, 0.0, self.solves)
        residual = self._iterate(separation / unit)
        gap, traction = np.array(model["gap"]), np.array(model.traction)
        return NodalState(
            self.fine, gap * unit, traction * self.material.contact_modulus, gap <= 0, residual, self.solves
        )

    def _iterate(self, mean):
        """Iterate to convergence at a mean gap in h_rms, and check the gap at intervals; return the relative error."""
        iterations = 0
        while iterations < _MAX_ITERATIONS:
            self.solver.solver.max_iter = _OPEN_ITERATIONS if self._is_open() else _TOUCHING_ITERATIONS
            iterations += self.solver.solver.max_iter
            residual = self.solver.iterate(mean)
            if not residual <= self.solver.tolerance and self._is_open():
                residual = self._imbalance()
            if residual <= self.solver.tolerance:
                break
        return self.solver.require_converged(residual)

    def _is_open(self):
        """Return True if no node is in contact."""
        return np.min(self.solver.model["gap"]) > 0

    def _imbalance(self):
        """Return the error of a state without contact: the largest difference between traction and attraction.

        The unit is dgamma/rho. The traction is E* q/2 times the displacement for every mode with a wave number q > 0.
        """
        gap, n = np.array(self.solver.model["gap"]), self.fine.grid
        q = np.pi * np.hypot(scipy.fft.fftfreq(n, 1 / n)[:, None], scipy.fft.rfftfreq(n, 1 / n)) / self.fine.period
        displacement = scipy.fft.rfft2(gap + self.solver.heights)
        traction = scipy.fft.irfft2(q * self.solver.unit * displacement, s=gap.shape)
        length = self.material.interaction_range / self.solver.unit
        attraction = np.exp(-gap / length)
        strength = self.material.adhesion_length / self.material.interaction_range
        return float(np.max(np.abs(traction / strength + attraction - attraction.mean())))


def _find_gap_at_load(contact, pressure, separation, progress):
    """Return the state with the mean traction `pressure` (Pa); the search begins at the mean gap `separation` (m)."""
    unit = contact.fine.rms_height
    tried: list[tuple[float, float]] = []
    mean_gap = separation / unit
    while len(tried) < _MAX_SOLVES:
        state = contact.solve(mean_gap * unit)
        error = state.nominal_pressure / pressure - 1
        tried.append((mean_gap, error))
        if progress:
            progress(f"mean gap {mean_gap:.8g} h_rms: load {1 + error:.6g} of the target, error {state.residual:.2g}")
        if abs(error) <= LOAD_TOLERANCE:
            return state
        mean_gap = _next_gap(tried)
    raise NotSolved(
        f"no mean gap was found at which the contact carries the load: after {len(tried)} attempts the smallest "
        f"relative error of the load is {min(abs(e) for _, e in tried):.2g}; expected at most {LOAD_TOLERANCE:g}. The "
        f"last mean gap {tried[-1][0]:.8g} h_rms gave {1 + tried[-1][1]:.6g} times this load"
    )


def _next_gap(tried):
    """Return the next mean gap, in h_rms: a secant step that stays between gaps with too much and too little load.

    tried : pairs of mean gap and relative error of the load.
    """
    gap, error = tried[-1]
    step = _DECAY * (math.log1p(error) if error > -0.9 else -1.0)
    if len(tried) > 1:
        before, error_before = tried[-2]
        if error != error_before:
            step = -error * (gap - before) / (error - error_before)
    step = min(max(step, -_LONGEST_STEP), _LONGEST_STEP)
    too_much = max((g for g, e in tried if e > 0), default=None)
    too_little = min((g for g, e in tried if e < 0), default=None)
    next_gap = max(gap + step, 0.5 * gap)  # gaps are positive
    if too_much is not None and too_little is not None and not too_much < next_gap < too_little:
        next_gap = 0.5 * (too_much + too_little)
    return next_gap


def perimeter_correction(contact: np.ndarray) -> tuple[float, float]:
    """Return the area fraction and the perimeter of a periodic contact map; the area is corrected for the grid error.

    Counts of nodes overestimate the area by (pi - 1 + ln 2)/24 times perimeter times spacing (Yastrebov, Anciaux &
    Molinari 2017, eq. 9). The unit of the perimeter is the grid spacing.
    """
    edges = sum(int(np.count_nonzero(contact != np.roll(contact, 1, axis))) for axis in (0, 1))
    return (np.count_nonzero(contact) - BEYOND_EDGES * edges) / contact.size, float(edges)


def _dataset(surface, material, state, target, tolerance, seed):
    """Build the dataset of a state; `target` is the prescribed reduced pressure."""
    fine, gap, contact = state.surface, state.gap, state.contact
    height, unit = surface.rms_height, material.contact_modulus * surface.rms_slope
    area, edges = perimeter_correction(contact)
    nodes = contact.size
    gap_edges = gap_bins(surface)
    gaps, _ = np.histogram(np.clip(gap[~contact] / height, 0.0, GAP_BINS[-1]), GAP_BINS)
    inside = state.traction[contact] / unit
    clipped = np.clip(inside, PRESSURE_BINS[0], PRESSURE_BINS[-1])
    count, _ = np.histogram(clipped, PRESSURE_BINS)
    load, _ = np.histogram(clipped, PRESSURE_BINS, weights=inside)
    pressure = state.nominal_pressure
    coordinate = np.arange(fine.grid) * fine.spacing
    values = {
        "x": coordinate,
        "y": coordinate,
        "mean_separation": state.mean_separation,
        "nominal_pressure": pressure,
        "reduced_pressure": pressure / unit,
        "target_reduced_pressure": target,
        "load_error": pressure / unit / target - 1,
        "reduced_separation": state.mean_separation / height,
        "contact_area_fraction": area,
        "contact_area_fraction_raw": np.count_nonzero(contact) / nodes,
        "energetic_area_fraction": state.energetic_area_fraction(material),
        "contact_perimeter": edges * fine.spacing,
        "outside_pressure": state.outside_pressure,
        "residual": state.residual,
        "solve_count": state.solves,
        "gap_density": gaps / nodes / np.diff(gap_edges),
        **bin_values("gap", gap_edges),
        "pressure_density": count / nodes / np.diff(PRESSURE_BINS * unit),
        "pressure_bin_mean": np.divide(load, count, out=np.zeros(len(load)), where=count > 0) * unit,
        **bin_values("pressure", PRESSURE_BINS * unit),
        "contact": contact,
        **describe_problem(surface, fine, material, tolerance, seed),
    }
    attrs = attributes(
        material,
        "Rough contact {} adhesion, boundary elements at finite range",
        "One state of a periodic rough surface against an elastic half-space, solved with boundary elements.",
    )
    return build_dataset(SOLUTION, values, attrs)


def describe_problem(
    surface: Surface, fine: Surface, material: Material, tolerance: float, seed: int
) -> dict[str, Any]:
    """Return the values that describe a problem, by variable name: surface, grid of the solver, material, settings."""
    adhesive = material.surface_energy > 0
    return {
        "tolerance": tolerance,
        "refinement": fine.grid // surface.grid,
        **get_values(fine, "grid", "spacing"),
        "longest_spacing": longest_spacing(material) if adhesive else 0.0,
        "strength_number": strength_number(material, fine.spacing),
        **get_values(material, *MATERIAL),
        **get_values(surface, *ROUGHNESS, "period"),
        "tabor_parameter": float(material.tabor_parameter(1 / surface.rms_curvature)),
        "seed": seed,
    }


def attributes(material: Material, title: str, summary: str) -> dict[str, str]:
    """Return the attributes of a dataset from Tamaas; `with` or `without` replaces `{}` in the title."""
    return file_attributes(
        title.format("with" if material.surface_energy > 0 else "without"),
        summary,
        COMPUTED,
        programs=("tamaas",),
        references=REFERENCES,
        keywords=["boundary elements"],
    )
