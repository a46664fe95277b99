"""A quick plot of a file, to look at and not to print."""

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.datasets.campaign import reduced_gap
from icha.datasets.format import RUN, SURFACE
from icha.datasets.labels import LABELS
from icha.datasets.surface_file import as_measured
from icha.figures.curves import AREA_LABEL, PRESSURE_LABEL, gap_label
from icha.figures.style import COLOURS, ONE_COLUMN, TWO_COLUMNS, new_figure, styled, unit_for
from icha.support.atomic_files import whole_file

# By model, in their order.
_LINES = ("-", "--")


def draw(kind: str, data: xr.Dataset | xr.DataTree, path: Path) -> None:
    """Draw what `icha.datasets.format.kind_of` gave into a file, whose ending says the format."""
    drawing = _run if kind == RUN else _surface if kind == SURFACE else _campaign
    with whole_file(path) as temporary:
        drawing(data).savefig(temporary, format=path.suffix[1:], dpi=150)


@styled
def _run(run: xr.Dataset) -> Figure:
    figure = new_figure(TWO_COLUMNS, 3.2)
    axes = figure.subplots(1, 2)
    _curves(axes, run, COLOURS[0])
    _label(axes, run)
    return figure


@styled
def _campaign(tree: xr.DataTree) -> Figure:
    names = list(tree.children)
    figure = new_figure(TWO_COLUMNS, 3.2 * len(names))
    rows = figure.subplots(len(names), 2, squeeze=False)
    for axes, name in zip(rows, names, strict=True):
        study = tree[name].to_dataset()
        # What has neither runs nor steps is not drawn, and xarray cannot stack snapshots of which there are none.
        study = study.drop_dims([dim for dim in study.dims if dim not in (*LABELS, "step")])
        runs = study.stack(run=LABELS, create_index=False)
        materials, models = list(study["material"].values), study["model"].values.tolist()
        for k in range(runs.sizes["run"]):
            run = runs.isel(run=k)
            colour = COLOURS[materials.index(str(run["material"].values)) % len(COLOURS)]
            _curves(axes, run, colour, lw=0.7, ls=_LINES[models.index(str(run["model"].values))])
        for material, colour in zip(materials, COLOURS, strict=False):
            axes[0].plot([], [], color=colour, label=material)
        for model, ls in zip(models, _LINES, strict=False) if len(models) > 1 else ():
            axes[0].plot([], [], color="black", ls=ls, label=model.replace("_", " "))
        axes[0].legend()
        axes[0].set_title(name)
        _label(axes, study)
    return figure


def _curves(axes, run, colour, lw=1.0, ls="-"):
    pressure = run["reduced_pressure"].values
    for ax, values in zip(axes, (run["contact_area_fraction"], reduced_gap(run)), strict=True):
        ax.plot(pressure, values, color=colour, marker=".", ms=3, lw=lw, ls=ls)


def _label(axes, data):
    loops = "work" in data
    for ax, label in zip(axes, (AREA_LABEL, gap_label(data)), strict=True):
        # Loads on the way back may be tensile.
        ax.set_xscale("linear" if loops else "log")
        ax.set_xlabel(PRESSURE_LABEL)
        ax.set_ylabel(label)
    axes[0].set_yscale("linear" if loops else "log")


@styled
def _surface(surface: xr.Dataset) -> Figure:
    spectrum = "power_spectrum" in surface
    figure = new_figure(TWO_COLUMNS if spectrum else ONE_COLUMN, 3.2)
    axes = figure.subplots(1, 2) if spectrum else [figure.subplots()]
    side = float(surface["period"])
    every = max(1, surface.sizes["x"] // 1024)
    heights = surface["height"].values[::every, ::every] * as_measured(surface)
    factor, unit = unit_for(np.abs(heights).max(), "m")
    image = axes[0].imshow(heights * factor, extent=np.array([0, side, 0, side]) * 1e6, origin="lower")
    how = "as measured" if "measured_rms_slope" in surface else "as stored"
    figure.colorbar(image, ax=axes[0], label=f"height {how} ({unit})")
    axes[0].set_xlabel("x (µm)")
    axes[0].set_ylabel("y (µm)")
    if spectrum:
        q, power = surface["psd_wavevector"].values, surface["power_spectrum"].values
        axes[1].loglog(q[power > 0], power[power > 0], color=COLOURS[0])
        axes[1].set_xlabel("wave vector q (rad/m)")
        axes[1].set_ylabel(r"C(q) (m$^4$)")
    return figure
