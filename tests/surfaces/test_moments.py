"""Moments of spectra in closed form and of profiles; when surfaces stick, by Hertz's gap beside a contact."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from icha import Material, SelfAffineSpectrum, Surface
from icha.asperity.stickiness import stickiness
from icha.datasets.files import read_spectral_moments, write_surface
from icha.surfaces.moments import SpectralMoments, spectral_moments

MATERIAL = Material(25e6, 0.05, 2.071e-9)


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


def test_nayak_parameter_of_a_self_affine_spectrum_is_that_of_its_continuum():
    def moment(order, q0=4.0, q1=24.0, hurst=0.8):
        exponent = order + 1 - 2 * (1 + hurst)
        return (q0 ** (order + 1 + 1) - 1) / (order + 2) + q0 ** (2 * (1 + hurst)) * (
            q1 ** (exponent + 1) - q0 ** (exponent + 1)
        ) / (exponent + 1)

    alpha = 1.5 * moment(0) * moment(4) / moment(2) ** 2
    # The longest waves are few, so the lattice's variance of height differs from the integral.
    assert spectral_moments(rough()).nayak_parameter == pytest.approx(alpha, rel=0.1)


def test_heights_scale_all_moments_alike():
    moments, scaled = spectral_moments(rough()), spectral_moments(rough().scaled_to_rms_slope(0.2))
    np.testing.assert_allclose(moments.scaled_to_rms_slope(0.2), scaled, rtol=1e-12)
    assert scaled.nayak_parameter == pytest.approx(moments.nayak_parameter, rel=1e-12)


def test_surface_files_hold_the_moments(tmp_path):
    surface = rough()
    write_surface(tmp_path / "surface.nc", surface, name="rough", seed=1)
    assert read_spectral_moments(tmp_path / "surface.nc") == spectral_moments(surface)
    with pytest.raises(ValueError, match=r"none\.nc: no such file"):
        read_spectral_moments(tmp_path / "none.nc")


def test_stickiness_without_adhesion_is_none():
    assert stickiness(spectral_moments(rough()), Material(25e6, 0.0, 2e-9)) == 0.0


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


def test_surfaces_stick_where_the_published_inequality_holds():
    # (h' r E*/(2 dgamma)) [h' d/(4 r)]^(2/3) < pi (3/16)^(2/3), d = 4 h'/h''.
    moments = spectral_moments(rough())
    for energy in np.geomspace(1e-3, 1e2, 11):
        material = Material(25e6, energy, 2e-9)
        slope, reach = moments.rms_slope, material.interaction_range
        width = 4 * slope / moments.rms_laplacian
        left = slope * reach * 25e6 / (2 * energy) * (slope * width / (4 * reach)) ** (2 / 3)
        bound = math.pi * (3 / 16) ** (2 / 3)
        assert stickiness(moments, material) == pytest.approx(bound / left, rel=1e-12)
    assert bound == pytest.approx(1.03, abs=2e-3)


def test_softness_energy_and_smoothness_make_sticky():
    moments = spectral_moments(rough())
    usual = stickiness(moments, MATERIAL)
    assert stickiness(moments, Material(12.5e6, 0.05, 2.071e-9)) == pytest.approx(2 * usual)
    assert stickiness(moments, Material(25e6, 0.1, 2.071e-9)) == pytest.approx(2 * usual)
    assert stickiness(moments.scaled_to_rms_slope(0.5), MATERIAL) == pytest.approx(usual * 2 ** (5 / 3))
