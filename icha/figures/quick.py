"""The plots that most users draw from one run: area, separation, and contact map. Axes are those of matplotlib."""

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from icha.figures.curves import panel_in_units
from icha.figures.maps import draw_spots
from icha.figures.style import BLUE, GREEN, GREY, VERMILLION, in_style, new_panels
from icha.references.jkr_test import JKRTest
from icha.support.formatting import choose_unit

# Look of the points of a JKR test by their use; other points are left out.
_LOOKS: dict[str, dict[str, object]] = {
    "loading": {"marker": "o", "color": BLUE},
    "stuck": {"marker": "D", "color": GREEN},
    "receding": {"marker": "s", "color": VERMILLION},
}
_LEFT_OUT = {"marker": "x", "color": GREY}


def plot_area(run: xr.Dataset, axes: Axes | None = None, **look: object) -> Axes:
    """Plot the contact area fraction of a run against the nominal pressure; return the axes.

    Parameters
    ----------
    run : dataset from `icha.simulate`, or from a campaign.
    axes : axes to draw on; None for new axes.
    look : keyword arguments of `Axes.plot`.
    """
    return _plot_against_pressure(run, "contact_area_fraction", axes, look)


def plot_separation(run: xr.Dataset, axes: Axes | None = None, **look: object) -> Axes:
    """Plot the mean gap of a run against the nominal pressure; arguments as in `plot_area`."""
    return _plot_against_pressure(run, "mean_gap", axes, look)


def plot_contact(run: xr.Dataset, axes: Axes | None = None, *, snapshot: int = -1) -> Axes:
    """Draw the contact spots, or with boundary elements the contact map, of a snapshot; return the axes.

    Parameters
    ----------
    run : dataset from `icha.simulate`, or the file of a run.
    axes : axes to draw on; None for new axes.
    snapshot : number of the snapshot; the last one by default.
    """
    axes, side = axes or plt.subplots()[1], float(run["period"])
    factor, unit = choose_unit(side, "m")
    if "contact_map" in run:
        contact = run["contact_map"].isel(snapshot=snapshot).transpose("row", "column").values
        # Nodes are the centres of the cells.
        ends = np.array([-0.5, len(contact) - 0.5]) * side * factor / len(contact)
        axes.imshow(contact, origin="lower", extent=(*ends, *ends), cmap="Greys", vmin=0, vmax=1)
    else:
        number = run["snapshot"].values[snapshot]
        spots = run.isel(spot=np.flatnonzero(run["spot_snapshot"].values == number))
        draw_spots(axes, np.column_stack([spots[f"spot_{name}"].values * factor for name in ("x", "y", "radius")]))
        axes.set(xlim=(0, side * factor), ylim=(0, side * factor), aspect="equal")
    axes.set(xlabel=f"$x$ ({unit})", ylabel=f"$y$ ({unit})")
    return axes


@in_style
def plot_jkr_test(test: JKRTest) -> Figure:
    """Draw points, fit and residuals of a JKR test; return the figure, which `Figure.savefig` writes.

    Parameters
    ----------
    test : result of `icha.fit_jkr_test`.
    """
    names = [name for name in test.measured if name != "force"]
    per_newton, force_unit = choose_unit(float(np.abs(test.measured["force"]).max()), "N")
    force, force_residual = test.measured["force"] * per_newton, test.residuals["force"] * per_newton
    heights = {"height_ratios": [3, 1, 1]}
    figure, panels = new_panels(5.4, 3, len(names), width=3.55 * max(len(names), 1.3), sharex="col", **heights)
    for (top, middle, bottom), name in zip(panels.T, names, strict=True):
        per_metre, unit = choose_unit(float(np.abs(test.measured[name]).max()), "m")
        x, residual = test.measured[name] * per_metre, test.residuals[name] * per_metre
        for use, count in test.counts.items():
            members = test.used_for == use
            look = {"ls": "none", "ms": 3, "mfc": "none", "mew": 0.7} | _LOOKS.get(use, _LEFT_OUT)
            label = f"{use} ({count})" if use in _LOOKS else f"left out: {use} ({count})"
            for axes, values in ((top, force), (middle, force_residual), (bottom, residual)):
                axes.plot(x[members], values[members], label=label, **look)
        for use, states in test.loop.curves(test.radius).items():
            if use in test.counts:
                top.plot(getattr(states, name) * per_metre, states.force * per_newton, color=_LOOKS[use]["color"], lw=1)
        top.set_ylabel(f"force  ({force_unit})")
        middle.set_ylabel(f"residual  ({force_unit})")
        bottom.set(xlabel=f"{name.replace('_', ' ')}  ({unit})", ylabel=f"residual  ({unit})")
        for axes in (top, middle, bottom):
            axes.axhline(0, color=GREY, lw=0.5, zorder=0)
    panels[0, 0].legend(title="points (their number), lines: fit", title_fontsize=8)
    return figure


def _plot_against_pressure(run, name, axes, look):
    axes, panel = axes or plt.subplots()[1], panel_in_units("nominal_pressure", name, run)
    axes.plot(*panel.points(run), **{"marker": "o", "ms": 3} | look)
    panel.label(axes)
    return axes
