"""Fig. 6: contact spots of one topography at several rms slopes, at the same load and at the same area."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from pydantic import Field

from icha.figures.declaration import Campaign, Declaration
from icha.figures.legends import legend_below
from icha.figures.options import StudyFigure
from icha.figures.scale import Scale
from icha.figures.select import pick, study_runs
from icha.figures.spots import circles_in_cell, draw_spots
from icha.figures.style import (
    TWO_COLUMNS,
    new_figure,
    number,
    panel_label,
    slope_label,
    styled,
    unit_for,
)
from icha.support.values import Label, Problem, Seed

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class SlopesFigure(StudyFigure):
    """A figure of the spots of all slopes, at the same load and at the same area."""

    surface: Label | None = Field(default=None, description="Surface that is shown. Left out: the study's first.")
    seed: Seed | None = Field(default=None, description="Seed that is shown. Left out: the study's first.")
    material: Label | None = Field(default=None, description="Material that is shown. Left out: the study's first.")

    def study_problems(self, campaign: Campaign, study: Any) -> Iterator[Problem]:
        """A study that does not keep states of both kinds is one more."""
        yield from super().study_problems(campaign, study)
        kinds = [kind for kind, _ in campaign.snapshots_of(self.study) or []]
        for kind in ("relative_load", "area_fraction"):
            if kind not in kinds:
                yield ("study",), self.study, f"has no snapshot of kind {kind}; allowed: a study with one"


DECLARATION = Declaration(
    description=(
        "Contact spots of all slopes at the same load and at the same area. The study needs snapshots of kinds "
        "relative_load and area_fraction."
    ),
    options=SlopesFigure,
)

_KINDS = ("relative_load", "area_fraction")
_TITLES = {"relative_load": r"$F/(E^{\ast}A_0)$", "area_fraction": "$A/A_0$"}


@styled
def figure(
    campaign: xr.DataTree,
    *,
    study: str,
    surface: str | None = None,
    seed: int | None = None,
    material: str | None = None,
) -> Figure:
    """Draw the spots of all slopes for one surface, seed and material.

    Parameters
    ----------
    campaign : the campaign dataset.
    study : name of the study; its snapshots must include one of kind `relative_load` and one of `area_fraction`.
    surface, seed, material : what is shown; the study's first, if left out.

    Raises
    ------
    ValueError
        If there is no such study, run or snapshot.
    """
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Patch, Wedge

    from icha.datasets.campaign import find_snapshot, spots_of

    runs = study_runs(campaign, study)
    surface = pick("surface", surface, [labels.surface for labels, _ in runs])
    seed = pick("seed", seed, [labels.seed for labels, _ in runs if labels.surface == surface])
    own = [(labels, run) for labels, run in runs if (labels.surface, labels.seed) == (surface, seed)]
    material = pick("material", material, [labels.material for labels, _ in own])
    own = sorted(
        ((labels.rms_slope, run) for labels, run in own if labels.material == material),
        key=lambda pair: -pair[0],
    )
    # From dark to bright; the colours of the palette are those of materials.
    colour = dict(zip((slope for slope, _ in own), Scale([f"{slope:g}" for slope, _ in own]).colours, strict=True))

    fig = new_figure(TWO_COLUMNS, 3.8)
    panels = fig.subplots(1, 2, sharey=True)
    for ax, kind, letter in zip(panels, _KINDS, "ab", strict=True):
        drawn = []
        for slope, run in own:
            at = find_snapshot(run, kind)
            area = float(run["contact_area_fraction"].values[int(run["snapshot_step"].values[at])])
            drawn.append((area, slope, run, at))
        # What covers less lies on top.
        for order, (_, slope, run, at) in enumerate(sorted(drawn, key=lambda each: -each[0])):
            period = float(run["period"])
            length, unit = unit_for(period, "m")
            spots = spots_of(run, at)
            circles = circles_in_cell(
                spots["spot_x"].values * length,
                spots["spot_y"].values * length,
                spots["spot_radius"].values * length,
                period * length,
                str(run["boundary"].values),
            )
            if kind == "relative_load":
                draw_spots(ax, circles, zorder=2 + order, facecolor=colour[slope], edgecolor="black", lw=0.25)
            else:
                # The spots nearly coincide: every slope fills its own sector of the disc, so that all can be seen.
                share = 360 / len(own)
                start = 90 + share * list(colour).index(slope)
                sectors = [Wedge((x, y), r, start, start + share) for x, y, r in circles]
                ax.add_collection(PatchCollection(sectors, facecolor=colour[slope], edgecolor="black", lw=0.25))
        ax.set_xlim(0, period * length)
        ax.set_ylim(0, period * length)
        ax.set_aspect("equal")
        ax.set_xlabel(f"x ({unit})")
        value = float(own[0][1]["snapshot_target"].values[find_snapshot(own[0][1], kind)])
        panel_label(ax, letter)
        ax.set_title(f"{_TITLES[kind]} = {number(value)}", loc="right")
    panels[0].set_ylabel(f"y ({unit})")
    legend_below(fig, {slope_label(slope): Patch(facecolor=colour[slope]) for slope, _ in own})
    return fig
