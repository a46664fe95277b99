"""Means over an ensemble of surfaces with the same statistics, and confidence intervals of the means."""

from typing import NamedTuple

import numpy as np

# Probability that the confidence interval contains the mean of infinitely many surfaces.
CONFIDENCE = 0.95
# Figures show means if an ensemble has at least this number of members. With fewer members, the confidence interval is
# wider than the scatter of the members, so figures show every member.
ENOUGH = 5


class Ensemble(NamedTuple):
    """Statistics over the members of an ensemble. All arrays have the same shape; NaN means too few members.

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
        """Return the bounds of the confidence interval: m ± c, or m exp(± c/m) for a `positive` quantity of mean m.

        The bounds m exp(± c/m) are positive, and tend to m ± c for small c/m. They come from the interval ln(m) ± c/m,
        because the standard error of ln(m) is that of m, divided by m, to first order (delta method). If m is not
        positive, the function returns m ± c.
        """
        above = (self.mean > 0) & positive
        factor = np.exp(np.divide(self.confidence, self.mean, out=np.zeros_like(self.mean), where=above))
        low = np.where(above, self.mean / factor, self.mean - self.confidence)
        return low, np.where(above, self.mean * factor, self.mean + self.confidence)


def ensemble(samples, axis: int = 0) -> Ensemble:
    """Compute mean, deviation and confidence interval over an axis, for normally distributed members.

    Parameters
    ----------
    samples : values of the members along `axis`; NaN where a member has no value.

    Notes
    -----
    The confidence interval of n members with standard deviation s is mean ± t s/√n. Here t is the 97.5 % quantile of
    Student's distribution with n - 1 degrees of freedom (Student, Biometrika 6 (1908) 1).
    """
    from scipy.special import stdtrit  # imported here because it loads slowly

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
