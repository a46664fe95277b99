"""Results of checks: a value, the limit of the value, and its meaning."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

# Largest relative error of an identity between values of one dataset.
IDENTITY_LIMIT = 1e-8


@dataclass(frozen=True)
class Check:
    """Result of one check.

    Attributes
    ----------
    name : name of the check.
    value : value that was found; -1 if the found value is not finite.
    limit : largest value that passes.
    passed : whether the value is finite and at most the limit.
    description : meaning of the value.
    subject : name of the run.
    """

    name: str
    value: float
    limit: float
    passed: bool
    description: str
    subject: str = ""


class RunArrays(dict[str, np.ndarray]):
    """Arrays of a run by name. Checks of a small run are much faster with NumPy arrays than with xarray."""

    def __init__(self, values: Mapping[str, np.ndarray], sizes: Mapping[str, int], attrs: Mapping[str, str]):
        super().__init__(values)
        self.sizes, self.attrs = sizes, attrs


def compare_with_limit(name: str, value: float, limit: float, description: str, subject: str) -> Check:
    """Return the check that a value is finite and at most its limit."""
    value, limit = float(value), float(limit)
    finite = math.isfinite(value)
    return Check(name, value if finite else -1.0, limit, finite and value <= limit, description, subject)
