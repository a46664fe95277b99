"""Tables and figure of docs/error_sources.md, from the datasets of `validation.error_sources`."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.datasets.quantities import label_of
from icha.figures.ensembles import draw_points, points_handles
from icha.figures.looks import legend_below, named_handles
from icha.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    in_style,
    logarithmic_axes,
    new_panels,
    save,
)
from validation.error_sources import effects, relative_radius, shape_ratio, shape_ratio_of_fourth_order
from validation.tables import DOCS, Table, means, pressures, write_tables

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
        if variant in error_sources[0]["variant"].values:
            over = "icha" if variant == "icha_fine_grid" else "boundary_elements"
            rows.append([NAMES[variant], *means(_ratio(error_sources, name, variant, over), "{:.3f}")])
    return Table(["", *pressures(error_sources[0]["reduced_pressure"].values)], rows)


def _ratio(error_sources, name, variant, over="boundary_elements"):
    """Return a variable of a variant over that of another variant, (surfaces, pressures)."""
    return np.array([one[name].sel(variant=variant) / one[name].sel(variant=over) for one in error_sources])


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
    radius, ratio = _of_pairs(error_sources, relative_radius, shape_ratio)
    rows = []
    for low, high in itertools.pairwise(_RADII):
        inside = (radius >= low) & (radius < high)
        if inside.any():
            range_ = f"{low:g} to {high:g}" if np.isfinite(high) else f"over {low:g}"
            rows.append([range_, str(np.count_nonzero(inside)), f"{np.median(ratio[inside]):.3f}"])
    return Table(["aq", "patches", "area over Hertz's"], rows)


def _of_pairs(error_sources, *quantities):
    """Return quantities of the pairs of all surfaces, except those with too few boundary elements in the patch."""
    enough = [one["pair_patch_nodes"].values >= _LEAST_NODES for one in error_sources]
    return [
        np.concatenate([quantity(one)[kept] for one, kept in zip(error_sources, enough, strict=True)])
        for quantity in quantities
    ]


# Name, colour, marker and line style of each variant in the figure.
LOOKS = {
    "icha": ("ICHA (asperities)", BLACK, "o", "-"),
    "without_unions": ("ICHA without unions", BLUE, "s", "--"),
    "independent": ("Hertz, no interaction", ORANGE, "v", ":"),
    "circular_paraboloids": ("BEM, circular paraboloids", GREEN, "^", "--"),
    "elliptic_paraboloids": ("BEM, elliptic paraboloids", VERMILLION, "D", "-"),
}
_EFFECT_COLOURS = (BLUE, SKY, GREEN, ORANGE, VERMILLION)
# Number of medians along each line of panel (d).
_BINS = 8
# Factor between the abscissas of points of the same load.
_APART = 1.06
# Upper end of the axis of panel (d).
_HIGHEST_RATIO = 3.0


@in_style
def figure(error_sources: Sequence[xr.Dataset]) -> Figure:
    """Draw datasets without adhesion at the same loads, of surfaces that differ only in their seeds."""
    fig, ((areas, separations), (shares, singles)) = new_panels(5.7, rows=2)
    _draw_ratios(areas, error_sources, "contact_area_fraction")
    _draw_ratios(separations, error_sources, "mean_separation")
    _draw_effects(shares, error_sources)
    _draw_single_spots(singles, error_sources)
    areas.set_ylabel(r"$A/A_{\mathrm{BEM}}$")
    separations.set_ylabel(r"$\bar{u}/\bar{u}_{\mathrm{BEM}}$")
    for axes in (areas, separations, shares):
        axes.set_xlabel(label_of("reduced_pressure"))
    legend_below(fig, named_handles([areas]) | points_handles([len(error_sources)]))
    return fig


def _draw_ratios(axes, error_sources, name):
    """Draw a variable of the variants over that of boundary elements."""
    axes.axhline(1, color=GREY, lw=0.8)
    for k, (variant, (label, colour, marker, dashes)) in enumerate(LOOKS.items()):
        look = {"color": colour, "marker": marker, "ls": dashes, "ms": 3.8, "lw": 0.9, "label": label}
        p = error_sources[0]["reduced_pressure"].values * _APART ** (k - (len(LOOKS) - 1) / 2)
        draw_points(axes, p, _ratio(error_sources, name, variant), look, positive=True)
    logarithmic_axes(axes, "x")


def _draw_effects(axes, error_sources):
    """Draw the mean effects as bars, positive ones upon each other above zero, negative ones below, and their sum."""
    mean = sum(map(effects, error_sources)) / len(error_sources)
    place = [f"{p:.3g}" for p in mean["reduced_pressure"].values]
    ends = {sign: np.zeros(len(place)) for sign in (-1, 1)}
    for effect, colour in zip(mean, _EFFECT_COLOURS, strict=True):
        bottom = np.where(effect > 0, ends[1], ends[-1])
        axes.bar(place, effect, 0.6, bottom=bottom, color=colour, label=effect["source"].item())
        for sign, end in ends.items():
            end += np.where(sign * effect > 0, effect, 0)
    axes.plot(place, mean.sum("source"), color=BLACK, marker="o", ms=4, lw=1, label="all: the model's error")
    axes.axhline(0, color=GREY, lw=0.8)
    axes.tick_params(axis="x", which="both", length=0)
    # Room for the legend.
    low, high = axes.get_ylim()
    axes.set_ylim(low, 2 * high - low)
    axes.set_ylabel(r"part of $\ln(A/A_{\mathrm{BEM}})$")
    axes.legend(loc="upper left", fontsize=6.5)


def _draw_single_spots(axes, error_sources):
    """Draw the areas of single patches over Hertz's against their radii, and medians with those of fourth order."""
    radius, ratio, expected = _of_pairs(error_sources, relative_radius, shape_ratio, shape_ratio_of_fourth_order)
    axes.axhline(1, color=GREY, lw=0.8)
    axes.plot(radius, ratio, ls="none", marker=".", ms=2.5, color=SKY)
    bins = np.array_split(np.argsort(radius), _BINS)
    # Outside the range of the fourth-order term, the ratio is larger than any other.
    for values, look in (
        (np.nan_to_num(expected, nan=np.inf), {"color": PURPLE, "ls": "--", "label": "fourth-order term"}),
        (ratio, {"color": BLUE, "marker": "o", "label": "boundary elements"}),
    ):
        axes.plot(*([np.median(each[members]) for members in bins] for each in (radius, values)), **look)
    axes.legend(loc="lower right")
    axes.set(xlim=(0, None), ylim=(min(0.8, ratio.min()), min(_HIGHEST_RATIO, 1.2 * ratio.max())))
    axes.set(xlabel=r"radius of the patch  $aq$", ylabel=r"$A/A_{\mathrm{Hertz}}(F)$")


def write(adhesionless: Sequence[xr.Dataset], adhesive: xr.Dataset) -> None:
    """Write all tables and the figure."""
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
    save(figure(adhesionless), DOCS / "images/fig12_error_sources.png", "results/error_sources/fig12.pdf")
