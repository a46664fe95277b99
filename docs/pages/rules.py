"""Numbers of the page on pull-off and hysteresis: asperities beside boundary elements."""

from __future__ import annotations

import itertools

import numpy as np
import xarray as xr

from icha.contact.models import ASPERITIES, BOUNDARY_ELEMENTS
from pages.tables import Table, means

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


def table(study: xr.Dataset, truth: xr.Dataset) -> Table:
    """Pull-off and loss by boundary elements and by asperities, for the runs that both have.

    Means over the seeds, also of the differences.
    """
    head = ["h′rms", "Δγ, mJ/m²", "", "boundary elements", "asperities", "asperities, %"]
    rows = []
    for (slope, energy), seeds in itertools.groupby(_beside_truth(study, truth), lambda case: case[0]):
        runs = [runs for _, runs in seeds]
        first = [f"{slope:g}", f"{1e3 * energy:g}"]
        for name, what, scale in _COMPARED:
            values = np.array([[scale * float(one[name]) for one in beside] for beside in runs])
            errors = 100 * (values[:, 1:] / values[:, :1] - 1)
            rows.append([*first, what, *means(values, "{:.3g}"), *means(errors, "{:+.0f}")])
            first = ["", ""]
    return Table(head, rows)


def _beside_truth(study, truth):
    """Slope and surface energy (J/m^2), and the runs by boundary elements and by asperities."""
    one = truth.sel(model=BOUNDARY_ELEMENTS)
    for surface, slope, material, seed in itertools.product(
        *(truth[label].values.tolist() for label in ("surface", "rms_slope", "material", "seed"))
    ):
        at = {"surface": surface, "seed": seed, "rms_slope": slope, "material": material}
        energy = float(truth["surface_energy"].sel(material=material))
        yield (slope, energy), [one.sel(at), study.sel(model=ASPERITIES, **at)]
