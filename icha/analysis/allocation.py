"""Numbers of seeds of three levels that reach an accuracy at the least cost.

The variance of an estimate is the sum of a_l/n_l over the levels, with the number of seeds n_l of level l. At a cost
c_l of one seed, the least total cost has n_l proportional to sqrt(a_l/c_l) (M. B. Giles, Acta Numerica 24 (2015)
259-328, section 1.3). The constants a_l come from the intervals of a computed study.
"""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

# Variables with the number of seeds, by level. Seeds of a level are among those of the level before.
LEVELS = {"asperities": "asperity_seeds", "coarse": "coarse_seeds", "fine": "fine_seeds"}
# Fewest seeds of each level: the scatter of a level must be known, and the coefficient of the asperities fitted.
_LEAST = {"asperities": 5, "coarse": 5, "fine": 2}


def variances_per_seed(answers: xr.Dataset) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Return, for each level, the variance of every answer times the number of seeds; and the variance of the grid.

    Variances are squares of relative half-widths. A level without seeds is left out.
    """
    counts = {level: answers[name].values for level, name in LEVELS.items()}
    present = [level for level, count in counts.items() if count.any()]
    # The share of the scatter is that of the cheapest level. The next level corrects the model, unless both levels are
    # boundary elements; the fine level corrects the coarse grid.
    of_level = {"coarse": "model", "fine": "refinement" if "coarse" in present else "model"} | {present[0]: "seeds"}
    per_seed = {level: answers[f"share_{of_level[level]}"].values ** 2 * counts[level] for level in present}
    return per_seed, np.nan_to_num(answers["share_grid"].values) ** 2


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
    found = {}
    spent = sum(np.sqrt(variance * costs[level]) for level, variance in per_seed.items())
    for level, variance in per_seed.items():
        wanted = np.sqrt(variance / costs[level]) * spent / left
        found[level] = max(_LEAST[level], math.ceil(float(wanted.max()) * (1 - 1e-9)))
    # Each level contains the seeds of the next one.
    fewest = 0
    for level in reversed(found):
        found[level] = fewest = max(found[level], fewest)
    return found
