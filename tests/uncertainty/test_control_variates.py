"""Estimates from three levels of nested seeds: exact cases, coverage of intervals, and the allocation of seeds."""

import itertools

import numpy as np
import pytest
import xarray as xr
from scipy.stats import t

from icha.uncertainty.allocation import allocate, variances_per_seed
from icha.uncertainty.control_variates import ORDER, PROBABILITY, estimate_mean, estimate_quantity, quantile


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


def test_intervals_contain_the_mean_as_often_as_they_promise():
    """Levels with the correlations that were measured at p* = 1e-2: 0.6 with asperities, 0.99 between the grids."""
    rng, inside, width, plain = np.random.default_rng(2), 0, [], []
    for _ in range(2000):
        shared = rng.normal(size=50)
        fine = 0.085 * shared
        coarse = fine + 0.05 + 0.01 * rng.normal(size=50)
        asperities = -0.1 + 0.08 * (0.6 * shared + 0.8 * rng.normal(size=50))
        found = estimate_mean(by_seed(asperities), by_seed(coarse[:4]), by_seed(fine[:2]))
        half = np.linalg.norm([found.scatter, found.model, found.refinement])
        inside += abs(found.mean) <= half
        width.append(half)
        plain.append(estimate_mean({}, {}, by_seed(fine[:2])).half_width)
    assert 0.85 <= inside / 2000 <= 0.97
    assert np.median(width) < 0.6 * np.median(plain)


@pytest.mark.parametrize(("mean", "low"), [(24.0, 0.0), (-0.5, -0.5), (-58.0, None)])
def test_intervals_are_symmetric_and_those_of_positive_quantities_end_at_zero(mean, low):
    """Forces may be tensile. The difference of two levels may give a negative mean, which stays in its interval."""
    found = estimate_quantity({}, {}, by_seed(mean + np.array([-40.0, 0.0, 40.0])))
    half = t.ppf(0.5 * (1 + PROBABILITY), 2) * 40 / np.sqrt(3)
    assert found.interval(found.relative.half_width, signed=True) == pytest.approx((mean - half, mean + half))
    assert low is None or found.interval(found.relative.half_width)[0] == pytest.approx(low)


COSTS = {"asperities": 0.2, "coarse": 1.0, "fine": 6.0}


def half_width(per_seed, counts):
    """Half-width of an interval with the degrees of freedom of Welch and Satterthwaite."""
    variances = [float(each) / count for each, count in zip(per_seed, counts, strict=True)]
    total = sum(variances)
    shares = sum(each**2 / (count - 1) for each, count in zip(variances, counts, strict=True))
    return quantile(total**2 / shares) * total**0.5


def test_no_cheaper_numbers_of_seeds_reach_the_accuracy():
    per_seed = {"asperities": np.array([0.01]), "coarse": np.array([0.002]), "fine": np.array([0.0004])}
    found = allocate(per_seed, np.array([0.0]), COSTS, 0.03)

    def reached(counts):
        return half_width([each[0] for each in per_seed.values()], counts) <= 0.03

    def cost(counts):
        return sum(COSTS[level] * count for level, count in zip(per_seed, counts, strict=True))

    assert reached(found.values())
    ranges = [range(2, 2 * count, step) for count, step in zip(found.values(), (4, 1, 1), strict=True)]
    best = min(cost(counts) for counts in itertools.product(*ranges) if reached(counts))
    assert cost(found.values()) <= 1.1 * best


def test_every_answer_reaches_the_accuracy_and_levels_are_nested():
    per_seed = {"asperities": np.array([1e-6, 2e-6]), "coarse": np.array([0.001, 0.02]), "fine": np.array([1e-5, 1e-4])}
    found = allocate(per_seed, np.array([1e-5, 0.0]), COSTS, 0.02)
    for answer, grid in enumerate([1e-5, 0.0]):
        width = half_width([each[answer] for each in per_seed.values()], found.values())
        assert width**2 + grid <= 0.02**2
    assert found["asperities"] >= found["coarse"] >= found["fine"] >= 2
    with pytest.raises(ValueError, match="the error of the grid is ± 3 %; expected a finer grid"):
        allocate({"fine": np.array([1e-4])}, np.array([9e-4]), COSTS, 0.02)


@pytest.mark.parametrize(
    ("counts", "levels"), [((20, 8, 3), ["asperities", "coarse", "fine"]), ((0, 8, 3), ["coarse", "fine"])]
)
def test_variances_belong_to_the_levels_that_have_seeds(counts, levels):
    values = {"share_seeds": 0.3, "share_model": 0.2, "share_refinement": 0.1, "share_grid": np.nan}
    values["degrees_of_freedom"] = 3.0
    values |= dict(zip(("asperity_seeds", "coarse_seeds", "fine_seeds"), counts, strict=True))
    answers = xr.Dataset({name: ("answer", [value]) for name, value in values.items()})
    per_seed, grid = variances_per_seed(answers)
    assert list(per_seed) == levels and grid.tolist() == [0.0]
    assert per_seed["fine"][0] == pytest.approx((0.1 / quantile(3.0)) ** 2 * 3)
    assert per_seed[levels[0]][0] == pytest.approx((0.3 / quantile(3.0)) ** 2 * (counts[0] or counts[1]))
