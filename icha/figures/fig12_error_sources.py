"""Fig. 12: from the model to boundary elements, one thing at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from icha.datasets import results
from icha.datasets.labels import ContactLabels
from icha.figures.curves import PRESSURE_LABEL
from icha.figures.declaration import Campaign, Declaration, FigureOptions, Inputs
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
    logarithmic_axes,
    new_figure,
    panel_label,
    styled,
)
from icha.support.values import Name, Problem, unknown

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class SourcesFigure(FigureOptions):
    """A figure of the sources of the model's error."""

    entry: Name = Field(description="Name of the entry of `error_sources` that is drawn: its runs without adhesion.")

    def studies_of(self, campaign: Campaign) -> tuple[str, ...]:
        """The one beside which the entry stands."""
        return (campaign.error_sources[self.entry].study,)

    def arguments(self) -> dict[str, Any]:
        """Files only."""
        return {}

    def problems(self, campaign: Campaign) -> Iterator[Problem]:
        """What keeps the runs without adhesion of the entry from differing in their seeds only."""
        yield from unknown(("entry",), self.entry, campaign.error_sources)
        entry = campaign.error_sources.get(self.entry)
        if entry is None or entry.study not in campaign.studies:
            return
        contacts = campaign.solved(entry)
        bare = [each for each in contacts if campaign.materials[each.material].surface_energy == 0]
        for what, asked in (
            ("surface", [each.surface for each in contacts]),
            ("rms slope", [each.rms_slope for each in contacts]),
            ("material without adhesion", [each.material for each in bare]),
        ):
            there = list(dict.fromkeys(asked))
            if len(there) != 1:
                listed = f" ({', '.join(map(str, there))})" if there else ""
                reason = f"has not one {what} but {len(there)}{listed}; allowed: an entry with one, and any seeds"
                yield ("entry",), self.entry, reason


def inputs(campaign: Campaign, options: SourcesFigure, files: results.ResultFiles) -> Inputs:
    """The entry's runs without adhesion."""
    labels = [ContactLabels(options.entry, *each) for each in campaign.solved(campaign.error_sources[options.entry])]
    bare = [each for each in labels if campaign.materials[each.material].surface_energy == 0]
    return {"error_sources": [files.path(results.ERROR_SOURCES, each) for each in bare]}


DECLARATION = Declaration(
    description="Steps from the model to boundary elements, each of which changes one thing.",
    options=SourcesFigure,
    inputs=inputs,
)

LOOKS = {
    "icha": ("ICHA (asperities)", BLACK, "o", "-"),
    "without_unions": ("ICHA without unions", BLUE, "s", "--"),
    "independent": ("Hertz, no interaction", ORANGE, "v", ":"),
    "circular_paraboloids": ("BEM, circular paraboloids", GREEN, "^", "--"),
    "elliptic_paraboloids": ("BEM, elliptic paraboloids", VERMILLION, "D", "-"),
}
_EFFECT_COLOURS = (BLUE, SKY, GREEN, ORANGE, VERMILLION)
# Patches of fewer boundary elements have no area to speak of.
_LEAST_NODES = 20
_BINS = 8
# Points of one load stand this far apart, as a factor.
_APART = 1.06
# Where the frame of panel (d) ends.
_HIGHEST_RATIO = 3.0


@styled
def figure(error_sources: Sequence[xr.Dataset]) -> Figure:
    """Draw the datasets of `icha.references.error_sources.variants`, of surfaces that differ in their seeds only.

    Raises
    ------
    ValueError
        If there is none, one is with adhesion, or they are not at the same pressures.
    """
    error_sources = one_study(error_sources)
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


def one_study(error_sources: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """The datasets in the order of their seeds, if they can be averaged.

    Raises
    ------
    ValueError
        If there is none, one is with adhesion, or they are not at the same pressures.
    """
    ordered = sorted(error_sources, key=lambda one: int(one["seed"]))
    if not ordered:
        raise ValueError("error_sources: there is no dataset to draw")
    for one in ordered:
        if float(one["surface_energy"]) > 0:
            raise ValueError("error_sources: all have to be without adhesion")
        if not np.array_equal(one["reduced_pressure"], ordered[0]["reduced_pressure"]):
            raise ValueError("error_sources: all have to be at the same reduced pressures")
    return ordered


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
    from icha.references.error_sources.chain import effects

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
    from icha.references.error_sources.chain import relative_radius, shape_ratio, shape_ratio_of_fourth_order

    x, ratio, expected = (
        np.concatenate([quantity(one)[one["pair_patch_nodes"].values >= _LEAST_NODES] for one in error_sources])
        for quantity in (relative_radius, shape_ratio, shape_ratio_of_fourth_order)
    )
    ax.axhline(1, color=GREY, lw=0.8)
    ax.plot(x, ratio, ls="none", marker=".", ms=2.5, color=SKY, zorder=2)
    if len(x) >= 3 * _BINS:
        at, median = medians(x, ratio)
        ax.plot(at, median, color=BLUE, marker="o", label="boundary elements", zorder=4)
        at, median = medians(x, expected)
        ax.plot(at, median, color=PURPLE, ls="--", label="fourth-order term", zorder=3)
        ax.legend(loc="lower right")
    if len(x):
        ax.set_ylim(min(0.8, ratio.min()), min(_HIGHEST_RATIO, 1.2 * ratio.max()))
    ax.set_xlim(left=0)
    ax.set_xlabel(r"radius of the patch  $aq$")
    ax.set_ylabel(r"$A/A_{\mathrm{Hertz}}(F)$")


def medians(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Medians of x and y in bins of x with equally many points; a y that is NaN counts as beyond all others."""
    bins = np.array_split(np.argsort(x, kind="stable"), _BINS)
    high = np.where(np.isnan(y), np.inf, y)
    middle = np.array([np.median(high[part]) for part in bins])
    return np.array([np.median(x[part]) for part in bins]), np.where(np.isfinite(middle), middle, np.nan)
