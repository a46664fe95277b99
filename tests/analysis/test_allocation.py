"""Allocation of seeds: the least cost, and the accuracy that it reaches."""

import itertools

import numpy as np
import pytest
import xarray as xr

from icha.analysis.allocation import allocate, variances_per_seed
from icha.analysis.control_variates import quantile

COSTS = {"asperities": 0.2, "coarse": 1.0, "fine": 6.0}


def half_width(per_seed, counts):
    """Half-width of an interval with the degrees of freedom of Welch and Satterthwaite."""
    variances = [float(each) / count for each, count in zip(per_seed, counts, strict=True)]
    total = sum(variances)
    shares = sum(each**2 / (count - 1) for each, count in zip(variances, counts, strict=True))
    return quantile(total**2 / shares) * total**0.5


def test_no_cheaper_numbers_of_seeds_reach_the_accuracy():
    per_seed = {"asperities": np.array([0.01]), "coarse": np.array([0.002]), "fine": np.array([0.0004])}
    found = allocate(per_seed, np.array([0.0]), COSTS, 0.02)

    def reached(counts):
        return half_width([each[0] for each in per_seed.values()], counts) <= 0.02

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


def test_an_accuracy_below_the_error_of_the_grid_is_refused():
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
