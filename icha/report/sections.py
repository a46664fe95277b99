"""Sections of the report: surfaces, and the error of the asperity model relative to boundary elements."""

from __future__ import annotations

import base64
import io
import itertools
import os

import numpy as np
import xarray as xr

from icha.analysis.measured_error import left_out_runs
from icha.analysis.model_error import SUMMARISED
from icha.contact.attraction import FINITE_RANGE, SHORT_RANGE
from icha.datasets.labels import place_of, slopes_of, surfaces_and_slopes
from icha.datasets.surface_file import measured_scale
from icha.figures.looks import MOST_COLOURS, graded_colours, legend_below, named_handles, some_of
from icha.figures.style import COLOURS, TWO_COLUMNS, in_style, logarithmic_axes, new_figure
from icha.report.template import format_mean, per_cent
from icha.support.formatting import format_quantity

LEAST_POWER = 1e-16  # powers below this fraction of the largest power are rounding errors


def read_surface_statistics(path: str | os.PathLike) -> xr.Dataset:
    """Read a surface file without its heights."""
    with xr.open_dataset(path, engine="netcdf4", drop_variables=["height", "x", "y"]) as dataset:
        return dataset.load()


def summarise_surface(surface: xr.Dataset) -> dict:
    """Return name, parameters and statistics of a surface file; for a scan, the statistics of the measured heights."""
    lengths = ("period", "rolloff_wavelength", "short_wavelength")
    scale = measured_scale(surface)
    curvature = float(surface["rms_curvature"]) * scale
    return {
        "name": surface.attrs.get("surface", ""),
        "seed": int(surface["seed"]),
        "grid": int(surface["grid"]),
        "boundary": surface.attrs.get("boundary", "periodic"),
        "measured": "measured_rms_slope" in surface,
        "rms_slope": float(surface["rms_slope"]) * scale,
        "rms_height": format_quantity(float(surface["rms_height"]) * scale, "m"),
        "curvature_radius": format_quantity(1 / curvature, "m") if curvature else "",
        **{name: float(surface[name]) if name in surface else None for name in ("hurst", "nayak_parameter")},
        **{name: format_quantity(float(surface[name]), "m") for name in lengths if name in surface},
    }


def list_sources(surfaces) -> list[dict[str, str]]:
    """Return file, checksum and preparation of each measured surface."""
    keys = ("surface", "source_file", "source_sha256", "preparation")
    rows = [tuple(each.attrs.get(key, "") for key in keys) for each in surfaces if "source_file" in each.attrs]
    return [dict(zip(keys, row, strict=True)) for row in dict.fromkeys(rows)]


def picture_of_spectra(surfaces) -> str | None:
    """Draw the power spectra, averaged over the seeds of each surface, as a PNG in base64; None without spectra."""
    members: dict[str, list] = {}
    for surface in surfaces:
        if "power_spectrum" in surface and surface["power_spectrum"].any():
            members.setdefault(surface.attrs.get("surface", ""), []).append(surface)
    if not members:
        return None
    file = io.BytesIO()
    draw_spectra(members).savefig(file, format="png", dpi=150, metadata={"Software": None})
    return base64.b64encode(file.getvalue()).decode("ascii")


@in_style
def draw_spectra(members):
    """Draw the mean power spectrum of each surface; if there are many surfaces, the legend names only some of them."""
    colours = graded_colours(len(members)) if len(members) > MOST_COLOURS else COLOURS
    named = some_of(list(members))
    figure = new_figure(TWO_COLUMNS, 3.4)
    axes = figure.subplots()
    for (name, seeds), colour in zip(members.items(), colours, strict=False):
        q = seeds[0]["psd_wavevector"].values
        power = np.mean([seed["power_spectrum"].values for seed in seeds if seed["psd_wavevector"].shape == q.shape], 0)
        visible = (q > 0) & (power > power.max() * LEAST_POWER)
        axes.plot(q[visible], power[visible], color=colour, label=name if name in named else None)
    logarithmic_axes(axes)
    axes.set(xlabel="wave number  $q$ (rad/m)", ylabel="power spectrum  $C(q)$ (m$^4$)")
    legend_below(figure, named_handles([axes]))
    return figure


def summarise_errors(errors: xr.Dataset) -> dict:
    """Return what the report shows for one comparison of models: ranges of errors, and a table row for each state."""
    rows = []
    for (surface, slope), material in itertools.product(
        surfaces_and_slopes(errors), errors["material"].values.tolist()
    ):
        contact = {"surface": surface, "rms_slope": slope, "material": material}
        states = errors.isel(place_of(errors, contact))
        for p in errors["reduced_pressure"].values.tolist():
            state = states.sel(reduced_pressure=p)
            # A study need not contain all combinations.
            if np.isfinite(state["area_error"]).any():
                areas = {
                    "area": float(state["contact_area_fraction"].mean()),
                    "true_area": float(state["contact_area_fraction_boundary_elements"].mean()),
                }
                known = {name: _finite(state[name]) for name in SUMMARISED}
                means = {
                    name: format_mean(values, per_cent if name.endswith("error") else "{:.3f}".format)
                    for name, values in known.items()
                    if len(values)
                }
                rows.append(contact | {"reduced_pressure": p} | areas | means)
    materials, attraction = errors["material"].values.tolist(), errors["attraction"]
    tabor = errors["tabor_parameter"].where(attraction == FINITE_RANGE).values
    tabor = tabor[np.isfinite(tabor)]
    return {
        "study": errors.attrs["study"],
        "short_range": bool((attraction == SHORT_RANGE).any()),
        "finite_range": [name for name in materials if (attraction.sel(material=name) == FINITE_RANGE).any()],
        "axes": {label: errors[label].values.tolist() for label in ("material", "seed")}
        | {"rms_slope": slopes_of(errors)},
        "states": int(errors["area_error"].count()),
        "left_out": left_out_runs(errors).sentence,
        "grids": sorted({int(n) for n in _finite(errors["solution_grid"])}),
        "tabor": list(dict.fromkeys(f"{mu:.2g}" for mu in (tabor.min(), tabor.max()))) if tabor.size else [],
        "load_error": float(np.abs(errors["load_error"]).max()),
        "residual": float(errors["residual"].max()),
        "rows": rows,
        **{name: _spread(_finite(errors[name])) for name in SUMMARISED},
    }


def _finite(variable: xr.DataArray) -> np.ndarray:
    return variable.values[np.isfinite(variable.values)]


def _spread(values: np.ndarray) -> dict[str, float] | None:
    """Return the median, the smallest and the largest value."""
    if not len(values):
        return None
    return {"median": float(np.median(values)), "least": float(values.min()), "most": float(values.max())}
