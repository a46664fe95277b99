"""Findings of checks: a value, its limit and what it is."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

# Largest relative error of an identity between values of one dataset.
IDENTITY_LIMIT = 1e-8

# Name, value, limit and description of what is checked.
Finding = tuple[str, float, float, str]


@dataclass(frozen=True)
class Check:
    """One finding: `passed` says whether `value` keeps to `limit`; `subject` is the run it belongs to."""

    name: str
    value: float
    limit: float
    passed: bool
    description: str
    subject: str = ""


@dataclass(frozen=True)
class RunArrays:
    """A run as bare arrays: of thousands of small runs, labels take many times as long as the checks."""

    values: dict[str, np.ndarray]
    sizes: dict[str, int]
    attrs: Mapping[str, str]

    def __contains__(self, name: str) -> bool:
        """Whether the run has a variable."""
        return name in self.values

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the values of a variable."""
        return self.values[name]


def not_finite(arrays):
    """Number of values that are not finite."""
    return sum(int(np.count_nonzero(~np.isfinite(values))) for values in arrays if values.dtype.kind in "fiu")


def at_most(name, value, limit, description, subject):
    """The finding that a value keeps to a limit, or does not."""
    # A value that is not a number keeps to no limit; it is reported as -1, which no error can be.
    value = float(value)
    finite = math.isfinite(value)
    return Check(name, value if finite else -1.0, float(limit), bool(finite and value <= limit), description, subject)
