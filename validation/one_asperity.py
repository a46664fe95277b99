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
import pandas as pd
import scipy.fft

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
    tabor_parameter: float, approaches: Sequence[float] = (3.0, 2.0, 1.0), period: float = 12.0
) -> pd.DataFrame:
    """Unload an adhesive asperity from approaches (m, falling) to the pull-off of the model; rows of `compare`."""
    material = Material(1.0, 1.0, 1 / tabor_parameter)
    surface = paraboloid(resolving_grid(material, period), period)
    # The largest tension of the model, with dF/da = 0, at the approach of the asperity with its images.
    a, summit = np.cbrt(9 * np.pi / 8 * material.adhesion_length), np.zeros((1, 2))
    pull_off = float(displacement_at(JKR(material), period, summit, summit, np.array([a]), np.ones(1))[0])
    gaps = [surface.heights.max() - approach for approach in (*approaches, pull_off)]
    return compare(surface, material, contacts_at_gaps(surface, material, gaps, _TOLERANCE))


def hertz_asperity() -> pd.DataFrame:
    """Press an asperity without adhesion at the loads of the contact radii 1 m and 0.5 m by Hertz's law."""
    material = Material(1.0, 0.0, 1.0)
    surface = paraboloid(512, 16.0)
    pressures = [float(JKR(material).force(radius, 1.0)) / surface.period**2 for radius in (1.0, 0.5)]
    states = [contact_at_load(surface, material, pressure, _TOLERANCE) for pressure in pressures]
    return compare(surface, material, states)


def compare(surface: Surface, material: Material, states: Iterable[OracleState]) -> pd.DataFrame:
    """Compare the model with states of boundary elements, at the same approach and at the same load: a row for each.

    Errors at the same load are NaN from the pull-off force of the model on.
    """
    pull_off, nominal, top = _PULL_OFF * material.surface_energy, surface.period**2, float(surface.heights.max())
    contact = InteractingAsperities(JKR(material), find_summits(surface), surface.rms_height)
    model, rows = contact.untouched(), []
    for state in states:
        separation, force = float(state.gap.mean()), float(state.traction.mean()) * nominal
        zero_gap = state.area_fraction * nominal
        energetic = float(np.mean(np.exp(-state.gap / material.interaction_range))) * nominal
        model = contact.equilibrium(model, separation)
        own_force, area = force_and_area(contact, model)
        area_at_load = own_approach = math.nan
        if force > -pull_off:
            at_load = contact.equilibrium(model, model.separation, Control(PRESSURE, force / nominal))
            area_at_load, own_approach = force_and_area(contact, at_load)[1], top - at_load.separation
        approach = top - separation
        rows.append(
            {
                "force": force,
                "zero_gap_area": zero_gap,
                "energetic_area": energetic,
                "area_icha": area,
                "area_icha_at_load": area_at_load,
                "force_error": (own_force - force) / max(abs(force), pull_off),
                "zero_gap_area_error": area / zero_gap - 1,
                "energetic_area_error": area / energetic - 1,
                "zero_gap_area_error_at_load": area_at_load / zero_gap - 1,
                "energetic_area_error_at_load": area_at_load / energetic - 1,
                "approach_error_at_load": (own_approach - approach) / (1.0 if pull_off else approach),
                "pull_off_error": 1 + force / pull_off if pull_off else math.nan,
                "tabor_parameter": float(material.tabor_parameter(1.0)),
                "grid": surface.grid,
                "strength_number": strength_number(material, surface.spacing),
            }
        )
    return pd.DataFrame(rows)


# --- tables -------------------------------------------------------------------------------------------------------

_ERRORS = {
    "zero_gap_area_error": "area over zero gap, same approach",
    "zero_gap_area_error_at_load": "area over zero gap, same load",
    "energetic_area_error": "area over energetic, same approach",
    "energetic_area_error_at_load": "area over energetic, same load",
    "force_error": "force, same approach",
    "approach_error_at_load": "approach, same load",
}
_BARE = {
    "zero_gap_area_error_at_load": "area, same load",
    "zero_gap_area_error": "area, same approach",
    "approach_error_at_load": "approach, same load",
    "force_error": "force, same approach",
}


def _range(error, digits):
    """Return the range of an error in per cent, one number if both ends are equal as printed."""
    return " to ".join(dict.fromkeys(percent(float(end), digits) for end in (error.min(), error.max())))


def tables(adhesive: Sequence[pd.DataFrame], hertz: pd.DataFrame) -> dict[str, Table]:
    """Return the tables of errors with adhesion, a row for each Tabor parameter, and without."""
    rows = []
    for one in adhesive:
        mu, grid, number = one[["tabor_parameter", "grid", "strength_number"]].iloc[0]
        # The largest tension is that of the state at the pull-off of the model.
        errors = [_range(one[name], 1) for name in _ERRORS] + [percent(one["pull_off_error"].min(), 1)]
        rows.append([f"{mu:g}", f"{grid:.0f}", f"{number:.3f}", *errors])
    radii = np.sqrt(hertz["area_icha_at_load"] / np.pi)
    row = [
        f"{radii.min():.2g} to {radii.max():.2g} R",
        f"{hertz['grid'][0]}",
        *(_range(hertz[name], 2) for name in _BARE),
    ]
    return {
        "one_asperity": Table(["μ", "n", "strength number", *_ERRORS.values(), "pull-off force"], rows),
        "one_asperity_hertz": Table(["contact radius", "n", *_BARE.values()], [row]),
    }


if __name__ == "__main__":
    write_tables(tables([one_asperity(mu) for mu in (2.0, 2.8, 4.0)], hertz_asperity()))
