"""Shares of variance from a fitted polynomial: against brute force on analytic stand-ins, and their intervals."""

import math

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc, sobol_indices

from icha.analysis.polynomial_chaos import expand
from icha.support.distributions import Distribution

# Five parameters as a tribologist would vary them, and the same distributions of scipy.
PARAMETERS = {
    Distribution("uniform", 0.5, 0.9): stats.uniform(0.5, 0.4),
    Distribution("lognormal", 0.4, 1.3): stats.lognorm(math.log(1.3), scale=0.4),
    Distribution("normal", 2.0, 0.1): stats.norm(2.0, 0.1),
    Distribution("loguniform", 0.7, 0.9): stats.loguniform(0.7, 0.9),
    Distribution("uniform", 0.1, 0.2): stats.uniform(0.1, 0.1),
}
NORMAL = [each.is_normal for each in PARAMETERS]


def quadratic(x):
    """A polynomial of degree two in the standardised parameters, with interactions."""
    hurst, energy, modulus, wave, slope = x
    of_energy, of_wave = np.log(energy), np.log(wave)
    return (
        2 * hurst
        + 0.8 * of_energy
        - 1.5 * modulus
        - 6 * of_wave * hurst
        + 10 * (slope - 0.15) * of_energy
        + 150 * (slope - 0.15) ** 2
    )


def smooth(x):
    """The logarithm of a power law with a threshold, which no polynomial is equal to."""
    hurst, energy, modulus, wave, slope = x
    return np.log(energy**0.3 / (modulus * slope) + 0.2 * np.sqrt(1 + hurst / wave))


def sample(count, seed=1):
    points = qmc.Sobol(len(PARAMETERS), rng=seed).random(count).T
    return np.array([each.quantile(row) for each, row in zip(PARAMETERS, points, strict=True)])


def fit(function, count, noise=0.0, seed=1):
    values = sample(count, seed)
    points = np.column_stack([each.standardise(row) for each, row in zip(PARAMETERS, values, strict=True)])
    return expand(points, NORMAL, function(values) + noise * np.random.default_rng(seed).standard_normal(count))


@pytest.mark.parametrize(("function", "degree", "error"), [(quadratic, 2, 1e-20), (smooth, 2, 2e-2)])
def test_indices_of_64_cases_agree_with_brute_force(function, degree, error):
    found = fit(function, 64)
    assert found.degree == degree and found.error < error
    brute = sobol_indices(func=lambda x: function(x)[None], n=2**14, dists=list(PARAMETERS.values()), rng=1)
    first, total = found.indices(found.coefficients)
    np.testing.assert_allclose(first, np.ravel(brute.first_order), atol=5e-3)
    np.testing.assert_allclose(total, np.ravel(brute.total_order), atol=5e-3)
    assert (total >= first - 1e-12).all() and first.sum() <= 1 + 1e-12


def test_intervals_contain_the_true_indices_in_nine_cases_of_ten():
    truth, _ = fit(quadratic, 64).indices(fit(quadratic, 64).coefficients)
    inside = []
    for seed in range(100):
        found = fit(quadratic, 64, noise=0.1, seed=seed)
        first, _ = found.indices(found.coefficients)
        inside.append(abs(first - truth) <= found.half_widths()[0])
    # The noise itself has a share of the variance, so the indices are slightly too small.
    assert 0.8 < np.mean(inside) < 0.98


def test_the_leave_one_out_error_is_that_of_refitting():
    found = fit(smooth, 64)
    values = sample(64)
    points = np.column_stack([each.standardise(row) for each, row in zip(PARAMETERS, values, strict=True)])
    response, normal = smooth(values), NORMAL
    others = np.arange(64) != 5
    without = expand(points[others], normal, response[others])
    np.testing.assert_allclose(found.without[5], without.coefficients, atol=1e-10)


def test_main_effects_of_a_sum_are_its_terms():
    found = fit(lambda x: 2 * x[0] + np.log(x[1]), 64)
    hurst = np.array([0.5, 0.7, 0.9])
    effect = found.main_effect(0, next(iter(PARAMETERS)).standardise(hurst), normal=False)
    np.testing.assert_allclose(effect, 2 * hurst + math.log(0.4), rtol=1e-10)


def test_few_cases_and_constant_values_give_no_polynomial():
    assert fit(quadratic, 8) is None
    assert fit(lambda x: np.ones(x.shape[1]), 64) is None


@pytest.mark.parametrize(("ours", "scipys"), PARAMETERS.items(), ids=lambda each: getattr(each, "kind", ""))
def test_quantiles_and_standardised_values_are_those_of_the_distribution(ours, scipys):
    levels = np.linspace(0.01, 0.99, 9)
    values = ours.quantile(levels)
    np.testing.assert_allclose(values, scipys.ppf(levels), rtol=1e-12)
    expected = stats.norm.ppf(levels) if ours.is_normal else 2 * levels - 1
    np.testing.assert_allclose(ours.standardise(values), expected, atol=1e-12)
