"""Distributions of parameters that are not known exactly, or that a study samples."""

import math
from typing import NamedTuple

import numpy as np

# Kinds of distributions, and the meaning of their two numbers.
KINDS = {
    "uniform": ("lower end", "upper end"),
    "loguniform": ("lower end", "upper end"),
    "normal": ("mean", "standard deviation"),
    "lognormal": ("median", "geometric standard deviation"),
}


class Distribution(NamedTuple):
    """Distribution of a parameter.

    Attributes
    ----------
    kind : one of `KINDS`.
    first, second : the two numbers of the kind, in the unit of the parameter; the geometric standard deviation of
        `lognormal` has no unit.
    """

    kind: str
    first: float
    second: float

    @property
    def is_normal(self) -> bool:
        """Whether the parameter or its logarithm has a normal distribution."""
        return self.kind in ("normal", "lognormal")

    @property
    def _ends(self) -> tuple[float, float]:
        """Centre and scale of a normal distribution, or both ends of a uniform distribution."""
        if self.kind.startswith("log"):
            return math.log(self.first), math.log(self.second)
        return self.first, self.second

    def quantile(self, probability: np.ndarray) -> np.ndarray:
        """Return the values of the parameter below which the distribution has the given probabilities."""
        from scipy.special import ndtri

        first, second = self._ends
        value = first + second * ndtri(probability) if self.is_normal else first + (second - first) * probability
        return np.exp(value) if self.kind.startswith("log") else value

    def standardise(self, value: np.ndarray) -> np.ndarray:
        """Convert values of the parameter to the standard normal distribution, or to the uniform one in [-1, 1]."""
        first, second = self._ends
        value = np.log(value) if self.kind.startswith("log") else np.asarray(value, float)
        return (value - first) / second if self.is_normal else (2 * value - first - second) / (second - first)
