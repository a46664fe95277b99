"""The plots that most users draw from one run: area, separation, and contact map. Axes are those of matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.support.formatting import choose_unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


def plot_area(run: xr.Dataset, axes: Axes | None = None, **look: object) -> Axes:
    """Plot the contact area fraction of a run against the nominal pressure; return the axes.

    Parameters
    ----------
    run : dataset from `icha.simulate`, or from a campaign.
    axes : axes to draw on; None for new axes.
    look : keyword arguments of `Axes.plot`.
    """
    return _plot_against_pressure(run, "contact_area_fraction", "contact area  $A/A_0$", axes, look)


def plot_separation(run: xr.Dataset, axes: Axes | None = None, **look: object) -> Axes:
    """Plot the mean gap of a run against the nominal pressure; arguments as in `plot_area`."""
    return _plot_against_pressure(run, "mean_gap", "mean gap", axes, look)


def plot_contact(run: xr.Dataset, axes: Axes | None = None, *, snapshot: int = -1) -> Axes:
    """Draw the contact spots, or with boundary elements the contact map, of a snapshot; return the axes.

    Parameters
    ----------
    run : dataset from `icha.simulate`, or the file of a run.
    axes : axes to draw on; None for new axes.
    snapshot : number of the snapshot; the last one by default.
    """
    axes = _new_axes() if axes is None else axes
    side = float(run["period"])
    factor, unit = choose_unit(side, "m")
    if "contact_map" in run:
        contact = run["contact_map"].isel(snapshot=snapshot).transpose("row", "column").values
        # Nodes are the centres of the cells.
        ends = np.array([-0.5, len(contact) - 0.5]) * side * factor / len(contact)
        axes.imshow(contact, origin="lower", extent=(*ends, *ends), cmap="Greys", vmin=0, vmax=1)
    else:
        from matplotlib.collections import EllipseCollection

        number = run["snapshot"].values[snapshot]
        spots = run.isel(spot=np.flatnonzero(run["spot_snapshot"].values == number))
        x, y, radius = (spots[f"spot_{name}"].values * factor for name in ("x", "y", "radius"))
        places = np.column_stack([x, y])
        circles = EllipseCollection(2 * radius, 2 * radius, 0, units="xy", offsets=places, transOffset=axes.transData)
        axes.add_collection(circles)
        axes.set(xlim=(0, side * factor), ylim=(0, side * factor), aspect="equal")
    axes.set(xlabel=f"$x$ ({unit})", ylabel=f"$y$ ({unit})")
    return axes


def _plot_against_pressure(run, name, label, axes, look):
    axes = _new_axes() if axes is None else axes
    pressure, values = run["nominal_pressure"].values, run[name].values
    per_pressure, pressure_unit = choose_unit(float(np.abs(pressure).max(initial=0.0)) or 1.0, "Pa")
    unit, factor = run[name].attrs.get("units", "1"), 1.0
    if unit != "1":
        factor, unit = choose_unit(float(np.abs(values).max(initial=0.0)) or 1.0, unit)
        label = f"{label}  ({unit})"
    axes.plot(pressure * per_pressure, values * factor, **{"marker": "o", "ms": 3} | look)
    axes.set(xlabel=f"pressure  ({pressure_unit})", ylabel=label)
    return axes


def _new_axes():
    import matplotlib.pyplot as plt

    return plt.subplots()[1]
