"""Sections of the report: origin of the results, surfaces, and error of the model against boundary elements."""

from __future__ import annotations

import base64
import io
import itertools
import os
from typing import NamedTuple

import numpy as np
import xarray as xr

from icha.analysis.model_error import SUMMARISED
from icha.datasets.labels import place_of, slopes_of, surfaces_and_slopes
from icha.datasets.surface_file import measured_scale
from icha.datasets.variables.model_error import SHORT_RANGE
from icha.figures.looks import MOST_COLOURS, graded_colours, legend_below, named_handles, some_of
from icha.figures.style import COLOURS, TWO_COLUMNS, in_style, logarithmic_axes, new_figure
from icha.support.formatting import format_count, format_quantity
from icha.support.statistics import ENOUGH, ensemble

MOST_STUDIES = 8  # in the graph; more studies share one box
LONGEST_NAME = 19  # characters of the name of a study in the graph
LEAST_POWER = 1e-16  # smaller fractions of the largest power are rounding errors


class Box(NamedTuple):
    """A box of this graph: its name, a line of text, and the target of its link, if any."""

    name: str
    text: str
    target: str | None = None


def build_provenance(studies, surfaces, figures, model_error, files, dataset) -> list[list[Box]]:
    """Return the columns of the graph that shows which result was made from which; a column depends on those before it.

    Parameters
    ----------
    studies : results of `icha.report.studies.summarise_study`.
    surfaces : surface files.
    figures : figures of the report.
    model_error : error of the model by entry; None without boundary elements.
    files : linked files by their titles.
    dataset : link to the campaign dataset.
    """
    origins = [Box("Configuration", "as used", files.get("Configuration"))]
    if measured := {source["source_sha256"] for source in list_sources(surfaces)}:
        origins.append(Box("Measurements", format_count(len(measured), "file"), "#surfaces"))
    runs = [
        Box(_short(study["name"]), _run_count(study["complete"], study["failed"]), f"#study-{study['name']}")
        for study in studies
    ]
    if len(studies) > MOST_STUDIES:
        counts = (sum(study[name] for study in studies) for name in ("complete", "failed"))
        runs = [Box(f"{len(studies)} studies", _run_count(*counts), "#studies")]
    results = [Box("Figures", format_count(len(figures), "figure"), "#figures")] if figures else []
    if "Comparison" in files:
        results.append(Box("Comparison", "at common loads", files["Comparison"]))
    results.append(Box("Checks", "of the data", "#checks"))
    if model_error is not None:
        states = sum(int(node["area_error"].count()) for node in model_error.children.values())
        runs.append(Box("Boundary elements", format_count(states, "state"), "#error"))
        results.append(Box("Error of the model", "against them", "#error"))
    topographies = f"{len(surfaces)} {'topography' if len(surfaces) == 1 else 'topographies'}"
    columns = [origins, [Box("Surfaces", topographies, "#surfaces")] if surfaces else [], runs]
    columns += [[Box("Campaign dataset", "all runs", dataset)], results, [Box("Report", "this page")]]
    return [column for column in columns if column]


def _run_count(complete: int, failed: int) -> str:
    return format_count(complete, "run") + (f", {failed} failed" if failed else "")


def _short(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else name[: LONGEST_NAME - 1] + "…"


def read_surface_statistics(path: str | os.PathLike) -> xr.Dataset:
    """Read a surface file without its heights."""
    with xr.open_dataset(path, engine="netcdf4", drop_variables=["height", "x", "y"]) as dataset:
        return dataset.load()


def summarise_surface(surface: xr.Dataset) -> dict:
    """Return name, parameters and statistics of a surface file; for a scan, the statistics of the measured heights."""
    lengths = ("period", "rolloff_wavelength", "short_wavelength")
    scale = measured_scale(surface)
    return {
        "name": surface.attrs.get("surface", ""),
        "seed": int(surface["seed"]),
        "grid": int(surface["grid"]),
        "boundary": surface.attrs.get("boundary", "periodic"),
        "measured": "measured_rms_slope" in surface,
        "rms_slope": float(surface["rms_slope"]) * scale,
        "rms_height": format_quantity(float(surface["rms_height"]) * scale, "m"),
        "curvature_radius": format_quantity(1 / (float(surface["rms_curvature"]) * scale), "m"),
        **{name: float(surface[name]) if name in surface else None for name in ("hurst", "nayak_parameter")},
        **{name: format_quantity(float(surface[name]), "m") for name in lengths if name in surface},
    }


def list_sources(surfaces) -> list[dict[str, str]]:
    """Return file, checksum and preparation of each measured surface."""
    keys = ("surface", "source_file", "source_sha256", "preparation")
    rows = [tuple(each.attrs.get(key, "") for key in keys) for each in surfaces if "source_file" in each.attrs]
    return [dict(zip(keys, row, strict=True)) for row in dict.fromkeys(rows)]


def draw_spectra(surfaces) -> str | None:
    """Draw the power spectra, averaged over the seeds of each surface: a PNG in base64; None if no file has one."""
    members: dict[str, list] = {}
    for surface in surfaces:
        if "power_spectrum" in surface:
            members.setdefault(surface.attrs.get("surface", ""), []).append(surface)
    if not members:
        return None
    file = io.BytesIO()
    _draw_spectra(members).savefig(file, format="png", dpi=150, metadata={"Software": None})
    return base64.b64encode(file.getvalue()).decode("ascii")


@in_style
def _draw_spectra(members):
    """Draw a curve for each surface; many surfaces have graded colours, and the legend names some of them."""
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
    axes.set_xlabel("wave number  $q$ (rad/m)")
    axes.set_ylabel("power spectrum  $C(q)$ (m$^4$)")
    legend_below(figure, named_handles([axes]))
    return figure


def summarise_errors(errors: xr.Dataset) -> dict:
    """Return what the page prints about one entry of the model error: its ranges, and a row for each contact state."""
    labels = itertools.product(surfaces_and_slopes(errors), errors["material"].values.tolist())
    rows = []
    for (surface, slope), material in labels:
        contact = {"surface": surface, "rms_slope": slope, "material": material}
        states = errors.isel(place_of(errors, contact))
        for p in errors["reduced_pressure"].values.tolist():
            state = states.sel(reduced_pressure=p)
            # An entry need not contain all combinations.
            if np.isfinite(state["area_error"]).any():
                rows.append(
                    contact
                    | {
                        "reduced_pressure": p,
                        "area": float(state["contact_area_fraction"].mean()),
                        "true_area": float(state["contact_area_fraction_boundary_elements"].mean()),
                    }
                    | {name: _scatter(_finite(state[name])) for name in SUMMARISED}
                )
    tabor = errors["tabor_parameter"].values
    return {
        "name": errors.attrs["entry"],
        "study": errors.attrs["study"],
        "short_range": errors.attrs["truth"] == SHORT_RANGE,
        "axes": {"rms_slope": slopes_of(errors)}
        | {label: errors[label].values.tolist() for label in ("material", "seed")},
        "states": int(errors["area_error"].count()),
        "grids": sorted({int(n) for n in _finite(errors["solution_grid"])}),
        "adhesive": bool((errors["surface_energy"] > 0).any()),
        "tabor": list(dict.fromkeys(f"{mu:.2g}" for mu in (np.nanmin(tabor), np.nanmax(tabor)))),
        "load_error": float(np.abs(errors["load_error"]).max()),
        "residual": float(errors["residual"].max()),
        "rows": rows,
        **{name: _spread(_finite(errors[name])) for name in (*SUMMARISED, "perimeter_correction")},
    }


def _finite(variable: xr.DataArray) -> np.ndarray:
    return variable.values[np.isfinite(variable.values)]


def _scatter(values: np.ndarray):
    """Return the mean, and half its 95 % interval for five seeds or more, else the smallest and largest value."""
    if not len(values):
        return None
    over = ensemble(values)
    if len(values) >= ENOUGH:
        return float(over.mean), float(over.confidence), None
    return float(over.mean), None, (float(values.min()), float(values.max())) if len(values) > 1 else None


def _spread(values: np.ndarray) -> dict[str, float] | None:
    if not len(values):
        return None
    return {"median": float(np.median(values)), "least": float(values.min()), "most": float(values.max())}
