"""Estimates from three levels of nested seeds: exact cases, and coverage of intervals of synthetic levels."""

import numpy as np
import pytest
from scipy.stats import t

from icha.analysis.control_variates import ORDER, PROBABILITY, estimate_mean, estimate_quantity


def by_seed(values):
    return dict(enumerate(values, start=1))


def test_the_fine_level_alone_gives_students_interval():
    values = np.array([0.1, 0.4, 0.2, 0.5])
    found = estimate_mean({}, {}, by_seed(values))
    half = t.ppf(0.5 * (1 + PROBABILITY), 3) * values.std(ddof=1) / 2
    assert found.mean == pytest.approx(0.3) and found.scatter == pytest.approx(half)
    assert found.model == found.refinement == found.coefficient == 0 and np.isnan(found.grid)
    assert found.half_width == found.scatter


def test_a_level_that_differs_by_a_constant_and_a_factor_gives_its_own_mean_and_scatter():
    cheap = np.random.default_rng(1).normal(size=40)
    dear = 2.0 + 0.7 * cheap
    found = estimate_mean(by_seed(cheap), by_seed(dear[:8]), by_seed(dear[:3] + 0.01))
    assert found.coefficient == pytest.approx(0.7)
    assert found.mean == pytest.approx(2.01 + 0.7 * cheap.mean())
    assert (found.model, found.refinement) == pytest.approx((0, 0), abs=1e-7)
    assert found.grid == pytest.approx(0.01 / (2**ORDER - 1))


def test_seeds_that_a_level_lacks_are_left_out_of_the_next_level():
    cheap, dear = {1: 0.0, 2: 1.0, 3: 2.0}, {2: 1.5, 3: 2.5, 9: 100.0}
    assert estimate_mean(cheap, {}, dear).mean == pytest.approx(1.5)
    assert estimate_mean(cheap, dear, {9: 1.0, 2: 1.0}) is None
    assert estimate_mean(cheap, dear, {}) is None


@pytest.mark.parametrize(("coarse_count", "fine_count"), [(4, 2), (8, 3)])
def test_intervals_contain_the_mean_as_often_as_they_promise(coarse_count, fine_count):
    """Levels with the correlations that were measured at p* = 1e-2: 0.6 with asperities, 0.99 between the grids."""
    rng, inside, width, plain = np.random.default_rng(2), 0, [], []
    for _ in range(2000):
        shared = rng.normal(size=50)
        fine = 0.085 * shared
        coarse = fine + 0.05 + 0.01 * rng.normal(size=50)
        asperities = -0.1 + 0.08 * (0.6 * shared + 0.8 * rng.normal(size=50))
        found = estimate_mean(by_seed(asperities), by_seed(coarse[:coarse_count]), by_seed(fine[:fine_count]))
        half = np.linalg.norm([found.scatter, found.model, found.refinement])
        inside += abs(found.mean) <= half
        width.append(half)
        plain.append(estimate_mean({}, {}, by_seed(fine[:fine_count])).half_width)
    assert 0.85 <= inside / 2000 <= 0.97
    assert np.median(width) < 0.6 * np.median(plain)


@pytest.mark.parametrize("mean", [-58.0, 24.0, -0.5])
def test_intervals_of_quantities_of_either_sign_are_symmetric(mean):
    """Forces may be tensile, and their intervals contain zero if the seeds scatter more than the mean."""
    found = estimate_quantity({}, {}, by_seed(mean + np.array([-40.0, 0.0, 40.0])))
    half = t.ppf(0.5 * (1 + PROBABILITY), 2) * 40 / np.sqrt(3)
    assert found.interval(found.relative.half_width, signed=True) == pytest.approx((mean - half, mean + half))


@pytest.mark.parametrize(("mean", "low"), [(24.0, 0.0), (-0.5, -0.5)])
def test_intervals_of_positive_quantities_end_at_zero(mean, low):
    """The difference of two levels may give a negative mean, which stays in its interval."""
    found = estimate_quantity({}, {}, by_seed(mean + np.array([-40.0, 0.0, 40.0])))
    assert found.interval(found.relative.half_width)[0] == pytest.approx(low)
