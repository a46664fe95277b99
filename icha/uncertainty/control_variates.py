"""Estimate a mean over random surfaces from three levels of nested seeds, with an interval.

The levels are, from cheap to accurate: asperities (A), boundary elements on half the grid (C, coarse), and boundary
elements on the grid (F, fine). Each level contains the seeds of the next level. The estimate is that of multilevel
control variates,

    E = mean_F(F - C) + mean_C(C - b A) + b mean_A(A),

where the index of a mean names the seeds of the mean. The coefficient b is that of the regression of C on A. The first
term corrects the error of the coarse grid, the second term corrects the error of the asperity model, and the third term
has the scatter of many seeds. Values are logarithms if the seeds scatter little, because the errors of the levels are
relative errors. If the seeds scatter much, or if some values are zero, values are the quantity itself: then the mean of
logarithms would differ from the mean.

Sources: M. B. Giles, Multilevel Monte Carlo methods, Acta Numerica 24 (2015) 259-328. B. Peherstorfer, K. Willcox &
M. Gunzburger, Optimal model management for multifidelity Monte Carlo estimation, SIAM J. Sci. Comput. 38 (2016)
A3163-A3194. The variance with a fitted coefficient is that of double sampling (W. G. Cochran, Sampling Techniques,
3rd ed., 1977, section 12.6).
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import t as students_t

# Probability that an interval contains the mean over infinitely many seeds on the fine grid.
PROBABILITY = 0.9
# The levels from cheap to accurate, in words, and the variables with their numbers of seeds.
LEVELS = {
    "asperities": "the asperity model",
    "coarse": "boundary elements on half the grid",
    "fine": "boundary elements",
}
SEEDS = {"asperities": "asperity_seeds", "coarse": "coarse_seeds", "fine": "fine_seeds"}
# Smallest number of coarse seeds for a fitted coefficient. With fewer seeds, the coefficient is 1.
ENOUGH_TO_FIT = 5
# Logarithms are averaged if their standard deviation over the seeds is at most this value. Then their mean differs from
# the logarithm of the mean by at most half its square, 3 %.
_MOST_SCATTER = 0.25
# Order of convergence of contact area and force of boundary elements (docs/short_range.md).
ORDER = 0.9


class Estimate(NamedTuple):
    """Mean of some values, and the half-widths of its interval by cause.

    Attributes
    ----------
    mean : mean.
    scatter : half-width because the seeds of the cheapest level are few.
    model : half-width because few seeds correct the error of the asperity model; 0 without asperities.
    refinement : half-width because few seeds correct the error of the coarse grid; 0 without coarse seeds.
    grid : error of the fine grid, from the difference of the two grids; NaN without coarse seeds.
    coefficient : coefficient b of the asperity model; 0 without asperities.
    freedom : degrees of freedom of the interval.
    """

    mean: float
    scatter: float
    model: float
    refinement: float
    grid: float
    coefficient: float
    freedom: float

    @property
    def half_width(self) -> float:
        """Half-width of the interval; an unknown error of the grid does not count."""
        return math.hypot(self.scatter, self.model, self.refinement, 0.0 if math.isnan(self.grid) else self.grid)


class QuantityEstimate(NamedTuple):
    """Mean of a quantity, with its interval.

    Attributes
    ----------
    value : mean; the geometric mean if `logarithmic`.
    relative : estimate of the mean, with half-widths relative to the absolute value.
    logarithmic : whether logarithms were averaged.
    """

    value: float
    relative: Estimate
    logarithmic: bool

    def interval(self, half_width: float, *, signed: bool = False) -> tuple[float, float]:
        """Return the lower and the upper end of the interval.

        Parameters
        ----------
        half_width : half-width of the interval, relative to the absolute value of the mean.
        signed : True if the quantity may be negative; otherwise the interval of a positive mean ends at zero.
        """
        if self.logarithmic:
            return self.value * math.exp(-half_width), self.value * math.exp(half_width)
        low, high = self.value - abs(self.value) * half_width, self.value + abs(self.value) * half_width
        return (low if signed else max(low, min(self.value, 0.0))), high


def estimate_quantity(
    asperities: Mapping[int, float], coarse: Mapping[int, float], fine: Mapping[int, float]
) -> QuantityEstimate | None:
    """Estimate the mean over seeds of a quantity on the fine grid; arguments are those of `estimate_mean`."""
    levels = asperities, coarse, fine
    first = np.array(list((asperities or coarse or fine).values()))
    every = [value for level in levels for value in level.values()]
    if every and min(every) > 0 and np.std(np.log(first), ddof=min(1, len(first) - 1)) <= _MOST_SCATTER:
        logarithms = ({seed: math.log(value) for seed, value in level.items()} for level in levels)
        found = estimate_mean(*logarithms)
        return found and QuantityEstimate(math.exp(found.mean), found, True)
    found = estimate_mean(*levels)
    if found is None:
        return None
    size = abs(found.mean) or 1.0
    widths = ("scatter", "model", "refinement", "grid")
    relative = found._replace(**{name: getattr(found, name) / size for name in widths})
    return QuantityEstimate(found.mean, relative, False)


class _Term(NamedTuple):
    """A term of the estimate: its mean, the variance of its mean, and the degrees of freedom of this variance."""

    mean: float
    variance: float
    freedom: int


def estimate_mean(
    asperities: Mapping[int, float], coarse: Mapping[int, float], fine: Mapping[int, float]
) -> Estimate | None:
    """Estimate the mean over seeds of a value on the fine grid.

    Parameters
    ----------
    asperities, coarse, fine : value of each seed, by seed; levels may be empty. Only seeds that the next
        cheaper level also has are used, unless that level is empty.

    Returns
    -------
    The estimate; None if the fine level has no seed, or if a term has only one seed, so that its variance is unknown.
    """
    if not fine:
        return None
    levels = [level for level in (asperities, coarse, fine) if level]
    seeds = [set(levels[0])]
    for level in levels[1:]:
        seeds.append(seeds[-1] & set(level))
    values = [np.array([level[seed] for seed in sorted(used)]) for level, used in zip(levels, seeds, strict=True)]
    if any(len(each) < 2 for each in values):
        return None
    coefficient, terms = 0.0, {"scatter": _mean_of(values[0])}
    for cheap, dear, used in zip(levels[:-1], levels[1:], seeds[1:], strict=True):
        below = np.array([cheap[seed] for seed in sorted(used)])
        above = np.array([dear[seed] for seed in sorted(used)])
        if cheap is asperities:
            every = terms["scatter"]
            terms["model"], coefficient = _regression(below, above, every.mean)
            terms["scatter"] = _Term(coefficient * every.mean, coefficient**2 * every.variance, every.freedom)
        else:
            terms["refinement"] = _mean_of(above - below)
    variance = sum(term.variance for term in terms.values())
    # Welch and Satterthwaite's degrees of freedom of a sum of estimated variances.
    shares = sum(term.variance**2 / term.freedom for term in terms.values())
    freedom = variance**2 / shares if shares else sum(term.freedom for term in terms.values())
    half = {name: float(quantile(freedom)) * math.sqrt(term.variance) for name, term in terms.items()}
    difference = [fine[seed] - coarse[seed] for seed in sorted(set(coarse) & set(fine))]
    return Estimate(
        sum(term.mean for term in terms.values()),
        half["scatter"],
        half.get("model", 0.0),
        half.get("refinement", 0.0),
        abs(float(np.mean(difference))) / (2**ORDER - 1) if difference else math.nan,
        coefficient,
        freedom,
    )


def share_of_levels(present: Sequence[str]) -> dict[str, str]:
    """Return which share of the half-width falls as each of the `present` levels has more seeds.

    The scatter of the seeds is that of the cheapest level. The next level corrects the model, unless both levels are
    boundary elements; the fine level corrects the coarse grid.
    """
    finest = "refinement" if "coarse" in present else "model"
    shares = {"coarse": "model", "fine": finest} | {present[0]: "seeds"}
    return {level: shares[level] for level in present}


def quantile(freedom):
    """Return the half-width of the interval of a mean, divided by the standard deviation of the mean."""
    return students_t.ppf(0.5 * (1 + PROBABILITY), freedom)


def _mean_of(values):
    """Return the mean of some values as a term."""
    return _Term(float(np.mean(values)), float(np.var(values, ddof=1) / len(values)), len(values) - 1)


def _regression(below, above, mean):
    """Return the term `above` - b `below`, and the coefficient b; `mean` is the mean of `below` over all its seeds."""
    count, spread = len(below), float(np.sum((below - below.mean()) ** 2))
    if count < ENOUGH_TO_FIT or spread == 0:
        return _mean_of(above - below), 1.0
    coefficient = float(np.sum((below - below.mean()) * (above - above.mean()))) / spread
    rest = above - coefficient * below
    variance = float(np.sum((rest - rest.mean()) ** 2)) / (count - 2)
    return _Term(
        float(rest.mean()), variance * (1 / count + (mean - below.mean()) ** 2 / spread), count - 2
    ), coefficient
