"""Tables of docs/error_sources.md, from the datasets of `validation.error_sources`."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import xarray as xr

from validation.error_sources import effects, relative_radius, shape_ratio
from validation.tables import Table, means, pressures, write_tables

NAMES = {
    "icha": "ICHA",
    "without_unions": "ICHA without unions",
    "field_shape": "… with slope and curvature of the others' field",
    "circular_paraboloids": "boundary elements, circular paraboloids",
    "elliptic_paraboloids": "boundary elements, elliptic paraboloids",
    "independent": "Hertz's summits without interaction",
    "icha_fine_grid": "ICHA, grid twice as fine (over ICHA)",
    "boundary_elements_coarse": "boundary elements, grid half as fine",
}
# Patches of fewer boundary elements have no accurate area.
_LEAST_NODES = 20
_RADII = (0.0, 1.0, 1.5, 2.0, 3.0, np.inf)


def ratios(error_sources: Sequence[xr.Dataset], name: str) -> Table:
    """Table of a variable of each variant over that of boundary elements; the last rows are effects of the grids."""
    rows = []
    for variant in NAMES:
        if variant not in error_sources[0]["variant"].values:
            continue
        over = "icha" if variant == "icha_fine_grid" else "boundary_elements"
        ratio = [one[name].sel(variant=variant).values / one[name].sel(variant=over).values for one in error_sources]
        rows.append([NAMES[variant], *means(ratio, "{:.3f}")])
    return Table(["", *pressures(error_sources[0]["reduced_pressure"].values)], rows)


def steps(error_sources: Sequence[xr.Dataset]) -> Table:
    """Table of the effects of all steps, and of their sum."""
    each = [100 * effects(one) for one in error_sources]
    rows = [
        [str(source), *means([one.sel(source=source).values for one in each], "{:+.1f}")]
        for source in each[0]["source"].values
    ]
    rows.append(["sum: ln(A/A_BEM) of the model", *means([one.sum("source").values for one in each], "{:+.1f}")])
    return Table(["", *pressures(error_sources[0]["reduced_pressure"].values)], rows)


def single_spots(error_sources: Sequence[xr.Dataset]) -> Table:
    """Table of the median area over Hertz's, in ranges of the radii of the patches."""
    radius, ratio, nodes = (
        np.concatenate([quantity(one) for one in error_sources])
        for quantity in (relative_radius, shape_ratio, lambda one: one["pair_patch_nodes"])
    )
    rows = []
    for low, high in itertools.pairwise(_RADII):
        inside = (nodes >= _LEAST_NODES) & (radius >= low) & (radius < high)
        if inside.any():
            range_ = f"{low:g} to {high:g}" if np.isfinite(high) else f"over {low:g}"
            rows.append([range_, str(np.count_nonzero(inside)), f"{np.median(ratio[inside]):.3f}"])
    return Table(["aq", "patches", "area over Hertz's"], rows)


def write(adhesionless: Sequence[xr.Dataset], adhesive: xr.Dataset) -> None:
    """Write all tables."""
    found = {
        "area": ratios(adhesionless, "contact_area_fraction"),
        "separation": ratios(adhesionless, "mean_separation"),
        "steps": steps(adhesionless),
        "single_spots": single_spots(adhesionless),
        "area_adhesive": ratios([adhesive], "contact_area_fraction"),
        "separation_adhesive": ratios([adhesive], "mean_separation"),
        "steps_adhesive": steps([adhesive]),
    }
    write_tables({f"error_sources_{name}": table for name, table in found.items()})
