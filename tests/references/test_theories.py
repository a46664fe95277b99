"""Theories against their own limits, quadrature of published formulas, random summits, and measured truth."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

import icha
from icha import Material
from icha.asperity.jkr import JKR
from icha.datasets.files import read_dataset, write_dataset
from icha.references import persson, summit_theories
from icha.references import summit_theories as theories
from icha.references.bare_runs import ciavarella_states
from icha.references.theories import literature, reference_dataset
from icha.surfaces.moments import SpectralMoments, spectral_moments


def spectrum(rolloff=20e-6, short=1.5625e-6, hurst=0.8):
    return icha.SelfAffineSpectrum(period=100e-6, rolloff_wavelength=rolloff, short_wavelength=short, hurst=hurst)


@pytest.mark.parametrize("p", [0.01, 0.1, 0.5])
def test_persson_pressures_carry_the_area_and_the_load(p):
    area, _ = quad(lambda s: float(persson.persson_pressure_density(s, p)), 0, 10)
    load, _ = quad(lambda s: s * float(persson.persson_pressure_density(s, p)), 0, 10)
    assert area == pytest.approx(float(persson.persson_area(p)), rel=1e-9)
    assert load == pytest.approx(p, rel=1e-9)
    assert persson.persson_pressure_density(-0.1, p) == 0


def test_the_correction_of_xu_brings_persson_close_to_gfmd():
    """At small loads the area is larger by 1/sqrt(gamma); in full contact there is nothing to correct."""
    small = persson.corrected_persson_area(1e-8) / persson.persson_area(1e-8)
    assert small == pytest.approx(persson.XU_GAMMA**-0.5) and persson.corrected_persson_area(5.0) == 1
    points = literature("gfmd_area")
    pressure, area = np.array(points["reduced_pressure"]), np.array(points["area_fraction"])
    corrected = abs(persson.corrected_persson_area(pressure) / area - 1)
    assert corrected.max() < 0.055
    assert (corrected <= abs(persson.persson_area(pressure) / area - 1)).all()


@pytest.mark.parametrize(("hurst", "p"), [(0.8, 1e-2), (0.5, 5e-2)])
def test_mean_separation_is_the_published_double_integral(hurst, p):
    q0, q1, gamma = 5.0, 40.0, persson.YANG_PERSSON_GAMMA

    def psd(q):
        return min(1.0, (q / q0) ** (-2 * (1 + hurst)))

    def moment(n, q):
        return quad(lambda k: k**n * psd(k), 1, q, points=[q0] if q > q0 else None)[0]

    pressure = p * math.sqrt(2 * math.pi * moment(3, q1))

    def inner(q):
        w = (math.pi * moment(3, q)) ** -0.5
        if w * pressure > 8:
            return 0.0

        def integrand(s):
            t = w * math.exp(s)
            return (gamma + 3 * (1 - gamma) * math.erf(t) ** 2) * math.exp(-(t**2))

        return w * quad(integrand, math.log(pressure), math.log(8 / w), limit=200)[0]

    def outer(x):  # q = 1 + x^2 takes out the singularity at q_L
        return (1 + x * x) ** 2 * psd(1 + x * x) * inner(1 + x * x) * 2 * x

    total = quad(outer, 1e-6, 2, epsrel=1e-6)[0] + quad(outer, 2, math.sqrt(q1 - 1), epsrel=1e-6)[0]
    expected = math.sqrt(math.pi) * total / math.sqrt(2 * math.pi * moment(1, q1))
    own = persson.persson_mean_separation(p, spectrum(short=100e-6 / q1, hurst=hurst))
    assert float(own) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("hurst", [0.8, 1.0])
def test_stiffness_is_the_derivative_of_the_separation(hurst):
    p, step = np.array([1e-4, 1e-2, 0.1, 0.5]), 1e-3
    surface = spectrum(hurst=hurst)
    above, below = (persson.persson_mean_separation(p * np.exp(s), surface) for s in (step, -step))
    stiffness = p * 2 * step / (below - above)
    np.testing.assert_allclose(persson.persson_stiffness(p, surface), stiffness, rtol=2e-4)


def test_reference_dataset_is_complete_and_byte_stable(tmp_path):
    moments = spectral_moments(spectrum().realise(grid=256, seed=1))
    soft = {(1.0, "cmc"): icha.Material(25e6, 0.05, 2e-9), (0.2, "soft"): icha.Material(0.24e6, 0.002, 2e-9)}
    for name in ("a.nc", "b.nc"):
        write_dataset(reference_dataset(spectrum(), moments, soft), tmp_path / name)
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()
    dataset = read_dataset(tmp_path / "a.nc")
    assert float(dataset["bush_gibson_thomas_area_fraction"].max()) <= 0.1
    assert float(dataset["summit_area_fraction"].max()) == pytest.approx(0.1)
    theories = [name for name in dataset if name.startswith(("persson", "bush", "greenwood", "gfmd", "fuller"))]
    labels = {"fuller_tabor_rms_slope", "fuller_tabor_material"}
    assert len(theories) == 10
    assert all("references" in dataset[name].attrs for name in theories if name not in labels)
    assert {"persson_reduced_separation", "persson_reduced_stiffness"}.isdisjoint(reference_dataset())
    assert not [name for name in reference_dataset(spectrum()) if name.startswith(("greenwood", "fuller"))]
    assert not [name for name in reference_dataset(spectrum(), moments) if name.startswith("fuller")]


def test_published_points_are_of_their_own_surface_alone():
    gfmd = literature("gfmd_area")
    own = {"period": 1e-4, "rolloff_wavelength": 1e-4, "short_wavelength": 1e-6, "hurst": 0.8}
    for changed in ({"rolloff_wavelength": 2e-5}, {"short_wavelength": 2e-6}, {"hurst": 0.7}):
        assert "gfmd_area_fraction" not in reference_dataset(icha.SelfAffineSpectrum(**own | changed))
    area = reference_dataset(icha.SelfAffineSpectrum(**own))["gfmd_area_fraction"]
    assert area.values.tolist() == gfmd["area_fraction"] and "gfmd_area_fraction" not in reference_dataset()


def test_reference_dataset_holds_the_theories_at_their_own_slopes():
    moments = spectral_moments(spectrum().realise(grid=256, seed=1))
    soft = icha.Material(0.24e6, 0.002, 2e-9)
    dataset = reference_dataset(None, moments, {(0.2, "soft"): soft})
    area = dataset["summit_area_fraction"].values
    p, u = (dataset[f"greenwood_williamson_reduced_{name}"].values for name in ("pressure", "separation"))
    np.testing.assert_allclose(summit_theories.greenwood_williamson_area(u, moments), area, rtol=1e-9)
    np.testing.assert_allclose(summit_theories.greenwood_williamson_pressure(u, moments), p, rtol=1e-9)
    (curve,) = np.flatnonzero((dataset["fuller_tabor_rms_slope"] == 0.2) & (dataset["fuller_tabor_material"] == "soft"))
    p, u = (dataset[f"fuller_tabor_reduced_{name}"].values[curve] for name in ("pressure", "separation"))
    own = moments.scaled_to_rms_slope(0.2)
    np.testing.assert_allclose(summit_theories.fuller_tabor_area(u, own, soft), area, rtol=1e-9)
    np.testing.assert_allclose(summit_theories.fuller_tabor_pressure(u, own, soft), p, rtol=1e-9)


MODULUS, ENERGY = 25e6, 0.05
SOFT, BARE = Material(MODULUS, ENERGY, 2e-9), Material(MODULUS, 0.0, 2e-9)
MOMENTS = SpectralMoments(2.4e-12, 0.5, 1.5e12)
SEPARATIONS = np.array([0.5, 1.5, 3.0])


def test_summit_statistics_are_those_of_the_random_field():
    # At a point of zero slope, curvatures are drawn from the field's own covariances (units m0 = m2 = 1, m4 = alpha);
    # such a point counts by the Jacobian |det H| where the Hessian is negative definite.
    alpha, rng = 4.0, np.random.default_rng(3)
    mean, deviator, twist = rng.standard_normal((3, 4_000_000)) * np.sqrt(
        np.array([[2 * alpha / 3], [alpha / 3], [alpha / 3]])
    )  # -(hxx + hyy)/2, (hxx - hyy)/2, hxy
    weight = np.where(mean > np.hypot(deviator, twist), mean**2 - deviator**2 - twist**2, 0.0)
    slope_at_zero = 1 / (2 * np.pi)  # probability density of a zero gradient
    density = slope_at_zero * weight.mean()
    # The height given the curvatures: mean 3/(2 alpha) times theirs, variance 1 - 3/(2 alpha).
    share = weight / weight.sum()
    curvature = share @ mean
    height = 1.5 / alpha * curvature
    variance = 1 - 1.5 / alpha + (1.5 / alpha) ** 2 * (share @ mean**2 - curvature**2)
    found = theories.gaussian_summits(SpectralMoments(1.0, 1.0, alpha))
    assert found.density == pytest.approx(density, rel=3e-3)
    assert found.mean_height == pytest.approx(height, rel=3e-3)
    assert found.deviation**2 == pytest.approx(variance, rel=3e-3)
    assert 1 / found.radius_of_curvature == pytest.approx(curvature, rel=3e-3)


def test_greenwood_williamson_is_the_sum_over_random_summits():
    theory = theories.gaussian_summits(MOMENTS)
    heights = theory.mean_height + theory.deviation * np.random.default_rng(1).standard_normal(2_000_000)
    for u in SEPARATIONS:
        depth = heights - u * MOMENTS.rms_height
        depth = depth[depth > 0]
        per_area = theory.density / len(heights)
        area = np.pi * theory.radius_of_curvature * depth.sum() * per_area
        force = 4 / 3 * math.sqrt(theory.radius_of_curvature) * np.sum(depth**1.5) * per_area / MOMENTS.rms_slope
        noise = 5 / math.sqrt(len(depth))
        assert float(theories.greenwood_williamson_area(u, MOMENTS)) == pytest.approx(area, rel=noise)
        assert float(theories.greenwood_williamson_pressure(u, MOMENTS)) == pytest.approx(force, rel=noise)


def test_fuller_and_tabor_is_the_integral_over_the_heights_and_greenwood_and_williamson_without_adhesion():
    area = theories.fuller_tabor_area(SEPARATIONS, MOMENTS, BARE)
    pressure = theories.fuller_tabor_pressure(SEPARATIONS, MOMENTS, BARE)
    np.testing.assert_allclose(area, theories.greenwood_williamson_area(SEPARATIONS, MOMENTS), rtol=1e-10)
    np.testing.assert_allclose(pressure, theories.greenwood_williamson_pressure(SEPARATIONS, MOMENTS), rtol=1e-10)
    theory = theories.gaussian_summits(MOMENTS)
    law, R = JKR(SOFT), theory.radius_of_curvature

    def integrand(approach, u):
        t = (u * MOMENTS.rms_height + approach - theory.mean_height) / theory.deviation
        force = float(law.force(law.contact_radius(approach, R), R))
        return theory.density * force * math.exp(-t * t / 2) / (math.sqrt(2 * np.pi) * theory.deviation)

    for u in SEPARATIONS:
        middle = 0.02 * theory.deviation
        parts = [
            quad(integrand, low, high, args=(u,), limit=400, epsrel=1e-8)[0]
            for low, high in ((0.0, middle), (middle, 12 * theory.deviation))
        ]
        expected = sum(parts) / (MODULUS * MOMENTS.rms_slope)
        own = float(theories.fuller_tabor_pressure(u, MOMENTS, SOFT))
        assert own == pytest.approx(expected, rel=1e-6)


RADIUS, LENGTH, AREA = 1e-3, 2e-8, 1e-6


@pytest.mark.parametrize("power", [0.5, 0.8])
def test_for_a_sphere_the_estimate_is_jkr(power):
    """Hertz in, JKR out, for two spacings of the states: force, area and indentation."""
    indentation = 1e-6 * np.linspace(0.3, 1, 60) ** power
    radius = np.sqrt(RADIUS * indentation)
    load = 4 / 3 * radius**3 / RADIUS / AREA
    area = np.pi * radius**2 / AREA
    states = ciavarella_states(load, area, -indentation, LENGTH)
    a = np.sqrt(states.area_fraction * AREA / np.pi)
    jkr = (4 / 3 * a**3 / RADIUS - np.sqrt(8 * np.pi * LENGTH * a**3)) / AREA
    inside = slice(3, -3)  # derivatives at the ends of a fit are inaccurate
    np.testing.assert_allclose(states.relative_load[inside], jkr[inside], atol=2e-3 * load.max())
    delta = a**2 / RADIUS - np.sqrt(2 * np.pi * LENGTH * a)
    np.testing.assert_allclose(-states.separation[inside], delta[inside], atol=2e-3 * indentation.max())


def test_without_adhesion_nothing_changes_and_few_states_are_too_few():
    separation = np.linspace(1e-6, 1e-7, 20)
    load = 1e-3 * np.exp(-separation / 3e-7)
    states = ciavarella_states(load, 0.5 * load, separation, 0.0)
    np.testing.assert_allclose(states.relative_load, load, rtol=1e-12)
    np.testing.assert_allclose(states.separation, separation, rtol=1e-12)
    assert ciavarella_states(load[:9], load[:9], separation[:9], 1e-9) is None
