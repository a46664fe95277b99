"""Sections of the report: what was made of what, surfaces, and how far the model is from boundary elements."""

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
from icha.datasets.surface_file import as_measured
from icha.datasets.variables.model_error import SHORT_RANGE
from icha.figures.legends import legend_below, named_handles
from icha.figures.looks import MOST_COLOURS, Scale
from icha.figures.style import COLOURS, TWO_COLUMNS, logarithmic_axes, new_figure, quantity, styled
from icha.support.formatting import format_count
from icha.support.statistics import ENOUGH, ensemble

# --- what was made of what ---

# More studies than this share one box of the graph.
_MOST_STUDIES = 8
# A name of a study is cut to so many characters there.
_LONGEST_NAME = 19


class Box(NamedTuple):
    """A box of the graph of what was made of what: its name, a line below it, and what it links to, if anything."""

    name: str
    words: str
    target: str | None = None


def provenance(studies, surfaces, figures, model_error, files, dataset) -> list[list[Box]]:
    """Columns of boxes, each made of what stands before it, with how many there are of each."""
    begin = [Box("Configuration", "as used", files.get("Configuration"))]
    if measured := sources(surfaces):
        begin.append(
            Box("Measurements", format_count(len({each["source_sha256"] for each in measured}), "file"), "#surfaces")
        )
    runs = [
        Box(_short(study["name"]), _runs(study["complete"], study["failed"]), f"#study-{study['name']}")
        for study in studies
    ]
    if len(studies) > _MOST_STUDIES:
        whole = (sum(study[name] for study in studies) for name in ("complete", "failed"))
        runs = [Box(f"{len(studies)} studies", _runs(*whole), "#studies")]
    made = [Box("Figures", format_count(len(figures), "figure"), "#figures")] if figures else []
    if "Comparison" in files:
        made.append(Box("Comparison", "at common loads", files["Comparison"]))
    made.append(Box("Checks", "of the data", "#checks"))
    if model_error is not None:
        states = sum(int(node["area_error"].count()) for node in model_error.children.values())
        runs.append(Box("Boundary elements", format_count(states, "state"), "#error"))
        made.append(Box("Error of the model", "against them", "#error"))
    topographies = f"{len(surfaces)} {'topography' if len(surfaces) == 1 else 'topographies'}"
    columns = [begin, [Box("Surfaces", topographies, "#surfaces")] if surfaces else [], runs]
    columns += [[Box("Campaign dataset", "all runs", dataset)], made, [Box("Report", "this page")]]
    return [column for column in columns if column]


def _runs(complete, failed):
    return format_count(complete, "run") + (f", {failed} failed" if failed else "")


def _short(name):
    return name if len(name) <= _LONGEST_NAME else name[: _LONGEST_NAME - 1] + "…"


# --- surfaces ---

# Below this part of the largest power there is nothing but rounding.
_LEAST_POWER = 1e-16


def read_surface_statistics(path: str | os.PathLike) -> xr.Dataset:
    """Read a surface file without its heights."""
    with xr.open_dataset(path, engine="netcdf4", drop_variables=["height", "x", "y"]) as dataset:
        return dataset.load()


def surface_row(surface):
    """Name, seed, parameters and statistics of a surface file; those of what was measured as it was measured."""
    lengths = ("period", "rolloff_wavelength", "short_wavelength")
    numbers = ("hurst", "nayak_parameter")
    scale = as_measured(surface)
    return {
        "name": surface.attrs.get("surface", ""),
        "seed": int(surface["seed"]),
        "grid": int(surface["grid"]),
        "boundary": surface.attrs.get("boundary", "periodic"),
        "measured": "measured_rms_slope" in surface,
        "rms_slope": float(surface["rms_slope"]) * scale,
        "rms_height": quantity(float(surface["rms_height"]) * scale, "m"),
        "curvature_radius": quantity(1 / (float(surface["rms_curvature"]) * scale), "m"),
        **{name: float(surface[name]) if name in surface else None for name in numbers},
        **{name: quantity(float(surface[name]), "m") for name in lengths if name in surface},
    }


def sources(surfaces):
    """File, checksum and preparation of the surfaces that were measured, each once."""
    keys = ("surface", "source_file", "source_sha256", "preparation")
    found = [
        tuple(surface.attrs.get(key, "") for key in keys) for surface in surfaces if "source_file" in surface.attrs
    ]
    return [dict(zip(keys, each, strict=True)) for each in dict.fromkeys(found)]


def spectra(surfaces) -> str | None:
    """A PNG in base64 of the power spectra, means over the seeds of every surface; None where no file has one."""
    members: dict[str, list] = {}
    for surface in surfaces:
        if "power_spectrum" in surface:
            members.setdefault(surface.attrs.get("surface", ""), []).append(surface)
    if not members:
        return None
    file = io.BytesIO()
    _draw_spectra(members).savefig(file, format="png", dpi=150, metadata={"Software": None})
    return base64.b64encode(file.getvalue()).decode("ascii")


@styled
def _draw_spectra(members):
    """Draw a curve for every surface; many have a scale of colours."""
    scale = Scale(list(members)) if len(members) > MOST_COLOURS else None
    figure = new_figure(TWO_COLUMNS, 3.4)
    axes = figure.subplots()
    for (name, own), colour in zip(members.items(), scale.colours if scale else COLOURS, strict=False):
        q = own[0]["psd_wavevector"].values
        same = [each for each in own if each["psd_wavevector"].shape == q.shape]
        power = np.mean([each["power_spectrum"].values for each in same], axis=0)
        shown = (q > 0) & (power > power.max() * _LEAST_POWER)
        axes.plot(q[shown], power[shown], color=colour, label=None if scale else name)
    logarithmic_axes(axes)
    axes.set_xlabel("wave number  $q$ (rad/m)")
    axes.set_ylabel("power spectrum  $C(q)$ (m$^4$)")
    legend_below(figure, named_handles([axes]), scale=scale, panels=[axes])
    return figure


# --- how far the model is from boundary elements ---


def entry_section(errors):
    """What the page says about one entry of the model error: a row for every surface, material and load."""

    def scatter(state, name):
        """Mean, half the width of its 95 % interval of five seeds or more, and smallest and largest of fewer."""
        values = state[name].values[np.isfinite(state[name].values)]
        if not len(values):
            return None  # of no snapshot
        over = ensemble(values)
        if len(values) >= ENOUGH:
            return float(over.mean), float(over.confidence), None
        return float(over.mean), None, (float(values.min()), float(values.max())) if len(values) > 1 else None

    rows = []
    for (surface, slope), material in itertools.product(
        surfaces_and_slopes(errors), errors["material"].values.tolist()
    ):
        contact = errors.isel(place_of(errors, {"surface": surface, "rms_slope": slope, "material": material}))
        for p in errors["reduced_pressure"].values.tolist():
            state = contact.sel(reduced_pressure=p)
            # Not all combinations of an entry are asked for.
            if not np.isfinite(state["area_error"]).any():
                continue
            rows.append(
                {
                    "surface": surface,
                    "rms_slope": slope,
                    "material": material,
                    "reduced_pressure": p,
                    "area": float(state["contact_area_fraction"].mean()),
                    "true_area": float(state["contact_area_fraction_boundary_elements"].mean()),
                    **{name: scatter(state, name) for name in SUMMARISED},
                }
            )

    def spread(name):
        values = errors[name].values[np.isfinite(errors[name].values)]
        if not len(values):
            return None
        return {"median": float(np.median(values)), "least": float(values.min()), "most": float(values.max())}

    tabor = errors["tabor_parameter"].values
    return {
        "name": errors.attrs["entry"],
        "study": errors.attrs["study"],
        "short_range": errors.attrs["truth"] == SHORT_RANGE,
        "axes": {
            "rms_slope": slopes_of(errors),
            **{label: errors[label].values.tolist() for label in ("material", "seed")},
        },
        "states": int(errors["area_error"].count()),
        "grids": sorted({int(n) for n in errors["solution_grid"].values.ravel() if np.isfinite(n)}),
        "adhesive": bool((errors["surface_energy"] > 0).any()),
        "tabor": list(dict.fromkeys(f"{mu:.2g}" for mu in (np.nanmin(tabor), np.nanmax(tabor)))),
        "load_error": float(np.abs(errors["load_error"]).max()),
        "residual": float(errors["residual"].max()),
        "rows": rows,
        **{name: spread(name) for name in (*SUMMARISED, "perimeter_correction")},
    }
