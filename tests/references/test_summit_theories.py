"""Theories of separate summits against sums over random summits, closed forms, limits, and summits of surfaces."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from icha import Material
from icha.asperity.jkr import JKR
from icha.references import summit_theories as theories
from icha.surfaces.moments import SpectralMoments

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


def test_without_adhesion_it_is_greenwood_and_williamsons():
    area = theories.fuller_tabor_area(SEPARATIONS, MOMENTS, BARE)
    pressure = theories.fuller_tabor_pressure(SEPARATIONS, MOMENTS, BARE)
    np.testing.assert_allclose(area, theories.greenwood_williamson_area(SEPARATIONS, MOMENTS), rtol=1e-10)
    np.testing.assert_allclose(pressure, theories.greenwood_williamson_pressure(SEPARATIONS, MOMENTS), rtol=1e-10)


def test_it_is_the_integral_over_the_heights():
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
