"""Generate a random topography, read one from a file, or make a smooth shape; write the surface at rms slope 1."""

from dataclasses import replace

import numpy as np

from icha.datasets.surface_file import write_surface
from icha.support.checksums import refuse_changed
from icha.surfaces.measured.scan import read_height_map
from icha.surfaces.measured.topography import prepared_topography
from icha.surfaces.shapes import make_shape
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.surface import FREE, PERIODIC, Surface
from icha.surfaces.tabulated_spectrum import read_spectrum_table

SPECTRUM = ("period", "rolloff_wavelength", "short_wavelength", "hurst")


def make_surface(output, *, name, seed, settings, height_map=None, sha256=None, attributes):
    """Generate or read a surface, scale its roughness to rms slope 1, and write the surface file.

    Parameters
    ----------
    settings : settings of the surface in the configuration, in SI units.
    height_map, sha256 : file of the heights, and its expected checksum; None for a surface that needs no file.
    """
    spectrum = measured = None
    if settings["kind"] == "self_affine":
        spectrum = SelfAffineSpectrum(**{key: settings[key] for key in SPECTRUM})
        surface = spectrum.realise(settings["grid"], seed, amplitudes=settings["amplitudes"])
    elif settings["kind"] == "measured":
        measured = prepared_topography(
            height_map, {key: settings[key] for key in settings if key not in ("kind", "shape")}
        )
        surface = measured.surface
    elif settings["kind"] == "spectrum":
        table = read_spectrum_table(height_map, settings.get("length_unit"), settings.get("convention"))
        surface = table.in_cell(settings["period"]).realise(settings["grid"], seed, settings["amplitudes"])
    elif settings["kind"] == "smooth":
        heights = np.zeros((settings["grid"], settings["grid"]))
        surface = Surface(heights, settings["side"], FREE, make_shape(settings["shape"]))
    else:
        boundary = settings.get("boundary", PERIODIC)
        surface = Surface(read_height_map(height_map, settings["metres_per_unit"]), settings["period"], boundary)
    if height_map is not None:
        refuse_changed(height_map, sha256)
    if settings.get("boundary") == FREE:
        surface = replace(surface, boundary=FREE, shape=make_shape(settings["shape"]) if "shape" in settings else None)
    surface = surface.scaled_to_rms_slope(1.0)
    write_surface(output, surface, name=name, seed=seed, spectrum=spectrum, measured=measured, attrs=attributes)
