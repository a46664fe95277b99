"""Means over an ensemble of surfaces of the same statistics, and how well they are known."""

from typing import NamedTuple

import numpy as np

# The part of such bands that hold the mean of infinitely many surfaces.
CONFIDENCE = 0.95
# Of fewer members the band is wider than their scatter: they are better shown one by one.
ENOUGH = 5


class Ensemble(NamedTuple):
    """Statistics over the members of an ensemble, arrays of one shape; NaN where there are too few members for them.

    `mean` needs one member. `deviation`, the standard deviation of the members (Bessel's correction), and `confidence`,
    half the width of the 95 % band of the mean, need two. `count` is the number of members.
    """

    mean: np.ndarray
    deviation: np.ndarray
    confidence: np.ndarray
    count: np.ndarray

    def band(self, *, positive: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper end of the band of the mean m: m ± c, or of a `positive` quantity m exp(± c/m).

        The second is the interval of the logarithm of the mean, whose standard error is that of the mean over the mean
        to first order (delta method). It stays above zero, and is the first where c is small. Where a mean is not
        positive it is the first in any case.
        """
        above = (self.mean > 0) & positive
        factor = np.exp(np.divide(self.confidence, self.mean, out=np.zeros_like(self.mean), where=above))
        low = np.where(above, self.mean / factor, self.mean - self.confidence)
        return low, np.where(above, self.mean * factor, self.mean + self.confidence)


def ensemble(samples, axis: int = 0) -> Ensemble:
    """Mean over an axis and its confidence band by Student's t, which holds for normally distributed members.

    Parameters
    ----------
    samples : values of the members along `axis`; NaN where a member has none.

    Notes
    -----
    The band of n members of standard deviation s is mean ± t s/√n, where t is the quantile of Student's distribution of
    n - 1 degrees of freedom beyond which (1 - 0.95)/2 of it lies (Student, Biometrika 6 (1908) 1).
    """
    from scipy.special import stdtrit  # here, for figures' declarations need not wait for it

    samples = np.moveaxis(np.asarray(samples, float), axis, 0)
    known = np.isfinite(samples)
    count = known.sum(axis=0)
    some, several = np.maximum(count, 1), np.maximum(count, 2)
    mean = np.where(known, samples, 0.0).sum(axis=0) / some
    deviation = np.sqrt((np.where(known, samples - mean, 0.0) ** 2).sum(axis=0) / (several - 1))
    confidence = stdtrit(several - 1, 0.5 * (1 + CONFIDENCE)) * deviation / np.sqrt(several)
    return Ensemble(
        np.where(count > 0, mean, np.nan),
        np.where(count > 1, deviation, np.nan),
        np.where(count > 1, confidence, np.nan),
        count,
    )
