"""Contact at a finite range of attraction, by boundary elements: Tamaas, which owes nothing to any code of ICHA's.

It comes with the package's extra `tamaas`; nothing outside `icha.references` needs it.

Tamaas (L. Frérot et al., J. Open Source Softw. 5 (2020) 2121, doi:10.21105/joss.02121) minimises the energy of an
elastic half-space against the nodes of the topography: without adhesion in the pressures, at given load (I. A.
Polonsky and L. M. Keer, Wear 231 (1999) 206, doi:10.1016/S0043-1648(99)00113-1); with adhesion in the gaps, at given
mean gap (V. Rey, G. Anciaux and J.-F. Molinari, Comput. Mech. 60 (2017) 69, doi:10.1007/s00466-017-1392-5), the
traction being (dgamma/rho) exp(-u/rho) outside a hard wall. Its load control ends in other states when there is
adhesion, and calls them converged; so the mean gap that carries a given load is searched for.

Contact is where the gap is zero. Around it a cohesive zone pulls, of which the law of Johnson, Kendall and Roberts
knows the energy alone: there energy falls by dgamma times the contact area. The area with which that holds at a finite
range is the derivative of the energy to the surface energy at fixed mean gap, the integral of exp(-u/rho) over the
surface, here the energetic area. It is larger than the area of zero gap, and both tend to JKR's as the range vanishes,
the energetic one much sooner.
"""

import math
from collections.abc import Callable, Iterable, Iterator
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
from icha.datasets.attributes import COMPUTED, discovery
from icha.datasets.build import bin_values, build, of
from icha.datasets.variables.boundary_elements import SOLUTION
from icha.datasets.variables.terms import MATERIAL, ROUGHNESS
from icha.support.rules import LENGTH, POSITIVE, REFINEMENT, TOLERANCE
from icha.surfaces.surface import Surface

# What is minimised is known to this relative error.
DEFAULT_TOLERANCE = 1e-8
# A load is met to this relative error by the search for its mean gap.
LOAD_TOLERANCE = 2e-4
_MAX_SOLVES = 20
_MAX_ITERATIONS = 100_000
# Between looks at a gap that has been open everywhere, and at one that has not.
_OPEN_ITERATIONS, _TOUCHING_ITERATIONS = 50, 1000
# The first steps of the search, in h_rms: loads fall by a factor e over about this distance, on rough surfaces.
_DECAY = 0.4
_LONGEST_STEP = 0.3

REFERENCES = (
    "L. Frérot et al., J. Open Source Softw. 5 (2020) 2121, doi:10.21105/joss.02121; "
    "I. A. Polonsky and L. M. Keer, Wear 231 (1999) 206-219, doi:10.1016/S0043-1648(99)00113-1; "
    "V. Rey, G. Anciaux and J.-F. Molinari, Comput. Mech. 60 (2017) 69-81, doi:10.1007/s00466-017-1392-5; "
    "V. A. Yastrebov, G. Anciaux and J.-F. Molinari, Tribol. Int. 114 (2017) 161-171, "
    "doi:10.1016/j.triboint.2017.04.023"
)


class NotSolved(RuntimeError):
    """Boundary elements at a finite range did not converge; the message says which."""


@dataclass(frozen=True, eq=False)
class NodalState:
    """A contact at the nodes of its grid.

    surface : on the grid of the solution. gap, m, and traction, Pa, positive in compression, and contact, whether the
    gap is zero: (n, n). residual : the solver's criterion of convergence, a relative error. solves : that it took.
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
        """Mean traction over the nominal area, attraction included, Pa."""
        return float(self.traction.mean())

    @property
    def outside_pressure(self) -> float:
        """Part of the nominal pressure that acts outside the contact, at most zero, Pa."""
        return float(self.traction[~self.contact].sum()) / self.contact.size

    def energetic_area_fraction(self, material: Material) -> float:
        """Energy of adhesion over that of full contact: the mean of exp(-u/rho), 1 in contact."""
        raw = np.count_nonzero(self.contact) / self.contact.size
        if material.surface_energy == 0:
            return raw
        return raw - self.outside_pressure * material.interaction_range / material.surface_energy

    def stored_energy(self, material: Material) -> float:
        """Elastic energy less that of adhesion over the nominal area, J/m^2; 0 far apart.

        The elastic one is half the mean of traction times displacement. Without a jump its derivative to the mean gap
        is minus the nominal pressure.
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
    """Press the surface against the half-space at one load, by boundary elements.

    Parameters
    ----------
    surface, material : as for `icha.simulate`; with adhesion, traction decays over `material.interaction_range`.
    reduced_pressure : p/(E* h'_rms), positive.
    refinement : nodes per node of the surface's grid, along a side.
    tolerance : relative error at which the solver may stop.
    seed : recorded in the dataset.
    progress : called with lines of text: first the numbers that say whether the grid resolves the attraction.

    Returns
    -------
    xarray.Dataset of one state (`icha.datasets.variables.boundary_elements.SOLUTION`). Densities are over the nominal
    area: the integral of `gap_density` and the raw area make 1, that of `pressure_density` is the raw area; the bins
    are those of `icha.simulate`.

    Raises
    ------
    ValueError
        If an argument is out of range, or the grid does not resolve the attraction.
    NotSolved
        If the solver does not reach its tolerance, or no mean gap is found that carries the load.
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
    """The state of which `finite_range_solution` makes a dataset, node by node; arguments and errors are the same."""
    target = POSITIVE.checked("reduced_pressure", reduced_pressure) * surface.rms_slope * material.contact_modulus
    say = progress or silent
    fine = resolved(surface, material, refinement, say)
    state = _without_adhesion(fine, material, target, TOLERANCE.checked("tolerance", tolerance))
    if material.surface_energy == 0:
        return state
    return _carrying(GapContact(fine, material, tolerance, state.gap), target, state.mean_separation, say)


def states_at_mean_separations(
    surface: Surface,
    material: Material,
    mean_separations: Iterable[float],
    *,
    refinement: int = 1,
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Callable[[str], None] | None = None,
) -> Iterator[NodalState]:
    """States of an adhesive contact at given mean gaps, in tension or compression, each from the last.

    Parameters
    ----------
    mean_separations : m, positive, in any order: up and down show hysteresis.
    surface, material, refinement, tolerance, progress : as for `finite_range_solution`.

    Raises
    ------
    ValueError
        If an argument is out of range, the material has no adhesion, or the grid does not resolve it.
    NotSolved
        If the solver does not reach its tolerance.
    """
    if material.surface_energy == 0:
        raise ValueError("surface_energy: 0; without adhesion the load is given, not the mean gap")
    fine = resolved(surface, material, refinement, progress or silent)
    separations = [LENGTH.checked("mean_separations", separation) for separation in mean_separations]
    contact = GapContact(fine, material, TOLERANCE.checked("tolerance", tolerance))
    return (contact.at(separation) for separation in separations)


def silent(line: str) -> None:
    """Progress that nobody asked for."""


def resolved(surface, material, refinement, say):
    """The surface on the solution's grid, which has to resolve the attraction."""
    surface.require_periodic("the solution by boundary elements")
    fine = surface.refined(REFINEMENT.checked("refinement", refinement))
    numbers = f"{fine.grid} nodes a side, spacing {fine.spacing:.4g} m"
    if material.surface_energy > 0:
        numbers += (
            f"; with adhesion at most {longest_spacing(material):.4g} m; sqrt(dgamma dx/E*)/range = "
            f"{strength_number(material, fine.spacing):.3g}"
        )
    say(numbers)
    if problem := resolution_problem(material, fine.spacing):
        raise ValueError(f"interaction_range: {problem}")
    return fine


class _Solver:
    """Tamaas on one surface, in its own units: lengths in h_rms, pressures in E*.

    variable: what is minimised over and whose mean is given, tamaas.PolonskyKeerRey.pressure or .gap.
    """

    def __init__(self, fine, variable, tolerance):
        # One thread: sums keep their order, and results their bytes.
        tamaas.initialize(1)
        self.tolerance = tolerance
        self.unit = fine.rms_height
        self.model = tamaas.Model(tamaas.model_type.basic_2d, [fine.period / self.unit] * 2, [fine.grid] * 2)
        self.model.E, self.model.nu = 1.0, 0.0
        self.heights = fine.heights / self.unit
        self.solver = tamaas.PolonskyKeerRey(self.model, self.heights, tolerance, variable, variable)
        self.solver.max_iter = _MAX_ITERATIONS

    def iterate(self, mean):
        """Iterate towards a mean pressure or gap, at most `max_iter` times; the error reached."""
        try:
            with tamaas.utils.log_context(tamaas.LogLevel.error):
                return self.solver.solve(mean)
        except tamaas.FloatingPointError as error:
            raise NotSolved(f"boundary elements: {error}") from None

    def solve(self, mean):
        """Solve for a mean pressure or gap; the error reached."""
        return self.checked(self.iterate(mean))

    def checked(self, residual):
        """The error reached, which has to be within the tolerance."""
        if not residual <= self.tolerance:
            raise NotSolved(f"boundary elements did not converge: error {residual:.3g}, tolerance {self.tolerance:g}")
        return residual


def _without_adhesion(fine, material, pressure, tolerance):
    """The state at a given mean pressure, Pa."""
    solver = _Solver(fine, tamaas.PolonskyKeerRey.pressure, tolerance)
    residual = solver.solve(pressure / material.contact_modulus)
    traction = np.array(solver.model.traction)
    contact = traction > 0
    gap = solver.model.displacement - solver.heights
    # The displacement is known up to a constant.
    gap -= gap[contact].mean()
    return NodalState(fine, gap * solver.unit, traction * material.contact_modulus, contact, residual)


class GapContact:
    """States at given mean gaps; every solution starts from the last, the first from `gap` (m).

    Tamaas relates its error to what the contact carries; where nothing touches it iterates for ever on a solution that
    it has. So it is stopped now and then, and a gap that is open everywhere is held against the law of the interface.
    """

    def __init__(self, fine, material, tolerance, gap=None):
        """Set the solver up."""
        self.fine, self.material = fine, material
        self.solver = _Solver(fine, tamaas.PolonskyKeerRey.gap, tolerance)
        unit = self.solver.unit
        if material.surface_energy > 0:
            # Tamaas keeps a reference only.
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
        """Let the next solution start from a gap, m."""
        self.solver.model["gap"][:] = np.maximum(gap, 0.0) / self.solver.unit

    def at(self, separation):
        """The state at a mean gap, m."""
        unit, model = self.solver.unit, self.solver.model
        self.solves += 1
        if self.material.surface_energy == 0 and separation >= self.fine.heights.max():
            self.start_from(separation - self.fine.heights)
            nothing = np.zeros_like(self.fine.heights)
            return NodalState(self.fine, separation - self.fine.heights, nothing, nothing > 0, 0.0, self.solves)
        residual = self._solved(separation / unit)
        gap, traction = np.array(model["gap"]), np.array(model.traction)
        return NodalState(
            self.fine, gap * unit, traction * self.material.contact_modulus, gap <= 0, residual, self.solves
        )

    def _solved(self, mean):
        """Solve for a mean gap, looking at the gap now and then; the error reached."""
        iterations = 0
        while iterations < _MAX_ITERATIONS:
            self.solver.solver.max_iter = _OPEN_ITERATIONS if self._is_open() else _TOUCHING_ITERATIONS
            iterations += self.solver.solver.max_iter
            residual = self.solver.iterate(mean)
            if not residual <= self.solver.tolerance and self._is_open():
                residual = self._imbalance()
            if residual <= self.solver.tolerance:
                break
        return self.solver.checked(residual)

    def _is_open(self):
        """Whether nothing touches."""
        return np.min(self.solver.model["gap"]) > 0

    def _imbalance(self):
        """Largest difference between traction and attraction over the interface's strength, where nothing touches.

        The half-space's traction is E* q/2 times the modes of its displacement; its mean is free.
        """
        gap, n = np.array(self.solver.model["gap"]), self.fine.grid
        q = np.pi * np.hypot(scipy.fft.fftfreq(n, 1 / n)[:, None], scipy.fft.rfftfreq(n, 1 / n)) / self.fine.period
        displacement = scipy.fft.rfft2(gap + self.solver.heights)
        traction = scipy.fft.irfft2(q * self.solver.unit * displacement, s=gap.shape)
        length = self.material.interaction_range / self.solver.unit
        attraction = np.exp(-gap / length)
        strength = self.material.adhesion_length / self.material.interaction_range
        return float(np.max(np.abs(traction / strength + attraction - attraction.mean())))


def _carrying(contact, pressure, separation, say):
    """Search for the mean gap at which the mean traction is `pressure` (Pa), from a first guess (m)."""
    unit = contact.fine.rms_height
    tried: list[tuple[float, float]] = []
    mean_gap = separation / unit
    while len(tried) < _MAX_SOLVES:
        state = contact.at(mean_gap * unit)
        error = state.nominal_pressure / pressure - 1
        tried.append((mean_gap, error))
        say(f"mean gap {mean_gap:.8g} h_rms: load {1 + error:.6g} of the one asked for, error {state.residual:.2g}")
        if abs(error) <= LOAD_TOLERANCE:
            return state
        mean_gap = _next_gap(tried)
    raise NotSolved(
        f"no mean gap was found that carries the load: {len(tried)} tries, the last at {tried[-1][0]:.8g} h_rms with "
        f"{1 + tried[-1][1]:.6g} of it; nearest {min(abs(e) for _, e in tried):.2g} off, allowed {LOAD_TOLERANCE:g}"
    )


def _next_gap(tried):
    """Secant in the load, kept within the mean gaps known to carry too much and too little."""
    gap, error = tried[-1]
    step = _DECAY * (math.log1p(error) if error > -0.9 else -1.0)
    if len(tried) > 1:
        before, error_before = tried[-2]
        if error != error_before:
            step = -error * (gap - before) / (error - error_before)
    step = min(max(step, -_LONGEST_STEP), _LONGEST_STEP)
    too_much = max((g for g, e in tried if e > 0), default=None)
    too_little = min((g for g, e in tried if e < 0), default=None)
    following = max(gap + step, 0.5 * gap)  # gaps are positive
    if too_much is not None and too_little is not None and not too_much < following < too_little:
        following = 0.5 * (too_much + too_little)
    return following


def perimeter_correction(contact: np.ndarray) -> tuple[float, float]:
    """Contact area fraction corrected by the perimeter, and the perimeter in spacings, of a periodic map of contact.

    Nodes along the edge overestimate an area by (pi - 1 + ln 2)/24 of the perimeter times the spacing (Yastrebov,
    Anciaux & Molinari 2017, eq. 9 there).
    """
    edges = sum(int(np.count_nonzero(contact != np.roll(contact, 1, axis))) for axis in (0, 1))
    return (np.count_nonzero(contact) - BEYOND_EDGES * edges) / contact.size, float(edges)


def _dataset(surface, material, state, target, tolerance, seed):
    fine, gap, contact = state.surface, state.gap, state.contact
    height, unit = surface.rms_height, material.contact_modulus * surface.rms_slope
    area, edges = perimeter_correction(contact)
    nodes = contact.size
    gap_edges = gap_bins(surface)
    gaps, _ = np.histogram(np.clip(gap[~contact] / height, 0.0, GAP_BINS[-1]), GAP_BINS)
    inside = state.traction[contact] / unit
    counted = np.clip(inside, PRESSURE_BINS[0], PRESSURE_BINS[-1])
    count, _ = np.histogram(counted, PRESSURE_BINS)
    load, _ = np.histogram(counted, PRESSURE_BINS, weights=inside)
    pressure = state.nominal_pressure
    along = np.arange(fine.grid) * fine.spacing
    values = {
        "x": along,
        "y": along,
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
        **asked_for(surface, fine, material, tolerance, seed),
    }
    attrs = attributes(
        material,
        "Rough contact {} adhesion, boundary elements at finite range",
        "One state of a periodic rough surface against an elastic half-space, by boundary elements.",
    )
    return build(SOLUTION, values, attrs)


def asked_for(surface: Surface, fine: Surface, material: Material, tolerance: float, seed: int) -> dict[str, Any]:
    """Variables of a dataset that say what was solved: surface, its grid of the solution, material and settings."""
    adhesive = material.surface_energy > 0
    return {
        "tolerance": tolerance,
        "refinement": fine.grid // surface.grid,
        **of(fine, "grid", "spacing"),
        "longest_spacing": longest_spacing(material) if adhesive else 0.0,
        "strength_number": strength_number(material, fine.spacing),
        **of(material, *MATERIAL),
        **of(surface, *ROUGHNESS, "period"),
        "tabor_parameter": float(material.tabor_parameter(1 / surface.rms_curvature)),
        "seed": seed,
    }


def attributes(material: Material, title: str, summary: str) -> dict[str, str]:
    """Attributes of a dataset by Tamaas; in the title, braces become `with` or `without`."""
    return discovery(
        title.format("with" if material.surface_energy > 0 else "without"),
        summary,
        COMPUTED,
        programs=("tamaas",),
        references=REFERENCES,
        keywords=["boundary elements"],
    )
