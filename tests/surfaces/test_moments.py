"""Moments of spectra in closed form and of profiles; power spectra; when surfaces stick, by Hertz's gap."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from icha import Material, SelfAffineSpectrum, Surface
from icha.asperity.stickiness import stickiness
from icha.datasets.files import read_dataset
from icha.datasets.surface_file import read_spectral_moments, write_surface
from icha.surfaces.moments import SpectralMoments, radial_power_spectrum, spectral_moments


def rough(seed=1, short=100e-6 / 24):
    return SelfAffineSpectrum(100e-6, 25e-6, short, 0.8).realise(grid=256, seed=seed)


def test_moments_are_variances_of_profiles():
    surface = rough()
    q = 2 * np.pi * np.fft.fftfreq(surface.grid, surface.spacing)

    def variance(order, axis):
        shape = (-1, 1) if axis == 0 else (1, -1)
        return np.mean(
            np.fft.ifft(np.fft.fft(surface.heights, axis=axis) * (1j * q.reshape(shape)) ** order, axis=axis).real ** 2
        )

    moments = spectral_moments(surface)
    assert moments.m0 == pytest.approx(variance(0, 0), rel=1e-12)
    assert moments.m2 == pytest.approx((variance(1, 0) + variance(1, 1)) / 2, rel=1e-12)
    # A lattice of waves is not quite isotropic: along the axes the fourth moment is another than over all directions.
    assert moments.m4 == pytest.approx((variance(2, 0) + variance(2, 1)) / 2, rel=0.02)
    assert moments.rms_height == pytest.approx(surface.rms_height, rel=1e-14)
    assert moments.rms_slope == pytest.approx(surface.rms_slope, rel=1e-14)
    assert moments.m4**0.5 == pytest.approx(surface.rms_curvature, rel=1e-14)
    assert moments.rms_laplacian**2 == pytest.approx(surface.spectral_moments[2], rel=1e-14)


def test_nayak_parameter_of_one_wavelength_and_of_two():
    # All waves of one length: alpha = 3/2, the least. Of two lengths with parts a and b of the variance of height:
    # alpha = 3/2 (a + b)(a + 16 b)/(a + 4 b)^2 if one is half of the other.
    x = np.arange(64) / 64 * 2 * np.pi
    one = np.cos(3 * x)[:, None] + np.cos(3 * x)[None, :]
    other = np.cos(6 * x)[:, None] + np.cos(6 * x)[None, :]
    assert spectral_moments(Surface(one, 1e-4)).nayak_parameter == pytest.approx(1.5, rel=1e-12)
    a, b = 1.0, 0.3**2
    expected = 1.5 * (a + b) * (a + 16 * b) / (a + 4 * b) ** 2
    assert spectral_moments(Surface(one + 0.3 * other, 1e-4)).nayak_parameter == pytest.approx(expected, rel=1e-12)


def test_surface_files_hold_the_moments(tmp_path):
    surface = rough()
    write_surface(tmp_path / "surface.nc", surface, name="rough", seed=1)
    assert read_spectral_moments(tmp_path / "surface.nc") == spectral_moments(surface)
    with pytest.raises(ValueError, match=r"none\.nc: no such file"):
        read_spectral_moments(tmp_path / "none.nc")


def test_stickiness_is_the_attraction_beside_hertzian_contacts():
    # Contact strips of width d under cylinders of the curvature h''/2 have beside them Hertz's gap
    # (a^2/2R)(s sqrt(s^2 - 1) - arcosh s), s = x/a, a = d/2. In the limit of short range the strips where it is less
    # than the range have, of the contact's own area, the part pi (x - a)/d: the perimeter is pi/d of the area.
    moments = SpectralMoments(1e-12, 0.5, 1e12)
    slope, laplacian = moments.rms_slope, moments.rms_laplacian
    width, radius = 4 * slope / laplacian, 2 / laplacian
    material = Material(25e6, 0.05, 1e-6 * width)

    def gap(s):
        return (width / 2) ** 2 / (2 * radius) * (s * math.sqrt(s * s - 1) - math.acosh(s))

    reach = (brentq(lambda s: gap(s) - material.interaction_range, 1 + 1e-9, 2, xtol=1e-15) - 1) * width / 2
    attraction = material.surface_energy / material.interaction_range * math.pi * reach / width
    repulsion = material.contact_modulus * slope / 2
    assert stickiness(moments, material) == pytest.approx(attraction / repulsion, rel=1e-3)


def test_power_spectrum_is_that_of_the_synthesis():
    """C(q) of every ring: integral over the plane is h_rms^2, and the spectrum that was asked for comes back."""
    spectrum = SelfAffineSpectrum(1.0, 0.25, 0.02, 0.7)
    surface = spectrum.realise(256, 9)
    q, power, _ = radial_power_spectrum(surface)
    assert np.all(np.diff(q) > 0)
    inside = (q > 1.05 * 2 * np.pi / 0.25) & (q < 0.95 * 2 * np.pi / 0.02)
    np.testing.assert_allclose(power[inside], spectrum.psd(q[inside]), rtol=0.03)
    assert np.all(power[q > 1.1 * 2 * np.pi / 0.02] < 1e-20 * power.max())


def test_power_spectrum_of_a_free_square_does_not_see_its_edges():
    """A window keeps the jump at the edges of a cut-out part from drowning the short waves."""
    spectrum = SelfAffineSpectrum(4.0, 0.5, 0.1, 0.8)
    whole = spectrum.realise(512, 2)
    part = Surface(whole.heights[:256, :256], 2.0, boundary="free")
    q, power, _ = radial_power_spectrum(part)
    inside = (q > 2 * 2 * np.pi / 0.5) & (q < 0.9 * 2 * np.pi / 0.1)
    np.testing.assert_allclose(power[inside], spectrum.psd(q[inside]), rtol=0.6)
    beyond = q > 1.5 * 2 * np.pi / 0.1
    assert np.max(power[beyond]) < 1e-2 * spectrum.psd(0.95 * 2 * np.pi / 0.1)


def test_surface_files_of_all_kinds_have_their_power_spectrum(tmp_path):
    spectrum = SelfAffineSpectrum(1.0, 0.5, 0.1, 0.8)
    write_surface(tmp_path / "s.nc", spectrum.realise(64, 1), name="rough", seed=1, spectrum=spectrum)
    file = read_dataset(tmp_path / "s.nc")
    assert file.attrs["boundary"] == "periodic" and "source_file" not in file.attrs
    q, power = file["psd_wavevector"].values, file["power_spectrum"].values
    assert file["power_spectrum"].attrs["units"] == "m^4" and file["psd_wavevector"].attrs["units"] == "rad m^-1"
    # The integral over the plane of wave vectors, ring by ring, is the mean square height.
    low, high = file["psd_wavevector_bounds"].values.T
    assert np.all((low < q) & (q < high)) and file["psd_wavevector"].attrs["bounds"] == "psd_wavevector_bounds"
    variance = np.sum(np.pi * (high**2 - low**2) * power)
    assert variance == pytest.approx(float(file["rms_height"]) ** 2, rel=0.1)
