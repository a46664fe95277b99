"""Tables and figure of docs/error_sources.md, from the datasets of `validation.error_sources`."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.figures.curves import PRESSURE_LABEL
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
    TWO_COLUMNS,
    VERMILLION,
    in_style,
    logarithmic_axes,
    new_figure,
    panel_label,
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


LOOKS = {
    "icha": ("ICHA (asperities)", BLACK, "o", "-"),
    "without_unions": ("ICHA without unions", BLUE, "s", "--"),
    "independent": ("Hertz, no interaction", ORANGE, "v", ":"),
    "circular_paraboloids": ("BEM, circular paraboloids", GREEN, "^", "--"),
    "elliptic_paraboloids": ("BEM, elliptic paraboloids", VERMILLION, "D", "-"),
}
_EFFECT_COLOURS = (BLUE, SKY, GREEN, ORANGE, VERMILLION)
_BINS = 8
# Factor between the abscissas of points of the same load.
_APART = 1.06
# Upper end of the axis of panel (d).
_HIGHEST_RATIO = 3.0


@in_style
def figure(error_sources: Sequence[xr.Dataset]) -> Figure:
    """Draw datasets without adhesion at the same loads, of surfaces that differ only in their seeds."""
    fig = new_figure(TWO_COLUMNS, 5.7)
    (areas, separations), (steps, singles) = fig.subplots(2, 2)
    _draw_ratios(areas, error_sources, "contact_area_fraction")
    _draw_ratios(separations, error_sources, "mean_separation")
    _draw_effects(steps, error_sources)
    _draw_single_spots(singles, error_sources)
    areas.set_ylabel(r"$A/A_{\mathrm{BEM}}$")
    separations.set_ylabel(r"$\bar{u}/\bar{u}_{\mathrm{BEM}}$")
    for ax, letter in zip((areas, separations, steps, singles), "abcd", strict=True):
        panel_label(ax, letter)
    legend_below(fig, named_handles([areas]) | points_handles([len(error_sources)]))
    return fig


def _draw_ratios(ax, error_sources, name):
    ax.axhline(1, color=GREY, lw=0.8)
    for k, (variant, (label, colour, marker, dashes)) in enumerate(LOOKS.items()):
        ratio = np.array(
            [one[name].sel(variant=variant) / one[name].sel(variant="boundary_elements") for one in error_sources]
        )
        look = {"color": colour, "marker": marker, "ls": dashes, "ms": 3.8, "lw": 0.9, "label": label}
        p = error_sources[0]["reduced_pressure"].values * _APART ** (k - (len(LOOKS) - 1) / 2)
        draw_points(ax, p, ratio, look, positive=True)
    logarithmic_axes(ax, "x")
    ax.set_xlabel(PRESSURE_LABEL)


def _draw_effects(ax, error_sources):
    mean = sum(effects(one) for one in error_sources) / len(error_sources)
    p = mean["reduced_pressure"].values
    place = np.arange(len(p))
    above, below = np.zeros(len(p)), np.zeros(len(p))
    for source, colour in zip(mean["source"].values, _EFFECT_COLOURS, strict=True):
        effect = mean.sel(source=source).values
        ax.bar(place, effect, 0.6, bottom=np.where(effect > 0, above, below), color=colour, label=str(source))
        above += np.maximum(effect, 0)
        below += np.minimum(effect, 0)
    ax.plot(place, mean.sum("source"), color=BLACK, marker="o", ms=4, lw=1, label="all: the model's error")
    ax.axhline(0, color=GREY, lw=0.8)
    ax.set_xticks(place, [f"{value:.3g}" for value in p])
    ax.tick_params(axis="x", which="both", length=0)
    ax.set_ylim(1.15 * below.min(), 1.9 * above.max() - 0.9 * below.min())
    ax.set_xlabel(PRESSURE_LABEL)
    ax.set_ylabel(r"part of $\ln(A/A_{\mathrm{BEM}})$")
    ax.legend(loc="upper left", fontsize=6.5, ncols=1)


def _draw_single_spots(ax, error_sources):
    x, ratio, expected = (
        np.concatenate([quantity(one)[one["pair_patch_nodes"].values >= _LEAST_NODES] for one in error_sources])
        for quantity in (relative_radius, shape_ratio, shape_ratio_of_fourth_order)
    )
    ax.axhline(1, color=GREY, lw=0.8)
    ax.plot(x, ratio, ls="none", marker=".", ms=2.5, color=SKY, zorder=2)
    for values, look in (
        (ratio, {"color": BLUE, "marker": "o", "label": "boundary elements", "zorder": 4}),
        (expected, {"color": PURPLE, "ls": "--", "label": "fourth-order term", "zorder": 3}),
    ):
        ax.plot(*medians(x, values), **look)
    ax.legend(loc="lower right")
    ax.set_ylim(min(0.8, ratio.min()), min(_HIGHEST_RATIO, 1.2 * ratio.max()))
    ax.set_xlim(left=0)
    ax.set_xlabel(r"radius of the patch  $aq$")
    ax.set_ylabel(r"$A/A_{\mathrm{Hertz}}(F)$")


def medians(x: np.ndarray, y: np.ndarray) -> tuple[list, list]:
    """Return medians of x and y in bins with equal numbers of points; NaN counts as the largest y."""
    bins = np.array_split(np.argsort(x, kind="stable"), _BINS)
    high = np.where(np.isnan(y), np.inf, y)
    return [np.median(x[members]) for members in bins], [np.median(high[members]) for members in bins]


def write(adhesionless: Sequence[xr.Dataset], adhesive: xr.Dataset) -> None:
    """Write tables and figure."""
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
