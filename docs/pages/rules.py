"""Numbers of the page on pull-off and hysteresis: either rule for united spots beside boundary elements."""

from __future__ import annotations

import itertools

import numpy as np
import xarray as xr

from icha.contact.models import ASPERITIES, BOUNDARY_ELEMENTS
from pages.tables import Table, means

_RULES = ("overlap", "detachment")
# Rules whose distances differ by less than this part are as near.
_TIE = 1e-3
_COMPARED = (
    ("largest_contact_area_fraction", "A/A₀ at the largest load", 1.0),
    ("pull_off_pressure", "pull-off, Pa", 1.0),
    ("hysteresis_loss", "loss, µJ/m²", 1e6),
)


def cases(truth: xr.Dataset) -> str:
    """Surfaces, seeds and slopes of a study in words."""
    surfaces = ", ".join(f"`{name}`" for name in truth["surface"].values)
    seeds, slopes = (", ".join(f"{value:g}" for value in truth[label].values) for label in ("seed", "rms_slope"))
    return f"surface {surfaces}, seeds {seeds}, slope {slopes}"


def table(overlap: xr.Dataset, detachment: xr.Dataset, truth: xr.Dataset) -> Table:
    """Pull-off and loss by boundary elements, and by asperities with either rule, for the runs that all three have.

    Means over the seeds, also of the differences.
    """
    head = ["h′rms", "Δγ, mJ/m²", "", "boundary elements", *_RULES, *(f"{rule}, %" for rule in _RULES)]
    rows = []
    for (slope, energy), seeds in itertools.groupby(_beside_truth(overlap, detachment, truth), lambda case: case[0]):
        runs = [runs for _, runs in seeds]
        first = [f"{slope:g}", f"{1e3 * energy:g}"]
        for name, what, scale in _COMPARED:
            values = np.array([[scale * float(one[name]) for one in beside] for beside in runs])
            errors = 100 * (values[:, 1:] / values[:, :1] - 1)
            rows.append([*first, what, *means(values, "{:.3g}"), *means(errors, "{:+.0f}")])
            first = ["", ""]
    return Table(head, rows)


def nearer_rule(overlap: xr.Dataset, detachment: xr.Dataset, truth: xr.Dataset) -> str:
    """Which rule is nearer to boundary elements in pull-off and in loss, and in how many of the cases."""
    cases = [runs for _, runs in _beside_truth(overlap, detachment, truth)]
    words = []
    for name, what in (("pull_off_pressure", "pull-off"), ("hysteresis_loss", "loss")):
        away = [[abs(float(one[name]) - float(true[name])) for one in others] for true, *others in cases]
        nearer = ["both" if np.isclose(*each, rtol=_TIE) else _RULES[int(np.argmin(each))] for each in away]
        for rule in _RULES:
            if count := nearer.count(rule):
                words.append(f"in {what} `{rule}` is nearer in {count} of {len(cases)} cases")
        if count := nearer.count("both"):
            words.append(f"in {what} both are equally near in {count} of {len(cases)} cases")
    return "; ".join(words)


def _beside_truth(overlap, detachment, truth):
    """Slope and surface energy (J/m^2), and the runs by boundary elements and by asperities under either rule."""
    one = truth.sel(model=BOUNDARY_ELEMENTS)
    for surface, slope, material, seed in itertools.product(
        *(truth[label].values.tolist() for label in ("surface", "rms_slope", "material", "seed"))
    ):
        at = {"surface": surface, "seed": seed, "rms_slope": slope, "material": material}
        others = [study.sel(model=ASPERITIES, **at) for study in (overlap, detachment)]
        yield (slope, float(truth["surface_energy"].sel(material=material))), [one.sel(at), *others]
