"""A quick plot of a file, to look at and not to print."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.datasets.campaign import reduced_gap
from icha.datasets.format import RUN, SURFACE
from icha.datasets.labels import LABELS
from icha.datasets.surface_file import as_measured
from icha.figures.curves import AREA_LABEL, PRESSURE_LABEL, gap_label
from icha.figures.style import (
    COLOURS,
    GREEN,
    GREY,
    ONE_COLUMN,
    TWO_COLUMNS,
    VERMILLION,
    new_figure,
    quantity,
    styled,
    unit_for,
)
from icha.support.atomic_files import whole_file
from icha.surfaces.moments import radial_power_spectrum

# By model, in their order.
_LINES = ("-", "--")


def draw(kind: str, data: xr.Dataset | xr.DataTree, path: Path) -> None:
    """Draw what `icha.datasets.format.identify_file` gave into a file, whose ending says the format."""
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
    how = "as measured" if "measured_rms_slope" in surface else "as stored"
    _map(axes[0], surface["height"].values, as_measured(surface), float(surface["period"]), f"height {how}")
    if spectrum:
        _spectrum(axes[1], surface["psd_wavevector"].values, surface["power_spectrum"].values)
    return figure


def draw_scans(scans: Mapping, path: Path) -> None:
    """Draw every scan, by its name, as a map beside its spectrum with the noise floor and the cut-off.

    Each is a `icha.surfaces.measured.resolution.ScanResolution`.
    """
    with whole_file(path) as temporary:
        _scans(scans).savefig(temporary, format=path.suffix[1:], dpi=150)


@styled
def _scans(scans: Mapping) -> Figure:
    figure = new_figure(TWO_COLUMNS, 3.0 * len(scans))
    for (left, right), (name, scan) in zip(figure.subplots(len(scans), 2, squeeze=False), scans.items(), strict=True):
        _map(left, scan.used.heights, 1.0, scan.used.period, "height")
        left.set_title(name)
        q, power = radial_power_spectrum(scan.measured)
        _spectrum(right, q, power, label="scan")
        if scan.cutoff is not None:
            k, used = radial_power_spectrum(scan.used)
            # What is left of the shortest waves after the filter is rounding.
            shown = used > 1e-3 * power[power > 0].min()
            cut = f"as used, cut off at {quantity(scan.cutoff, 'm')}"
            right.loglog(k[shown], used[shown], color=GREEN, ls="--", label=cut)
        if (noise := scan.noise) is not None:
            rms, wavelength = (quantity(float(f"{length:.2g}"), "m") for length in (noise.rms, noise.wavelength))
            right.axhline(noise.power, color=VERMILLION, lw=0.8, ls=":", label=f"noise floor, {rms} rms")
            right.axvline(2 * np.pi / noise.wavelength, color=VERMILLION, lw=0.8, label=f"noise below {wavelength}")
        right.axvline(np.pi / scan.measured.spacing / 4, color=GREY, lw=0.8, ls="-.", label="waves of 8 pixels")
        right.legend(loc="lower left", frameon=True, framealpha=1, edgecolor="none", fontsize=7)
    return figure


def _map(ax, heights, scale, side, label):
    """Heights (n, n), multiplied with a scale, in m, on a square of a side, m."""
    every = max(1, len(heights) // 1024)
    shown = heights[::every, ::every] * scale
    (factor, unit), (along, lateral) = (unit_for(value, "m") for value in (np.abs(shown).max(), side))
    image = ax.imshow(shown * factor, extent=np.array([0, side, 0, side]) * along, origin="lower")
    ax.figure.colorbar(image, ax=ax, label=f"{label} ({unit})")
    ax.set_xlabel(f"x ({lateral})")
    ax.set_ylabel(f"y ({lateral})")


def _spectrum(ax, q, power, label=None):
    ax.loglog(q[power > 0], power[power > 0], color=COLOURS[0], label=label)
    ax.set_xlabel(r"wave number $q$ (rad/m)")
    ax.set_ylabel(r"power spectrum $C(q)$ (m$^4$)")
