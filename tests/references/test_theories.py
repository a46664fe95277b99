"""Theories against their own limits, against quadrature of the published formula, and against measured truth."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

import icha
from icha.datasets.files import read_dataset, write_dataset
from icha.references import persson, summit_theories
from icha.references.theories import literature, reference_dataset
from icha.surfaces.moments import spectral_moments

P = np.array([1e-6, 1e-4, 1e-2, 0.1, 0.5])


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


def test_mean_separation_is_near_boundary_elements():
    # FFT boundary elements on one surface of this spectrum, contact resolved on 2048 x 2048 points.
    p = np.array([1e-3, 3.16e-3, 1e-2, 3.16e-2, 0.1])
    measured = np.array([2.51, 2.11, 1.62, 1.07, 0.52])
    theory = persson.persson_mean_separation(p, spectrum())
    # A finite surface has a highest summit, so the theory of the infinite one lies above at small loads.
    assert np.all(theory > measured)
    np.testing.assert_allclose(theory[2:], measured[2:], rtol=0.1)
    np.testing.assert_allclose(theory[:2], measured[:2], rtol=0.2)


@pytest.mark.parametrize("hurst", [0.8, 1.0])
def test_stiffness_is_the_derivative_of_the_separation(hurst):
    p, step = np.array([1e-4, 1e-2, 0.1, 0.5]), 1e-3
    surface = spectrum(hurst=hurst)
    above, below = (persson.persson_mean_separation(p * np.exp(s), surface) for s in (step, -step))
    stiffness = p * 2 * step / (below - above)
    np.testing.assert_allclose(persson.persson_stiffness(p, surface), stiffness, rtol=2e-4)


@pytest.mark.parametrize("theory", [persson.persson_mean_separation, persson.persson_stiffness])
def test_pressure_must_be_positive(theory):
    with pytest.raises(ValueError, match="reduced_pressure"):
        theory([0.0, 0.1], spectrum())


def test_challenge_reference_pressure_and_tabor_parameter():
    cmc = literature("contact_mechanics_challenge")
    assert cmc["reference_pressure_Pa"] == pytest.approx(0.01 * cmc["contact_modulus_Pa"] * cmc["rms_slope"])
    length = cmc["surface_energy_J_m2"] / cmc["contact_modulus_Pa"]
    mu = (length**2 * cmc["rms_curvature_radius_m"]) ** (1 / 3) / cmc["interaction_range_m"]
    assert mu == pytest.approx(cmc["tabor_parameter"], rel=0.01)


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
