"""Means over an ensemble of surfaces of the same statistics, and their confidence intervals."""

from typing import NamedTuple

import numpy as np

# Probability that a confidence interval contains the mean of infinitely many surfaces.
CONFIDENCE = 0.95
# With fewer members the confidence interval is wider than their scatter, so figures show them one by one.
ENOUGH = 5


class Ensemble(NamedTuple):
    """Statistics over the members of an ensemble, arrays of one shape; NaN where there are too few members.

    Attributes
    ----------
    mean : mean of the members; needs one member.
    deviation : standard deviation of the members (with Bessel's correction); needs two members.
    confidence : half the width of the 95 % confidence interval of the mean; needs two members.
    count : number of members.
    """

    mean: np.ndarray
    deviation: np.ndarray
    confidence: np.ndarray
    count: np.ndarray

    def band(self, *, positive: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Return the confidence interval of the mean m: m ± c, or m exp(± c/m) for a `positive` quantity.

        The second interval is that of the logarithm of the mean. The standard error of the logarithm is, to first
        order, the standard error of the mean divided by the mean (delta method). The second interval stays above zero,
        and tends to the first one as c vanishes. If the mean is not positive, the first interval is used.
        """
        above = (self.mean > 0) & positive
        factor = np.exp(np.divide(self.confidence, self.mean, out=np.zeros_like(self.mean), where=above))
        low = np.where(above, self.mean / factor, self.mean - self.confidence)
        return low, np.where(above, self.mean * factor, self.mean + self.confidence)


def ensemble(samples, axis: int = 0) -> Ensemble:
    """Compute the mean over an axis and its confidence interval by Student's t, for normally distributed members.

    Parameters
    ----------
    samples : values of the members along `axis`; NaN where a member has none.

    Notes
    -----
    The interval of n members of standard deviation s is mean ± t s/√n, where t is the 97.5 % quantile of Student's
    distribution of n - 1 degrees of freedom (Student, Biometrika 6 (1908) 1).
    """
    from scipy.special import stdtrit  # imported here because declarations of figures do not need it

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
