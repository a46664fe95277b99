"""The section of the surfaces: statistics, measurements they come from, and power spectra."""

from __future__ import annotations

import os

import numpy as np
import xarray as xr

from icha.datasets.surface_file import as_measured
from icha.figures.scale import Scale
from icha.figures.style import COLOURS, quantity
from icha.report.inline_svg import Curve, logarithmic_chart

# More surfaces than this have a scale of colours, and only some are named.
_MOST_SPECTRA = 7
_SHOWS_ON_BLACK = 0.3
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


def spectra(surfaces):
    """A chart of the power spectra, means over the seeds of every surface; None where no file has one."""
    members: dict[str, list] = {}
    for surface in surfaces:
        if "power_spectrum" in surface:
            members.setdefault(surface.attrs.get("surface", ""), []).append(surface)
    if not members:
        return None
    many = len(members) > _MOST_SPECTRA
    scale = Scale(list(members), darkest=_SHOWS_ON_BLACK) if many else None
    # The last colour is that of the page's text.
    colours = scale.colours if many else [*COLOURS[: _MOST_SPECTRA - 1], "currentColor"]
    named = {0, len(members) // 2, len(members) - 1} if many else set(range(len(members)))
    curves = []
    for k, (name, own) in enumerate(members.items()):
        q = own[0]["psd_wavevector"].values
        same = [each for each in own if each["psd_wavevector"].shape == q.shape]
        power = np.mean([each["power_spectrum"].values for each in same], axis=0)
        shown = (q > 0) & (power > power.max() * _LEAST_POWER)
        curves.append(Curve(name if k in named else "", colours[k], q[shown], power[shown]))
    return logarithmic_chart(
        curves, "wave number q (rad/m)", "power spectrum C(q) (m⁴)", "Power spectra of the surfaces, as stored"
    )
