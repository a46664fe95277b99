"""Plots of a file or of scans for `icha show`, `icha describe` and `icha new`."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.cli.project import echo, shorten_path
from icha.datasets.campaign import reduced_gap
from icha.datasets.format import RUN, SURFACE
from icha.datasets.labels import LABELS
from icha.datasets.surface_file import measured_scale
from icha.figures.curves import AREA_LABEL, PRESSURE_LABEL, gap_label
from icha.figures.style import (
    COLOURS,
    GREEN,
    GREY,
    ONE_COLUMN,
    TWO_COLUMNS,
    VERMILLION,
    choose_unit,
    format_quantity,
    in_style,
    new_figure,
)
from icha.support.atomic_files import whole_file
from icha.surfaces.moments import radial_power_spectrum

LINE_STYLES = ("-", "--")  # of the models, in their order
LEAST_POWER = 1e-3  # of a filtered spectrum, over the least power of the scan; less is a rounding error


def draw(kind: str, data: xr.Dataset | xr.DataTree, path: Path) -> None:
    """Draw the result of `icha.datasets.format.identify_file` into a file."""
    _save((_run if kind == RUN else _surface if kind == SURFACE else _campaign)(data), path)


def draw_scans(scans: Mapping, path: Path) -> None:
    """Draw each `icha.surfaces.measured.resolution.ScanResolution`: a map, and the spectrum with noise and cut-off."""
    _save(_scans(scans), path)


def _save(figure: Figure, path: Path) -> None:
    with whole_file(path) as temporary:
        figure.savefig(temporary, format=path.suffix[1:], dpi=150)
    echo(f"plot: {shorten_path(path)}")


@in_style
def _run(run: xr.Dataset) -> Figure:
    figure = new_figure(TWO_COLUMNS, 3.2)
    axes = figure.subplots(1, 2)
    _draw_curves(axes, run, COLOURS[0])
    _label_axes(axes, run)
    return figure


@in_style
def _campaign(tree: xr.DataTree) -> Figure:
    figure = new_figure(TWO_COLUMNS, 3.2 * len(tree.children))
    rows = figure.subplots(len(tree.children), 2, squeeze=False)
    for axes, (name, node) in zip(rows, tree.children.items(), strict=True):
        study = node.to_dataset()
        # xarray cannot stack empty dimensions, such as snapshots of a study without any.
        study = study.drop_dims([dim for dim in study.dims if dim not in (*LABELS, "step")])
        runs = study.stack(run=LABELS, create_index=False)
        materials, models = list(study["material"].values), study["model"].values.tolist()
        for k in range(runs.sizes["run"]):
            run = runs.isel(run=k)
            colour = COLOURS[materials.index(str(run["material"].values)) % len(COLOURS)]
            _draw_curves(axes, run, colour, lw=0.7, ls=LINE_STYLES[models.index(str(run["model"].values))])
        for material, colour in zip(materials, COLOURS, strict=False):
            axes[0].plot([], [], color=colour, label=material)
        for model, ls in zip(models, LINE_STYLES, strict=False) if len(models) > 1 else ():
            axes[0].plot([], [], color="black", ls=ls, label=model.replace("_", " "))
        axes[0].legend()
        axes[0].set_title(name)
        _label_axes(axes, study)
    return figure


def _draw_curves(axes, run: xr.Dataset, colour: str, lw: float = 1.0, ls: str = "-") -> None:
    """Draw contact area and mean gap over pressure."""
    pressure = run["reduced_pressure"].values
    for ax, values in zip(axes, (run["contact_area_fraction"], reduced_gap(run)), strict=True):
        ax.plot(pressure, values, color=colour, marker=".", ms=3, lw=lw, ls=ls)


def _label_axes(axes, data: xr.Dataset) -> None:
    scale = "linear" if "work" in data else "log"  # loads of unloading may be tensile
    for ax, label in zip(axes, (AREA_LABEL, gap_label(data)), strict=True):
        ax.set_xscale(scale)
        ax.set_xlabel(PRESSURE_LABEL)
        ax.set_ylabel(label)
    axes[0].set_yscale(scale)


@in_style
def _surface(surface: xr.Dataset) -> Figure:
    spectrum = "power_spectrum" in surface
    figure = new_figure(TWO_COLUMNS if spectrum else ONE_COLUMN, 3.2)
    axes = figure.subplots(1, 2) if spectrum else [figure.subplots()]
    state = "as measured" if "measured_rms_slope" in surface else "as stored"
    _draw_map(axes[0], surface["height"].values * measured_scale(surface), float(surface["period"]), f"height {state}")
    if spectrum:
        _draw_spectrum(axes[1], surface["psd_wavevector"].values, surface["power_spectrum"].values)
    return figure


@in_style
def _scans(scans: Mapping) -> Figure:
    figure = new_figure(TWO_COLUMNS, 3.0 * len(scans))
    for (left, right), (name, scan) in zip(figure.subplots(len(scans), 2, squeeze=False), scans.items(), strict=True):
        _draw_map(left, scan.used.heights, scan.used.period, "height")
        left.set_title(name)
        q, power = radial_power_spectrum(scan.measured)
        _draw_spectrum(right, q, power, label="scan")
        if scan.cutoff is not None:
            k, used = radial_power_spectrum(scan.used)
            visible = used > LEAST_POWER * power[power > 0].min()
            label = f"as used, cut off at {format_quantity(scan.cutoff, 'm')}"
            right.loglog(k[visible], used[visible], color=GREEN, ls="--", label=label)
        if (noise := scan.noise) is not None:
            rms, wavelength = (format_quantity(float(f"{length:.2g}"), "m") for length in (noise.rms, noise.wavelength))
            right.axhline(noise.power, color=VERMILLION, lw=0.8, ls=":", label=f"noise floor, {rms} rms")
            right.axvline(2 * np.pi / noise.wavelength, color=VERMILLION, lw=0.8, label=f"noise below {wavelength}")
        right.axvline(np.pi / scan.measured.spacing / 4, color=GREY, lw=0.8, ls="-.", label="waves of 8 pixels")
        right.legend(loc="lower left", frameon=True, framealpha=1, edgecolor="none", fontsize=7)
    return figure


def _draw_map(ax, heights: np.ndarray, side: float, label: str) -> None:
    """Draw heights (n, n), in m, on a square with this side, in m."""
    step = max(1, len(heights) // 1024)
    visible = heights[::step, ::step]
    (factor, unit), (lateral_factor, lateral) = (choose_unit(value, "m") for value in (np.abs(visible).max(), side))
    extent = np.array([0, side, 0, side]) * lateral_factor
    image = ax.imshow(visible * factor, extent=extent, origin="lower")
    ax.figure.colorbar(image, ax=ax, label=f"{label} ({unit})")
    ax.set_xlabel(f"x ({lateral})")
    ax.set_ylabel(f"y ({lateral})")


def _draw_spectrum(ax, q: np.ndarray, power: np.ndarray, label: str | None = None) -> None:
    ax.loglog(q[power > 0], power[power > 0], color=COLOURS[0], label=label)
    ax.set_xlabel(r"wave number $q$ (rad/m)")
    ax.set_ylabel(r"power spectrum $C(q)$ (m$^4$)")
