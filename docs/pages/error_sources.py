"""Numbers of the page on the sources of the model's error.

`error_sources` are datasets of `icha.references.error_sources` of surfaces that differ in their seeds only.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import xarray as xr

from icha.references.error_sources.chain import BESIDE, CATEGORIES, chain, effects, relative_radius, shape_ratio
from pages.tables import Table, means, pressures

NAMES = {
    "icha": "ICHA",
    "without_unions": "ICHA without unions",
    "field_shape": "… with slope and curvature of the others' field",
    "circular_paraboloids": "boundary elements, circular paraboloids",
    "elliptic_paraboloids": "boundary elements, elliptic paraboloids",
    "boundary_elements": "boundary elements, true topography",
    "independent": "Hertz's summits without interaction",
    "point_forces": "ICHA without unions, interaction by point forces",
    "icha_fine_grid": "ICHA, grid twice as fine",
    "boundary_elements_coarse": "boundary elements, grid half as fine",
}
# Patches of fewer boundary elements have no area to speak of.
LEAST_NODES = 20
_RADII = (0.0, 1.0, 1.5, 2.0, 3.0, np.inf)


def ratios(error_sources: Sequence[xr.Dataset], name: str) -> Table:
    """A variable of every variant over that of boundary elements; the grids' own effects are the last rows."""
    truth = {"icha_fine_grid": "icha"}
    rows = []
    for variant in [*chain(error_sources[0]), *BESIDE]:
        if variant == "boundary_elements" or variant not in error_sources[0]["variant"].values:
            continue
        over = truth.get(variant, "boundary_elements")
        ratio = [one[name].sel(variant=variant).values / one[name].sel(variant=over).values for one in error_sources]
        rows.append([NAMES[variant] + (" (over ICHA)" if over == "icha" else ""), *means(ratio, "{:.3f}")])
    return Table(["", *pressures(error_sources[0]["reduced_pressure"].values)], rows)


def steps(error_sources: Sequence[xr.Dataset]) -> Table:
    """Effects of every step of the chain, and of their sum."""
    each = [100 * effects(one) for one in error_sources]
    rows = [
        [str(source), *means([one.sel(source=source).values for one in each], "{:+.1f}")]
        for source in each[0]["source"].values
    ]
    rows.append(["sum: ln(A/A_BEM) of the model", *means([one.sum("source").values for one in each], "{:+.1f}")])
    return Table(["", *pressures(error_sources[0]["reduced_pressure"].values)], rows)


def split(error_sources: Sequence[xr.Dataset]) -> Table:
    """Areas and loads of spots and patches by category."""
    rows = []
    for category, meaning in CATEGORIES.items():
        own = [one.sel(category=category) for one in error_sources]
        for what, names in (
            ("area", ("spot_area_fraction", "patch_area_fraction")),
            ("load", ("spot_load_share", "patch_load_share")),
        ):
            scale = [
                one["contact_area_fraction"].sel(variant="boundary_elements").values if what == "area" else 1.0
                for one in error_sources
            ]
            sides = [
                np.mean([100 * one[name].values / unit for one, unit in zip(own, scale, strict=True)], axis=0)
                for name in names
            ]
            cells = [f"{model:.1f} / {truth:.1f}" for model, truth in zip(*sides, strict=True)]
            rows.append([f"{meaning}: {what}", *cells])
    return Table(["", *pressures(error_sources[0]["reduced_pressure"].values)], rows)


def single_spots(error_sources: Sequence[xr.Dataset]) -> Table:
    """Median area over Hertz's, in ranges of the patches' radii."""
    radius, ratio, nodes = (
        np.concatenate([quantity(one) for one in error_sources])
        for quantity in (relative_radius, shape_ratio, lambda one: one["pair_patch_nodes"])
    )
    rows = []
    for low, high in itertools.pairwise(_RADII):
        inside = (nodes >= LEAST_NODES) & (radius >= low) & (radius < high)
        if inside.any():
            range_ = f"{low:g} to {high:g}" if np.isfinite(high) else f"over {low:g}"
            rows.append([range_, str(np.count_nonzero(inside)), f"{np.median(ratio[inside]):.3f}"])
    return Table(["aq", "patches", "area over Hertz's"], rows)


def surfaces(error_sources: Sequence[xr.Dataset]) -> dict:
    """What the surfaces of some datasets have in common, and their seeds; lengths in nm."""
    one = error_sources[0]
    return {
        "seeds": ", ".join(str(int(each["seed"])) for each in error_sources),
        "grid": int(one["grid"]),
        "refinement": int(one["refinement"]),
        "adhesion_length": f"{1e9 * float(one['surface_energy'] / one['contact_modulus']):.3g}",
        "interaction_range": f"{1e9 * float(one['interaction_range']):.3g}",
    }
