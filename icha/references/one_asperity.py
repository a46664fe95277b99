"""One asperity in its periodic cell by the model and by boundary elements, where the two have to agree.

The asperity is a paraboloid of radius of curvature R = 1 m, and E* = 1 Pa. With adhesion dgamma = 1 J/m^2, so that
lengths are in (dgamma^2 R/E*^2)^(1/3), forces in dgamma R, and the range of attraction is one over the Tabor parameter.
Approaches are those of the summit to the mean plane of the cell.

The law of Johnson, Kendall and Roberts (K. L. Johnson, K. Kendall and A. D. Roberts, Proc. R. Soc. Lond. A 324 (1971)
301, doi:10.1098/rspa.1971.0141) is the limit of a vanishing range, that is of a large Tabor parameter (D. Tabor, J.
Colloid Interface Sci. 58 (1977) 2). At a finite one boundary elements have two areas, that of zero gap and the
energetic one (see `icha.references.finite_range`), and the law's area is compared with both. Hertz's law has no
such parameter.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
import scipy.fft
import xarray as xr

from icha.asperity.cohesive_zone import is_resolved, strength_number
from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.contact.model import Control
from icha.datasets.attributes import BOUNDARY_ELEMENTS, COMPUTED, discovery
from icha.datasets.build import build, of
from icha.datasets.variables.one_asperity import ONE_ASPERITY
from icha.datasets.variables.terms import MATERIAL
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.half_space.interaction import displacement_at
from icha.references.finite_range import (
    REFERENCES,
    NodalState,
    contact_state,
    perimeter_correction,
    states_at_mean_separations,
)
from icha.support.rules import GRID, LENGTH, POSITIVE, Real
from icha.surfaces.summits import find_summits
from icha.surfaces.surface import Surface

# Forces and areas have settled to a few parts in 1e5.
DEFAULT_TOLERANCE = 1e-6
# However long the range, contact itself has to span some nodes.
_LEAST_GRID = 64
# J/m^2 and Pa, and the radius of curvature in m: the units of the law.
_ENERGY = _MODULUS = _RADIUS = 1.0

_LAW = (
    "K. L. Johnson, K. Kendall and A. D. Roberts, Proc. R. Soc. Lond. A 324 (1971) 301-313, "
    "doi:10.1098/rspa.1971.0141; D. Tabor, J. Colloid Interface Sci. 58 (1977) 2-13; "
)

_OF_PULL_OFF = ("pull_off_force_icha", "pull_off_force_boundary_elements", "pull_off_error")


def paraboloid(grid: int, period: float, offset: float = 0.0) -> Surface:
    """One bump of radius of curvature 1 m in a periodic cell of side `period` (m), whose edges are valleys.

    offset : of the summit from a node, in cells.
    """
    x = (np.arange(grid) - grid // 2 - offset) * (period / grid)
    return Surface(-(x[:, None] ** 2 + x**2) / (2 * _RADIUS), period)


def resolving_grid(material: Material, period: float) -> int:
    """Fewest nodes along a side of a cell (m) that resolve the attraction, of a number that is quick to transform."""
    grid = _LEAST_GRID
    while not is_resolved(material, period / grid):
        grid = scipy.fft.next_fast_len(grid + 1, real=True)
    return grid


def one_asperity(
    tabor_parameter: float,
    *,
    approaches: Sequence[float] = (3.0, 2.0, 1.0),
    pull_off: bool = True,
    period: float = 12.0,
    grid: int | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Press an adhesive asperity into contact and draw it off, by the model and by boundary elements.

    Parameters
    ----------
    tabor_parameter : positive.
    approaches : in m, that is in (dgamma^2 R/E*^2)^(1/3), falling.
    pull_off : whether to add the approach of the model's pull-off force, which is below all of them: there boundary
        elements have their largest tension, too, and take longest. Without it there are no pull-off forces to compare.
    period : of the cell, m.
    grid : nodes along a side; None: as few as resolve the attraction.
    tolerance : relative error at which the boundary elements' solver may stop.
    progress : called with lines of text.

    Returns
    -------
    xarray.Dataset (`icha.datasets.variables.one_asperity`): along `approach` both sides at the same approach, the last
    that of pull-off; along `given_load` the model at the forces that boundary elements have at the approaches asked
    for, where the model can carry them.

    Raises
    ------
    ValueError
        If an argument is out of range, or the grid does not resolve the attraction.
    icha.references.failures.NotSolved, icha.contact.failures.NotConverged
        If one of the two does not find a state.
    RuntimeError
        If the model is not in contact.
    """
    material = Material(_MODULUS, _ENERGY, 1 / POSITIVE.checked("tabor_parameter", tabor_parameter))
    period = LENGTH.checked("period", period)
    last = _pull_off_approach(JKR(material), period)
    approaches = _falling("approaches", approaches, last)
    grid = resolving_grid(material, period) if grid is None else GRID.checked("grid", grid)
    surface = paraboloid(grid, period)
    states = states_at_mean_separations(
        surface,
        material,
        [surface.heights.max() - approach for approach in (*approaches, *[last] * bool(pull_off))],
        tolerance=tolerance,
        progress=progress,
    )
    compared = _comparison(surface, material, states, len(approaches), tolerance, progress)
    return compared if pull_off else compared.drop_vars(_OF_PULL_OFF)


def hertz_asperity(
    *,
    contact_radii: Sequence[float] = (1.0, 0.5),
    period: float = 16.0,
    grid: int = 512,
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """The same without adhesion.

    Parameters
    ----------
    contact_radii : in m, that is in R, falling: those of the loads by Hertz's law of an asperity alone.
    period, grid, tolerance, progress : as for `one_asperity`.

    Returns
    -------
    xarray.Dataset of those variables that have a meaning without adhesion.

    Raises
    ------
    As `one_asperity`.
    """
    material = Material(_MODULUS, 0.0, 1.0)
    radii = _falling("contact_radii", contact_radii, 0.0)
    surface = paraboloid(GRID.checked("grid", grid), LENGTH.checked("period", period))
    unit = material.contact_modulus * surface.rms_slope * surface.period**2
    loads = [float(JKR(material).force(radius, _RADIUS)) / unit for radius in radii]
    states = (contact_state(surface, material, load, tolerance=tolerance) for load in loads)
    return _comparison(surface, material, states, len(radii), tolerance, progress)


def _falling(name, values, least):
    values = [Real("m").checked(name, value) for value in values]
    if not values or any(below >= above for above, below in itertools.pairwise([*values, least])):
        raise ValueError(f"{name}: {values} must be one or more numbers that fall and stay above {least:.4g} (in m)")
    return values


def _pull_off_approach(law, period):
    """Approach of the asperity, with its images, where its tension is largest, m.

    At the radius (9 pi dgamma R^2/(8 E*))^(1/3), where dF/da = 0.
    """
    summit, R = np.zeros((1, 2)), np.array([_RADIUS])
    a = np.cbrt(9 * np.pi / 8 * law.material.adhesion_length * R**2)
    return float(displacement_at(law, period, summit, summit, a, R)[0])


class _Model:
    """The model's one spot, moved from state to state."""

    def __init__(self, surface, material):
        self.contact = InteractingAsperities(JKR(material), find_summits(surface), surface.rms_height)
        self.top = float(surface.heights.max())
        self.state = self.contact.untouched()

    def at(self, approach):
        """Force (N) and area (m^2) at an approach (m), on from the last."""
        self.state = self.contact.equilibrium(self.state, self.top - approach)
        return self._force_and_area(self.state)

    def carrying(self, force):
        """Area (m^2) and approach (m) at a force (N), from where it is."""
        pressure = Control("pressure", force / self.contact.area)
        loaded = self.contact.equilibrium(self.state, self.state.separation, pressure)
        return self._force_and_area(loaded)[1], self.top - loaded.separation

    def _force_and_area(self, state):
        if len(state.spots) != 1:
            raise RuntimeError(f"one asperity: {len(state.spots)} spots instead of one")
        nominal = self.contact.area
        return self.contact.pressure(state) * nominal, self.contact.area_fraction(state) * nominal


def _comparison(
    surface: Surface,
    material: Material,
    states: Iterable[NodalState],
    held: int,
    tolerance: float,
    progress: Callable[[str], None] | None,
) -> xr.Dataset:
    """The model at the approaches of the boundary elements' states, and at the loads of the first `held` of them."""
    adhesive = material.surface_energy > 0
    pull_off = 1.5 * math.pi * material.surface_energy * _RADIUS
    nominal, top = surface.period**2, float(surface.heights.max())
    model = _Model(surface, material)
    rows, loaded = [], []
    for index, state in enumerate(states):
        approach, force = top - state.mean_separation, state.nominal_pressure * nominal
        zero_gap = perimeter_correction(state.contact)[0] * nominal
        energetic = state.energetic_area_fraction(material) * nominal
        force_icha, area_icha = model.at(approach)
        rows.append((approach, force, zero_gap, energetic, state.residual, force_icha, area_icha))
        if index < held and force > -pull_off:
            loaded.append((index, *model.carrying(force)))
        if progress is not None:
            progress(f"approach {approach:.4g} m: force {force:.6g} N, by ICHA {force_icha:.6g} N")
    approach, force, zero_gap, energetic, residual, force_icha, area_icha = np.array(rows).T
    at = [index for index, *_ in loaded]
    area_at_load, approach_at_load = np.array([solved for _, *solved in loaded]).reshape(-1, 2).T
    length = np.cbrt(material.adhesion_length**2 * _RADIUS) if adhesive else approach[at]
    values = {
        "approach": approach,
        "given_load": force[at],
        "force_boundary_elements": force,
        "zero_gap_area": zero_gap,
        "residual": residual,
        "force_icha": force_icha,
        "area_icha": area_icha,
        "area_icha_at_load": area_at_load,
        "approach_icha_at_load": approach_at_load,
        "approach_boundary_elements_at_load": approach[at],
        "force_error": (force_icha - force) / np.maximum(np.abs(force), pull_off),
        "zero_gap_area_error": area_icha / zero_gap - 1,
        "zero_gap_area_error_at_load": area_at_load / zero_gap[at] - 1,
        "approach_error_at_load": (approach_at_load - approach[at]) / length,
        "tabor_parameter": float(material.tabor_parameter(_RADIUS)),
        **of(material, *MATERIAL),
        "radius_of_curvature": _RADIUS,
        **of(surface, "period", "grid", "spacing"),
        "strength_number": strength_number(material, surface.spacing),
        "tolerance": tolerance,
    }
    if adhesive:
        tension = float(np.max(-force))
        values |= {
            "energetic_area": energetic,
            "pull_off_force_icha": pull_off,
            "pull_off_force_boundary_elements": tension,
            "energetic_area_error": area_icha / energetic - 1,
            "energetic_area_error_at_load": area_at_load / energetic[at] - 1,
            "pull_off_error": (pull_off - tension) / pull_off,
        }
    attrs = discovery(
        f"One asperity {'with' if adhesive else 'without'} adhesion, ICHA and boundary elements",
        "One paraboloid in a periodic cell by the model and by boundary elements, at the same approach and at the same "
        "load.",
        COMPUTED,
        programs=("icha", "tamaas"),
        references=(_LAW if adhesive else "") + REFERENCES,
        keywords=[BOUNDARY_ELEMENTS],
    )
    return build(ONE_ASPERITY, values, attrs)
