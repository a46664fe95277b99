"""One asperity in its periodic cell: the model against boundary elements.

The asperity is a paraboloid of radius of curvature R = 1 m, and E* = 1 Pa. With adhesion dgamma = 1 J/m^2, so that
lengths are in (dgamma^2 R/E*^2)^(1/3), forces in dgamma R, and the range of attraction is one over the Tabor parameter.
Approaches are those of the summit to the mean plane of the cell.

The law of Johnson, Kendall and Roberts (Proc. R. Soc. Lond. A 324 (1971) 301, doi:10.1098/rspa.1971.0141) is the limit
of a vanishing range, that is of a large Tabor parameter (D. Tabor, J. Colloid Interface Sci. 58 (1977) 2). At a finite
range boundary elements have two areas, that of zero gap and the energetic one, the integral of exp(-u/rho); the area of
the law is compared with both. The boundary elements are those of Tamaas (`validation.tamaas_oracle`).

A grid resolves the attraction if its spacing is at most the length of the cohesive zone, 8 rho^2 E*/(3 pi dgamma), and
if nodes do not jump into contact one at a time: sqrt(dgamma dx/E*)/rho < 1/2 (A. Wang, Y. Zhou and M. H. Müser,
Lubricants 9 (2021) 17, doi:10.3390/lubricants9020017).

`python -m validation.one_asperity` takes some ten minutes and writes the tables of docs/validation.md, "One asperity".
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np
import scipy.fft
import xarray as xr

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.contact.model import PRESSURE, Control
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.half_space.interaction import displacement_at
from icha.surfaces.summits import find_summits
from icha.surfaces.surface import Surface
from validation.single_contacts import force_and_area
from validation.surfaces import paraboloid
from validation.tables import Table, percent, write_tables
from validation.tamaas_oracle import OracleState, contact_at_load, contacts_at_gaps

# Relative tolerance of the boundary elements, with which forces and areas are right to a few parts in 1e5.
_TOLERANCE = 1e-6
# Least nodes along a side, so that the contact spans some nodes at any range.
_LEAST_GRID = 64
# Limit of the number sqrt(dgamma dx/E*)/rho, above which nodes jump into contact one at a time.
MAX_STRENGTH_NUMBER = 0.5
_PULL_OFF = 1.5 * math.pi


def strength_number(material: Material, spacing: float) -> float:
    """Return sqrt(dgamma dx/E*)/rho for a spacing dx, m: the distance over which one node jumps, divided by rho."""
    return math.sqrt(material.adhesion_length * spacing) / material.interaction_range


def resolving_grid(material: Material, period: float) -> int:
    """Return the least number of nodes along a period (m) that resolves the attraction and is fast to transform."""
    zone = 8 * material.interaction_range**2 / (3 * math.pi * material.adhesion_length)
    grid = _LEAST_GRID
    while period / grid > zone or strength_number(material, period / grid) >= MAX_STRENGTH_NUMBER:
        grid = scipy.fft.next_fast_len(grid + 1, real=True)
    return grid


def one_asperity(
    tabor_parameter: float,
    *,
    approaches: Sequence[float] = (3.0, 2.0, 1.0),
    period: float = 12.0,
    to_pull_off: bool = True,
) -> xr.Dataset:
    """Load an adhesive asperity and unload it, with the model and with boundary elements.

    Parameters
    ----------
    tabor_parameter : positive.
    approaches : m, that is (dgamma^2 R/E*^2)^(1/3), falling.
    period : of the cell, m.
    to_pull_off : whether the approach at the pull-off force of the model is added.

    Returns
    -------
    xarray.Dataset: along `approach` both sides at the same approach; along `given_load` the model at the forces of the
    boundary elements at the given approaches, if the model can carry them.
    """
    material = Material(1.0, 1.0, 1 / tabor_parameter)
    surface = paraboloid(resolving_grid(material, period), period)
    all_approaches = (*approaches, *([pull_off_approach(JKR(material), period)] if to_pull_off else []))
    gaps = (surface.heights.max() - approach for approach in all_approaches)
    states = contacts_at_gaps(surface, material, gaps, _TOLERANCE)
    return _comparison(surface, material, states, len(approaches))


def hertz_asperity() -> xr.Dataset:
    """Compare without adhesion, at the loads of the contact radii 1 m and 0.5 m by Hertz's law."""
    material = Material(1.0, 0.0, 1.0)
    surface = paraboloid(512, 16.0)
    pressures = [float(JKR(material).force(radius, 1.0)) / surface.period**2 for radius in (1.0, 0.5)]
    states = (contact_at_load(surface, material, pressure, _TOLERANCE) for pressure in pressures)
    return _comparison(surface, material, states, len(pressures))


def pull_off_approach(law: JKR, period: float) -> float:
    """Return the approach of the asperity with its images at the largest tension, m.

    The radius is (9 pi dgamma R^2/(8 E*))^(1/3), where dF/da = 0.
    """
    summit, R = np.zeros((1, 2)), np.ones(1)
    a = np.cbrt(9 * np.pi / 8 * law.material.adhesion_length * R**2)
    return float(displacement_at(law, period, summit, summit, a, R)[0])


def _comparison(surface: Surface, material: Material, states: Iterable[OracleState], loaded: int) -> xr.Dataset:
    """Compare at the approaches of the boundary elements' states, and at the loads of the first `loaded` of them."""
    pull_off = _PULL_OFF * material.surface_energy
    nominal, top = surface.period**2, float(surface.heights.max())
    contact = InteractingAsperities(JKR(material), find_summits(surface), surface.rms_height)
    model = contact.untouched()
    rows, at_load = [], []
    for index, state in enumerate(states):
        separation = float(state.gap.mean())
        approach, force = top - separation, float(state.traction.mean()) * nominal
        zero_gap = state.area_fraction * nominal
        energetic = float(np.mean(np.exp(-state.gap / material.interaction_range))) * nominal
        model = contact.equilibrium(model, separation)
        rows.append((approach, force, zero_gap, energetic, *force_and_area(contact, model)))
        if index < loaded and force > -pull_off:
            at_given_load = contact.equilibrium(model, model.separation, Control(PRESSURE, force / nominal))
            at_load.append((index, force_and_area(contact, at_given_load)[1], top - at_given_load.separation))
    approach, force, zero_gap, energetic, force_icha, area_icha = np.array(rows).T
    at = [index for index, *_ in at_load]
    area_at_load, approach_at_load = np.array([solved for _, *solved in at_load]).reshape(-1, 2).T
    length = np.cbrt(material.adhesion_length**2) if pull_off else approach[at]
    along, by_load = ("approach",), ("given_load",)
    values = {
        "force_boundary_elements": (along, force),
        "zero_gap_area": (along, zero_gap),
        "energetic_area": (along, energetic),
        "force_icha": (along, force_icha),
        "area_icha": (along, area_icha),
        "area_icha_at_load": (by_load, area_at_load),
        "force_error": (along, (force_icha - force) / np.maximum(np.abs(force), pull_off)),
        "zero_gap_area_error": (along, area_icha / zero_gap - 1),
        "energetic_area_error": (along, area_icha / energetic - 1),
        "zero_gap_area_error_at_load": (by_load, area_at_load / zero_gap[at] - 1),
        "energetic_area_error_at_load": (by_load, area_at_load / energetic[at] - 1),
        "approach_error_at_load": (by_load, (approach_at_load - approach[at]) / length),
        "tabor_parameter": float(material.tabor_parameter(1.0)),
        "grid": surface.grid,
        "strength_number": strength_number(material, surface.spacing),
    }
    if pull_off:
        values["pull_off_error"] = (pull_off - float(np.max(-force))) / pull_off
    return xr.Dataset(values, {"approach": approach, "given_load": force[at]})


# --- tables -------------------------------------------------------------------------------------------------------

_ERRORS = {
    "zero_gap_area_error": "area over zero gap, same approach",
    "zero_gap_area_error_at_load": "area over zero gap, same load",
    "energetic_area_error": "area over energetic, same approach",
    "energetic_area_error_at_load": "area over energetic, same load",
    "force_error": "force, same approach",
    "approach_error_at_load": "approach, same load",
    "pull_off_error": "pull-off force",
}


def _range(error, digits):
    """Return the range of an error in per cent, one number if both ends are equal as printed, a dash if empty."""
    if not error.size:
        return "–"
    return " to ".join(dict.fromkeys(percent(float(end), digits) for end in (error.min(), error.max())))


def tables(adhesive: Sequence[xr.Dataset], hertz: xr.Dataset) -> dict[str, Table]:
    """Return the tables of errors with adhesion, a row for each Tabor parameter, and without."""
    rows = [
        [
            f"{float(one['tabor_parameter']):g}",
            str(int(one["grid"])),
            f"{float(one['strength_number']):.3f}",
            *(_range(one[name], 1) for name in _ERRORS),
        ]
        for one in adhesive
    ]
    radii = np.sqrt(hertz["area_icha_at_load"].values / np.pi)
    bare = {
        "area, same load": "zero_gap_area_error_at_load",
        "area, same approach": "zero_gap_area_error",
        "approach, same load": "approach_error_at_load",
        "force, same approach": "force_error",
    }
    row = [f"{radii.min():.2g} to {radii.max():.2g} R", str(int(hertz["grid"]))]
    row += [_range(hertz[name], 2) for name in bare.values()]
    return {
        "one_asperity": Table(["μ", "n", "strength number", *_ERRORS.values()], rows),
        "one_asperity_hertz": Table(["contact radius", "n", *bare], [row]),
    }


if __name__ == "__main__":
    write_tables(tables([one_asperity(mu) for mu in (2.0, 2.8, 4.0)], hertz_asperity()))
