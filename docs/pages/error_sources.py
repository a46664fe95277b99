"""The page of the documentation on the sources of the model's error: words, and tables from the datasets."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import xarray as xr

from icha.references.error_sources import BESIDE, CATEGORIES, chain, effects, relative_radius, shape_ratio
from pages.tables import means, pressures, table

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

_TITLE = """# Where the model's error comes from

On one topography and without adhesion one thing at a time is switched between the model and boundary elements
(`icha.references.error_sources` says how each variant is solved). Boundary elements can be given, instead of the
topography, the surface that the model assumes: the upper envelope of its summits' paraboloids. What then still differs
from the model is contact mechanics and coalescence; what differs from the solution on the true topography is the shape
of the summits.
"""

_FINDING = """## The finding

The model replaces every summit by its osculating paraboloid. Where curvature is correlated over only a part of the
shortest wave and is large at a summit, the real surface falls off less steeply than that a little away from the top.
So paraboloids give too little area at a given load and let the surfaces come too close. This alone accounts for more
than the whole error of the area, and for most of that of the separation. What else the model simplifies makes its area
too large and hides a part of the error:

- a summit stands for an ellipse of the same Gaussian curvature, which at the same load has a smaller area than the
  circle;
- the displacement by other spots is taken at a spot's centre, while its curvature across the spot sharpens the summit;
- unions have a little more area than the discs that they replace cover together.

The error must vanish with the load, since contact then shrinks onto the tops of the highest summits, where nothing but
their curvature counts; but the radius of a contact falls only as the third root of its force, so slowly that the loads
of the tables do not show it, only the single spots below. Contacts that
the model misses, contacts that are not there, the far field and the grids matter little. The steps are taken in one
order, and the effects are not independent: another order would share them out somewhat differently. Only their sum is
the model's error.
"""

_SINGLE = """## Single spots

Where one spot of one summit stands against one patch of the boundary elements, the patch's area is compared with that
by Hertz at the patch's own force, so that who carries how much does not enter. The table has the median, in ranges of
the patch's radius a times the wave number q = (⟨q⁴⟩/⟨q²⟩)^½ of the surface; patches of fewer than {least} boundary
elements are left out. Panel (d) of the figure has what the fourth-order terms of the same summits give: about the
right growth of small patches and too much beyond, where higher orders enter.
"""

_REST = """## What cannot be attributed

- The last step holds everything that a surface is beyond the paraboloids of its summits: blunt tops as well as the
  ridges between them. Only for single spots are the tops seen alone.
- Envelopes of paraboloids bury low summits beside high flat ones, which the model keeps; this is part of "rest of the
  contact mechanics", together with the higher orders of the others' field and with overlaps.
- Patches that spots share, or united spots, cannot be compared one by one: a patch there has no counterpart of its own.
"""


_WITH_ADHESION = """The model has the law of Johnson, Kendall and Roberts, which is that of ranges short against the
deformation around a contact. A range that the grid resolves is not short, so that the first step, from the model to
circular paraboloids, holds this difference besides contact mechanics and unions; it can be larger than all others, and
hide the effect of the shape. The model is not solved without its unions here.
"""


def page(adhesionless: Sequence[xr.Dataset], adhesive: Sequence[xr.Dataset] = (), *, figure: str, command: str) -> str:
    """The page, in Markdown.

    Parameters
    ----------
    adhesionless, adhesive : datasets of `icha.references.error_sources.error_sources`, of surfaces that differ in their
        seeds only.
    figure : path of figure 12 relative to the page.
    command : by which the page is written again.
    """
    parts = [
        _TITLE,
        f"Every number on this page is computed, and the page written, by `{command}`; {_surfaces(adhesionless)}",
        f"![From the model to boundary elements, one thing at a time]({figure})\n",
        _FINDING,
        "## Area and separation over those of boundary elements\n",
        "Contact area at the same load (mean ± standard deviation over the surfaces):\n",
        ratios(adhesionless, "contact_area_fraction"),
        "Mean separation at the same load:\n",
        ratios(adhesionless, "mean_separation"),
        "What every step adds to the logarithm of the area, in per cent:\n",
        steps(adhesionless),
        "## Spot by spot\n",
        "Spots of the model and patches of the boundary elements that lie on each other are put in groups. In per "
        "cent, the model before the stroke and boundary elements after it: their areas over the boundary elements' "
        "whole area, and their parts of the load.\n",
        split(adhesionless),
        _SINGLE.format(least=LEAST_NODES),
        single_spots(adhesionless),
    ]
    if adhesive:
        first = adhesive[0]
        length, range_ = float(first["surface_energy"] / first["contact_modulus"]), float(first["interaction_range"])
        parts += [
            "## With adhesion\n",
            f"Adhesion of Δγ/E\\* = {length * 1e9:.3g} nm and a range of {range_ * 1e9:.3g} nm, which the grid "
            f"resolves; the boundary elements' area is that of zero gap; {_surfaces(adhesive)}",
            _WITH_ADHESION,
            "Contact area at the same load:\n",
            ratios(adhesive, "contact_area_fraction"),
            "Mean separation at the same load:\n",
            ratios(adhesive, "mean_separation"),
            "What every step adds to the logarithm of the area, in per cent:\n",
            steps(adhesive),
        ]
    return "\n".join([*parts, _REST])


def ratios(error_sources: Sequence[xr.Dataset], name: str) -> str:
    """Table of a variable of every variant over that of boundary elements; the grids' own effects are the last rows."""
    truth = {"icha_fine_grid": "icha"}
    rows = []
    for variant in [*chain(error_sources[0]), *BESIDE]:
        if variant == "boundary_elements" or variant not in error_sources[0]["variant"].values:
            continue
        over = truth.get(variant, "boundary_elements")
        ratio = [one[name].sel(variant=variant).values / one[name].sel(variant=over).values for one in error_sources]
        rows.append([NAMES[variant] + (" (over ICHA)" if over == "icha" else ""), *means(ratio, "{:.3f}")])
    return table(["", *pressures(error_sources[0]["reduced_pressure"].values)], rows)


def steps(error_sources: Sequence[xr.Dataset]) -> str:
    """Table of the effects of every step of the chain, and of their sum."""
    each = [100 * effects(one) for one in error_sources]
    rows = [
        [str(source), *means([one.sel(source=source).values for one in each], "{:+.1f}")]
        for source in each[0]["source"].values
    ]
    rows.append(["sum: ln(A/A_BEM) of the model", *means([one.sum("source").values for one in each], "{:+.1f}")])
    return table(["", *pressures(error_sources[0]["reduced_pressure"].values)], rows)


def split(error_sources: Sequence[xr.Dataset]) -> str:
    """Table of the areas and loads of spots and patches by category."""
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
    return table(["", *pressures(error_sources[0]["reduced_pressure"].values)], rows)


def single_spots(error_sources: Sequence[xr.Dataset]) -> str:
    """Table of the median area over Hertz's, in ranges of the patches' radii."""
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
    return table(["aq", "patches", "area over Hertz's"], rows)


def _surfaces(error_sources):
    one = error_sources[0]
    seeds = ", ".join(str(int(each["seed"])) for each in error_sources)
    grid, refinement = int(one["grid"]), int(one["refinement"])
    return (
        f"surfaces of the same spectrum, seed {seeds}, {grid} × {grid} nodes; "
        f"boundary elements {refinement} times as fine.\n"
    )
