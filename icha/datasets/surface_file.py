"""Write and read the file of a surface, which contains heights, statistics, power spectrum and origin."""

import json
import os
from collections.abc import Mapping

import numpy as np
import xarray as xr

from icha.datasets.attributes import INPUT, file_attributes
from icha.datasets.build import build_dataset, get_values
from icha.datasets.files import read_dataset, readable, write_dataset
from icha.datasets.variables.surface import SURFACE
from icha.datasets.variables.terms import ROUGHNESS
from icha.surfaces.moments import SpectralMoments, radial_power_spectrum, spectral_moments
from icha.surfaces.shapes import make_shape, shape_settings
from icha.surfaces.surface import PERIODIC, Surface


def write_surface(
    path: str | os.PathLike,
    surface: Surface,
    *,
    name: str,
    seed: int,
    spectrum=None,
    measured=None,
    attrs: Mapping[str, str] = {},
) -> None:
    """Write a topography to a file, with statistics, power spectrum and origin.

    Campaigns scale topographies to rms slope 1. A random surface has a `spectrum`
    (`icha.surfaces.spectrum.SelfAffineSpectrum`); a measured one is `measured`
    (`icha.surfaces.measured.topography.PreparedTopography`) before scaling.
    """
    n = surface.grid
    nodes = np.arange(n) * surface.spacing
    moments = spectral_moments(surface)
    wave_number, power, edges = radial_power_spectrum(surface)
    values = {
        "x": nodes,
        "y": nodes,
        "psd_wavevector": wave_number,
        "height": surface.heights,
        "seed": seed,
        **get_values(surface, "period", "grid", *ROUGHNESS),
        "spectral_moment_0": moments.m0,
        "spectral_moment_2": moments.m2,
        "spectral_moment_4": moments.m4,
        "nayak_parameter": moments.nayak_parameter,
        "psd_wavevector_bounds": np.column_stack([edges[:-1], edges[1:]]),
        "power_spectrum": power,
    }
    if spectrum is not None:
        values |= get_values(spectrum, "rolloff_wavelength", "hurst")
    if surface.short_wavelength is not None:
        values["short_wavelength"] = surface.short_wavelength
    if measured is not None:
        values["measured_rms_slope"] = measured.surface.rms_slope
    kind, origin = "Self-affine surface" if spectrum is not None else "Surface from a file", {}
    if surface.smooth:
        kind = "Smooth shape"
    if measured is not None:
        kind = "Measured topography"
        origin = {
            "source_file": measured.source_file,
            "source_sha256": measured.source_sha256,
            "preparation": measured.description,
        }
    attributes = file_attributes(
        f"Topography {name}, seed {seed}",
        f"{kind}, {'one square' if surface.free else 'a periodic cell'} of {n} by {n} nodes.",
        INPUT,
        keywords=["topography"],
    )
    origin |= {"surface": name, "boundary": surface.boundary}
    if surface.shape:
        origin["shape"] = json.dumps(shape_settings(surface.shape), sort_keys=True)
    write_dataset(build_dataset(SURFACE, values, attributes | origin | dict(attrs)), path)


def measured_scale(surface: xr.Dataset) -> float:
    """Return the ratio of the measured heights to the heights in a surface file; 1 for a random surface.

    Surface files contain all topographies at rms slope 1.
    """
    if "measured_rms_slope" not in surface:
        return 1.0
    return float(surface["measured_rms_slope"]) / float(surface["rms_slope"])


def read_surface(path: str | os.PathLike) -> Surface:
    """Read the topography of a surface file.

    Raise ValueError if the file cannot be read, lacks heights or period, or has heights that `Surface` refuses.
    """
    dataset = read_dataset(path)
    for name in ("height", "period"):
        if name not in dataset:
            raise ValueError(f"{path}: not a surface file, because it has no variable {name!r}")
    try:
        return surface_from(dataset)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path}: {error}") from None


def surface_from(dataset: xr.Dataset) -> Surface:
    """Return the topography in the dataset of a surface file, at the rms slope of the file."""
    heights = dataset["height"].transpose("y", "x").values
    shape = make_shape(json.loads(dataset.attrs["shape"])) if "shape" in dataset.attrs else None
    shortest = float(dataset["short_wavelength"]) if "short_wavelength" in dataset else None
    boundary = dataset.attrs.get("boundary", PERIODIC)
    return Surface(heights, float(dataset["period"]), boundary, shape, shortest)


def read_scaled_surface(path: str | os.PathLike, rms_slope: float, rms_height: float | None = None) -> Surface:
    """Read the topography of a surface file, scaled to an rms slope, or to an rms height (m) if one is given."""
    surface = read_surface(path)
    if rms_height is not None and not surface.smooth:
        rms_slope = surface.rms_slope * rms_height / surface.rms_height
    return surface.scaled_to_rms_slope(rms_slope)


def read_spectral_moments(path: str | os.PathLike) -> SpectralMoments:
    """Read the spectral moments from a surface file, without reading the heights."""
    with readable(path), xr.open_dataset(path, engine="netcdf4") as dataset:
        return SpectralMoments(*(float(dataset[f"spectral_moment_{order}"]) for order in (0, 2, 4)))
