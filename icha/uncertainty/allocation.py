"""Numbers of seeds of three levels that reach an accuracy at the least cost.

The variance of an estimate is the sum of a_l/n_l over the levels, with the number of seeds n_l of level l. At a cost
c_l of one seed, the least total cost has n_l proportional to sqrt(a_l/c_l) (M. B. Giles, Acta Numerica 24 (2015)
259-328, section 1.3). The constants a_l come from the intervals of a computed study.
"""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

from icha.uncertainty.control_variates import SEEDS, quantile, share_of_levels

# Fewest seeds of each level: the scatter of a level must be known, and the coefficient of the asperities fitted.
_LEAST = {"asperities": 5, "coarse": 5, "fine": 2}
# Largest number of iterations for numbers of seeds and quantiles that depend on each other.
_ITERATIONS = 20


def variances_per_seed(answers: xr.Dataset) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Return, for each level, the variance of every answer times the number of seeds; and the square of the grid error.

    Variances are those of means of logarithms. A level without seeds is left out.
    """
    counts = {level: answers[name].values for level, name in SEEDS.items()}
    shares = share_of_levels([level for level, count in counts.items() if count.any()])
    width = quantile(answers["degrees_of_freedom"].values)
    per_seed = {level: (answers[f"share_{name}"].values / width) ** 2 * counts[level] for level, name in shares.items()}
    return per_seed, np.nan_to_num(answers["share_grid"].values) ** 2


def half_width_of_seeds(answers: xr.Dataset) -> float:
    """Return the largest relative half-width of some answers without the share of sampled parameters.

    More seeds do not narrow this share.
    """
    shares = [answers[f"share_{name}"].values for name in ("seeds", "model", "refinement", "grid")]
    return float(np.sqrt(np.sum(np.square(np.nan_to_num(shares)), axis=0)).max())


def allocate(
    per_seed: Mapping[str, np.ndarray], grid: np.ndarray, costs: Mapping[str, float], accuracy: float
) -> dict[str, int]:
    """Return the number of seeds of each level for which every answer has at most a relative half-width `accuracy`.

    Parameters
    ----------
    per_seed, grid : variances from `variances_per_seed`.
    costs : seconds of one seed of each level.
    accuracy : relative half-width to reach.

    Raises
    ------
    ValueError
        If the error of the grid alone is larger.
    """
    left = accuracy**2 - grid
    if (left <= 0).any():
        raise ValueError(
            f"the error of the grid is ± {100 * math.sqrt(float(grid.max())):.2g} %; expected a finer grid, or a wider "
            "interval"
        )
    spent = sum(np.sqrt(variance * costs[level]) for level, variance in per_seed.items())
    width, counts = quantile(math.inf), {}
    for _ in range(_ITERATIONS):
        before = counts
        wanted = {level: np.sqrt(a / costs[level]) * spent * width**2 / left for level, a in per_seed.items()}
        counts = {level: max(_LEAST[level], math.ceil(float(n.max()) * (1 - 1e-9))) for level, n in wanted.items()}
        counts = nest(counts)
        if counts == before:
            break
        width = np.maximum(width, _width(per_seed, counts))
    return counts


def nest(counts: Mapping[str, int]) -> dict[str, int]:
    """Return numbers of seeds that are large enough for each level to contain the seeds of the next one."""
    nested, fewest = dict(counts), 0
    for level in reversed(nested):
        nested[level] = fewest = max(nested[level], fewest)
    return nested


def _width(per_seed, counts):
    """Return the quantile of the interval of each answer, with Welch and Satterthwaite's degrees of freedom."""
    variances = {level: a / counts[level] for level, a in per_seed.items()}
    shares = sum(variance**2 / (counts[level] - 1) for level, variance in variances.items())
    return quantile(sum(variances.values()) ** 2 / np.maximum(shares, np.finfo(float).tiny))
