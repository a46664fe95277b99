"""Fig. 20: maps of the contact pressure of boundary elements, on the way in and at pull-off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.datasets.labels import RunLabels
from icha.figures.drawn import say
from icha.figures.looks import run_label
from icha.figures.maps import average_blocks
from icha.figures.style import format_number, in_style, new_panels
from icha.support.formatting import choose_unit, format_quantity

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


_MOST_MAPS = 6
_COLUMNS = 3
# Fraction of the pressures in contact that the colours cover on either side; larger magnitudes have the last colour.
_COVERED = 0.98
# Space around the largest contact, divided by its width.
_MARGIN = 0.15


@in_style
def figure(campaign: xr.DataTree, maps: xr.Dataset, *, run: Sequence) -> Figure:
    """Draw the pressure at the snapshots of a run; with more than six snapshots, at six of them.

    Parameters
    ----------
    campaign : the campaign dataset.
    maps : dataset of the file of the run.
    run : labels of the run.
    """
    from matplotlib.colors import TwoSlopeNorm

    from icha.figures.select import NothingToDraw, select_complete_run

    labels = RunLabels(*run)
    select_complete_run(campaign, labels)
    count = maps.sizes.get("snapshot", 0)
    touching = maps["contact_map"].transpose("snapshot", "row", "column").values > 0
    if not touching.any():
        raise NothingToDraw(f"{labels}: no snapshot has contact")
    order = np.argsort(maps["snapshot_step"].values, kind="stable")
    shown = order[np.unique(np.rint(np.linspace(0, count - 1, min(count, _MOST_MAPS))).astype(int))]
    pressure = maps["contact_pressure"].transpose("snapshot", "row", "column").values
    inside = np.abs(pressure[touching])
    factor, unit = choose_unit(float(np.quantile(inside, _COVERED)), "Pa")
    # Tension has a scale of its own, because it is often smaller than the pressure.
    most, least = (
        factor * float(np.quantile(np.abs(part), _COVERED)) if part.size else factor * float(inside.max())
        for part in (pressure[touching & (pressure > 0)], pressure[touching & (pressure < 0)])
    )
    length, length_unit = choose_unit(float(maps["period"]), "m")
    side = float(maps["period"]) * length
    columns = min(len(shown), _COLUMNS)
    rows = -(-len(shown) // columns)
    fig, panels = new_panels(2.7 * rows + 0.1, rows, columns, width=2.15 * columns + 0.65, sharex=True, sharey=True)
    free = str(maps["boundary"].values) == "free"
    say(
        fig,
        """Maps of the contact pressure at snapshots of one run with boundary elements, in the order of the path.
        Compression is red, tension is blue, each with its own scale, and grey regions are out of contact.""",
        "Tension is largest at the edges of contact." if float(maps["surface_energy"]) else "",
        """The title of a panel gives branch and force. All maps show the region around the largest contact."""
        if free
        else """The title of a panel gives the reduced pressure p* = F/(E* h'rms A0) and the contact area, to which
        cells at the edges contribute in part.""",
        "The scales end at the 98 % quantiles of pressure and tension in contact in all maps.",
    )
    window = _window(touching.any(axis=0), free)
    for ax, k in zip(panels.ravel(), shown, strict=False):
        cells = np.where(touching[k], pressure[k] * factor, np.nan)
        half = side / len(cells) / 2
        image = ax.imshow(
            np.ma.masked_invalid(average_blocks(cells)),
            extent=(-half, side - half) * 2,
            origin="lower",
            interpolation="nearest",
            cmap="RdBu_r",
            norm=TwoSlopeNorm(0, -least, most),
        )
        ax.set_title(_name_state(maps, k), loc="right", fontsize=8)
        ax.set(xlim=np.array(window) * side, ylim=np.array(window) * side)
        ax.set(xlabel=f"$x$ ({length_unit})", ylabel=f"$y$ ({length_unit})", facecolor="0.8")
        ax.label_outer()
    for ax in panels.ravel()[len(shown) :]:
        ax.remove()
    for ax in panels.ravel()[len(shown) - columns : (rows - 1) * columns]:
        ax.tick_params(labelbottom=True)
        ax.set_xlabel(f"$x$ ({length_unit})")
    bar = fig.colorbar(image, ax=panels.ravel()[: len(shown)], shrink=0.9, pad=0.015, aspect=28, extend="both")
    bar.set_label(f"pressure ({unit})")
    ends = (-least, -least / 2, 0, most / 2, most)
    bar.set_ticks(ends, labels=[format_number(float(f"{value:.2g}")) for value in ends])
    fig.suptitle(run_label(campaign, labels), fontsize="medium")
    return fig


def _window(touched, free):
    """Return the lower and the upper limit of both axes, divided by the side; on a periodic surface, 0 and 1."""
    if not free:
        return 0.0, 1.0
    places = np.flatnonzero(touched.any(axis=0) | touched.any(axis=1)) / len(touched)
    room = _MARGIN * (np.ptp(places) or 1.0)
    return max(places[0] - room, 0.0), min(places[-1] + room, 1.0)


def _name_state(maps, snapshot):
    """Return load and area of a snapshot as text, with the branch if it is not loading; on a free square, the force."""
    step = int(maps["snapshot_step"].values[snapshot])
    pull_off = str(maps["snapshot_kind"].values[snapshot]) == "pull_off"
    name = "pull-off" if pull_off else str(maps["branch"].values[step])
    if "force" in maps:
        force = format_quantity(float(f"{float(maps['force'][step]):.3g}"), "N").replace("-", "−")
        return f"{name}, $F$ = {force}"
    load = format_number(float(f"{float(maps['reduced_pressure'][step]):.3g}"))
    area = format_number(float(f"{float(maps['contact_area_fraction'][step]):.2g}"))
    words = rf"$p^{{\ast}}$ = {load}" + f"\n$A/A_0$ = {area}"
    return words if name == "loading" else f"{name}, {words}"
