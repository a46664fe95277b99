"""Fig. 6: contact spots of one topography at several rms slopes, at the same load and at the same area."""

from __future__ import annotations

from typing import TYPE_CHECKING

from icha.figures.drawn import Name, say
from icha.figures.looks import NOT_APPLICABLE_ALONE, graded_colours, legend_below
from icha.figures.maps import draw_spots, record_spots, wrap_circles
from icha.figures.select import is_applicable, select_by_labels, select_runs, snapshot_label
from icha.figures.style import in_style, new_panels, slope_label
from icha.support.formatting import choose_unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


_KINDS = ("relative_load", "area_fraction")


@in_style
def figure(
    campaign: xr.DataTree,
    *,
    study: str,
    surface: str | None = None,
    seed: int | None = None,
    material: str | None = None,
) -> Figure:
    """Draw the spots of all slopes for one surface, seed and material; the defaults are those of the first run."""
    from matplotlib.patches import Patch

    runs = select_by_labels(select_runs(campaign, study), surface=surface, seed=seed, material=material)
    by_slope = {labels.rms_slope: run for labels, run in runs}
    names = {labels.rms_slope: Name("spots", labels) for labels, _ in runs}
    slopes = sorted(by_slope, reverse=True)
    # Slopes have colours from dark to bright, because the other colours stand for materials.
    colours = dict(zip(slopes, graded_colours(len(slopes)), strict=True))

    fig, [panels] = new_panels(3.8, sharey=True)
    say(
        fig,
        """Contact spots of the asperity model, in true size, on one topography that is scaled to several rms slopes.
        All slopes have the same load F/(E* A0) in panel (a), and the same contact area A/A0 in panel (b). At a given
        load, a steeper surface has less contact area. Its spots lie within the spots of flatter surfaces, and are drawn
        on top of them. At a given contact area, the spots of all slopes nearly coincide, so every slope fills one
        sector of each circle in panel (b).""",
    )
    length, unit = choose_unit(float(by_slope[slopes[0]]["period"]), "m")
    for ax, kind in zip(panels, _KINDS, strict=True):
        _draw_slopes(ax, by_slope, names, kind, colours, length)
        ax.set_aspect("equal")
        ax.set_xlabel(f"$x$ ({unit})")
    panels[0].set_ylabel(f"$y$ ({unit})")
    words = {
        slope: slope_label(slope) + ("" if is_applicable(run) else f" ({NOT_APPLICABLE_ALONE})")
        for slope, run in by_slope.items()
    }
    legend_below(fig, {words[slope]: Patch(facecolor=colours[slope]) for slope in slopes})
    return fig


def _draw_slopes(ax, runs, names, kind, colours, length):
    """Draw the spots of each slope at the first snapshot of a kind; `runs` and `names` are by slope."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Wedge

    from icha.analysis.model_error import state_of
    from icha.datasets.campaign import find_snapshot, spots_of

    at = {slope: find_snapshot(run, kind) for slope, run in runs.items()}
    areas = {slope: float(state_of(run, at[slope])["contact_area_fraction"]) for slope, run in runs.items()}
    # Slopes with less contact area are drawn on top of slopes with more contact area.
    for order, slope in enumerate(sorted(colours, key=areas.get, reverse=True)):
        run, look = runs[slope], {"facecolor": colours[slope], "edgecolor": "black", "lw": 0.25}
        side, spots = float(run["period"]) * length, spots_of(run, at[slope])
        places = (spots[f"spot_{name}"].values * length for name in ("x", "y", "radius"))
        circles = wrap_circles(*places, side, str(run["boundary"].values))
        record_spots(ax, circles, side, names[slope])
        if kind == "relative_load":
            draw_spots(ax, circles, zorder=2 + order, **look)
        else:
            # The spots of all slopes nearly coincide. Each slope fills a sector of the circle, so that all slopes show.
            share = 360 / len(runs)
            start = 90 + share * list(colours).index(slope)
            ax.add_collection(PatchCollection([Wedge((x, y), r, start, start + share) for x, y, r in circles], **look))
    ax.set(xlim=(0, side), ylim=(0, side))
    sectors = "" if kind == "relative_load" or len(runs) == 1 else ", a sector for each slope"
    ax.set_title(snapshot_label(run, at[slope]) + sectors, loc="right")
