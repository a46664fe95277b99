"""Surfaces: spectrum, synthesis, statistics and shapes against integrals, Fourier sums and definitions."""

import math
import warnings

import numpy as np
import pytest

from icha import SelfAffineSpectrum, Surface
from icha.surfaces.shapes import SHAPES, Cone, CylinderPunch, FlatPunch, Paraboloid, Sphere, Wave

PERIOD = 100e-6
SPECTRUM = {"period": PERIOD, "rolloff_wavelength": 20e-6, "short_wavelength": PERIOD / 16, "hurst": 0.8}


def modes(surface):
    """|h_q|^2 and q of all modes, from a plain FFT."""
    n = surface.grid
    power = np.abs(np.fft.fft2(surface.heights) / n**2) ** 2
    k = 2 * np.pi / surface.period * np.fft.fftfreq(n, 1 / n)
    return power, np.hypot(k[:, None], k[None, :])


def written_psd(q, plateau, hurst=0.8, ratio=16):
    q_l, q_0, q_1 = 2 * np.pi / PERIOD, 2 * np.pi / 20e-6, 2 * np.pi / PERIOD * ratio
    inside = (q >= q_l * (1 - 1e-12)) & (q < q_1 * (1 - 1e-12))
    return np.where(inside, plateau * np.where(q < q_0, 1.0, (np.maximum(q, q_0) / q_0) ** (-2 * (1 + hurst))), 0.0)


@pytest.mark.parametrize("seed", [0, 7])
@pytest.mark.parametrize("hurst", [0.3, 0.8, 1.0])
def test_synthesis_reproduces_every_mode(seed, hurst):
    spectrum = SelfAffineSpectrum(**(SPECTRUM | {"hurst": hurst}), rms_slope=0.7)
    surface = spectrum.realise(96, seed)
    power, q = modes(surface)
    expected = written_psd(q, spectrum.plateau, hurst) * (2 * np.pi / PERIOD) ** 2
    np.testing.assert_allclose(power, expected, rtol=1e-9, atol=1e-20 * expected.max())
    assert np.sum(q**2 * power) == pytest.approx(0.7**2, rel=1e-12)
    np.testing.assert_allclose(spectrum.psd(q), expected / (2 * np.pi / PERIOD) ** 2, rtol=1e-12)
    assert spectrum.rms_height == pytest.approx(np.std(surface.heights), rel=1e-12)


def test_statistics_of_a_surface_against_its_modes():
    surface = SelfAffineSpectrum(**SPECTRUM).realise(97, 3, amplitudes="gaussian")
    power, q = modes(surface)
    assert surface.rms_height == pytest.approx(np.std(surface.heights), rel=1e-12)
    assert surface.rms_slope == pytest.approx(np.sqrt(np.sum(q**2 * power)), rel=1e-12)
    assert surface.rms_curvature == pytest.approx(np.sqrt(3 / 8 * np.sum(q**4 * power)), rel=1e-12)


def test_statistics_of_one_wave():
    n, k, amplitude = 64, 5, 2e-6
    x = np.arange(n) / n
    surface = Surface(amplitude * np.cos(2 * np.pi * k * x)[None, :] * np.ones((n, 1)), PERIOD)
    q = 2 * np.pi * k / PERIOD
    assert surface.rms_height == pytest.approx(amplitude / np.sqrt(2), rel=1e-12)
    assert surface.rms_slope == pytest.approx(q * amplitude / np.sqrt(2), rel=1e-12)
    # The shortest wave that the grid holds stands alone in its column of the half spectrum.
    surface = Surface(amplitude * np.cos(np.pi * np.arange(n))[None, :] * np.ones((n, 1)), PERIOD)
    assert surface.rms_height == pytest.approx(amplitude, rel=1e-12)
    assert surface.rms_slope == pytest.approx(np.pi * n / PERIOD * amplitude, rel=1e-12)


@pytest.mark.parametrize("amplitudes", ["fixed", "gaussian"])
def test_a_finer_grid_holds_the_same_surface(amplitudes):
    spectrum = SelfAffineSpectrum(**SPECTRUM)
    coarse, fine = spectrum.realise(64, 5, amplitudes), spectrum.realise(192, 5, amplitudes)
    np.testing.assert_allclose(fine.heights[::3, ::3], coarse.heights, atol=1e-12 * coarse.rms_height)


def test_gaussian_amplitudes_follow_an_exponential_law():
    spectrum = SelfAffineSpectrum(**SPECTRUM)
    ratios = []
    for seed in range(4):
        power, q = modes(spectrum.realise(64, seed, amplitudes="gaussian"))
        expected = written_psd(q, spectrum.plateau) * (2 * np.pi / PERIOD) ** 2
        ratios.append(power[expected > 0] / expected[expected > 0])
    ratios = np.concatenate(ratios)
    count = len(ratios) / 2
    # |h_q|^2 over its mean is exponentially distributed: mean 1, variance 1, median ln 2.
    assert np.mean(ratios) == pytest.approx(1, abs=3 / np.sqrt(count))
    assert np.var(ratios) == pytest.approx(1, abs=3 * np.sqrt(8 / count))
    assert np.median(ratios) == pytest.approx(np.log(2), abs=3 / np.sqrt(count))


def test_heights_are_zero_mean_read_only_and_copied():
    heights = np.random.default_rng(1).normal(size=(16, 16)) + 5
    surface = Surface(heights, 1.0)
    heights[0, 0] = 1e9
    assert abs(surface.heights.mean()) < 1e-14
    assert surface.heights.max() < 10
    with pytest.raises(ValueError, match="read-only"):
        surface.heights[0, 0] = 0


def test_too_few_cells_per_wave_are_refused_and_few_are_warned_of():
    spectrum = SelfAffineSpectrum(**SPECTRUM)
    with pytest.raises(ValueError, match="grid"):
        spectrum.realise(31, 1)
    with pytest.warns(UserWarning, match=r"3\.94 cells"):
        spectrum.realise(63, 1)
    with pytest.warns(UserWarning, match="grid"):
        surface = spectrum.realise(32, 1)
    assert surface.rms_slope == pytest.approx(1, rel=1e-12)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spectrum.realise(64, 1)


BAD_SPECTRA = {
    "period": [0.0, -1.0, "100 um", None],
    "rolloff_wavelength": [101e-6, float("nan")],
    "short_wavelength": [20e-6, 30e-6, 0.0],
    "hurst": [0.0, 1.0001, -0.5, True],
    "rms_slope": [0.0, float("inf")],
}
BAD_REALISATIONS = {"grid": [64.0, 4, "64"], "seed": [-1, 1.5, None], "amplitudes": ["none"]}


@pytest.mark.parametrize(("argument", "values"), (BAD_SPECTRA | BAD_REALISATIONS).items())
def test_bad_arguments_are_refused_by_name(argument, values):
    for value in values:
        spectrum, realisation = dict(SPECTRUM), {"grid": 64, "seed": 1}
        (spectrum if argument in BAD_SPECTRA else realisation)[argument] = value
        with pytest.raises(ValueError, match=argument):
            SelfAffineSpectrum(**spectrum).realise(**realisation)


def test_a_spectrum_without_any_wave_is_refused():
    with pytest.raises(ValueError, match="short_wavelength"):
        SelfAffineSpectrum(1.0, 1.0, 0.999999999999, 0.8)


def _with(value):
    heights = np.random.default_rng(0).normal(size=(16, 16))
    heights[3, 4] = value
    return heights


@pytest.mark.parametrize(
    "heights",
    [
        np.zeros((16, 16)),
        np.ones((16, 15)),
        np.arange(49.0).reshape(7, 7),
        _with(np.nan),
        _with(np.inf),
        np.full((16, 16), 1j),
        np.ma.masked_greater(np.arange(64.0).reshape(8, 8), 60),
    ],
)
@pytest.mark.filterwarnings("error")
def test_bad_heights_are_refused_by_name(heights):
    with pytest.raises(ValueError, match="heights"):
        Surface(heights, 1.0)


@pytest.mark.parametrize("value", [0, -1.0, float("nan"), "1", [1.0]])
def test_bad_lengths_and_slopes_are_refused_by_name(value):
    with pytest.raises(ValueError, match="period"):
        Surface(_with(0.0), value)
    with pytest.raises(ValueError, match="rms_slope"):
        Surface(_with(0.0), 1.0).scaled_to_rms_slope(value)


INNER, OUTER, CORNER = (0.9e-6, 0.0), (1.1e-6, 0.0), (0.8e-6, 0.8e-6)
SMOOTH = [Sphere(1e-3), Paraboloid((1e-3, 1e-3)), Wave(1e-3, 2e-7, 3e-5), Wave(1e-3, -2e-7, 3e-5)]


def test_points_of_a_sphere_have_the_distance_of_its_radius_from_the_centre():
    x, y = np.random.default_rng(1).uniform(-0.7, 0.7, (2, 100))
    np.testing.assert_allclose(np.sqrt(x**2 + y**2 + (Sphere(1.0).heights(x, y) + 1.0) ** 2), 1.0, rtol=1e-14)
    with pytest.raises(ValueError, match=r"radius: 0\.001 m is less than the distance of 0\.00141421 m .* larger"):
        Sphere(1e-3).heights(np.array([0.0, 1e-3]), np.array([0.0, 1e-3]))
    assert ELLIPSOID.sphere_radius == pytest.approx(math.sqrt(10) * 1e-3, rel=1e-14)


ELLIPSOID, CREST, TROUGH = Paraboloid([2e-3, 5e-3]), *SMOOTH[2:]


@pytest.mark.parametrize(
    ("shape", "x", "y", "height"),
    [
        # Close to the apex, rounding must not destroy the height.
        (Sphere(1e-3), 1e-12, 0.0, -(1e-12**2) / 2e-3),
        (ELLIPSOID, 1e-5, 0.0, -(1e-5**2) / (2 * 2e-3)),
        (ELLIPSOID, 0.0, 1e-5, -(1e-5**2) / (2 * 5e-3)),
        (Cone(math.radians(45)), 3.0, 4.0, -5.0),
        (Cone(math.radians(80)), 0.0, 1.0, -math.tan(math.radians(10))),
        # Waves repeat below the paraboloid; at a negative amplitude, a trough lies in the centre.
        (CREST, 6e-5, 0.0, -(6e-5**2) / 2e-3),
        (CREST, 0.0, 1.5e-5, -(1.5e-5**2) / 2e-3 - 4e-7),
        (TROUGH, 0.0, 1.5e-5, -(1.5e-5**2) / 2e-3 + 4e-7),
        # Punches exist inside their edges only.
        *((CylinderPunch(1e-6), *at, height) for at, height in ((INNER, 0), (OUTER, -np.inf), (CORNER, -np.inf))),
        *((FlatPunch(2e-6), *at, height) for at, height in ((INNER, 0), (OUTER, -np.inf), (CORNER, 0))),
    ],
)
def test_heights_of_shapes(shape, x, y, height):
    assert shape.heights(x, y) == pytest.approx(height, rel=1e-12, abs=0)


@pytest.mark.parametrize("shape", [Sphere(1e-3), Cone(1.4), *SMOOTH[2:]])
def test_slope_is_the_derivative_of_the_height(shape):
    r, step = np.linspace(1e-5, 3e-4, 7), 1e-9
    difference = (shape.heights(r - step, 0.0) - shape.heights(r + step, 0.0)) / (2 * step)
    np.testing.assert_allclose(shape.slope(r), difference, rtol=1e-6)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("sphere", {"radius": 0.0}, "radius: 0.0 must be a number in"),
        ("paraboloid", {"radii": 1e-3}, "radii: 0.001 must be two lengths in m"),
        ("flat_punch", {"side": -1e-6}, "side: -1e-06 must be"),
        ("cone", {"half_angle": math.pi / 2}, "half_angle: 1.57.* must be a number in .* \\(in rad\\)"),
        ("wave", {"radius": 1e-3, "amplitude": math.nan, "wavelength": 1e-5}, "amplitude: nan is not finite"),
    ],
)
def test_invalid_parameters_are_refused_by_name(name, values, message):
    with pytest.raises(ValueError, match=message):
        SHAPES[name](**values)
