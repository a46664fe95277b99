"""Results of checks: a value, the limit of the value, and its meaning."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

# Largest relative error of an identity between values of one dataset.
IDENTITY_LIMIT = 1e-8

# Values of a run that are not valid if the run fails a check: all values, or only those of the hysteresis loss.
EVERYTHING, LOSS = "everything", "loss"


class Definition(NamedTuple):
    """Definition of a check.

    Attributes
    ----------
    description : meaning of the value of the check.
    invalidates : EVERYTHING or LOSS, the values of a run that fails the check that are not valid.
    """

    description: str
    invalidates: str = EVERYTHING


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
    invalidates : values of a failed run that are not valid, as in `Definition`.
    """

    name: str
    value: float
    limit: float
    passed: bool
    description: str
    subject: str = ""
    invalidates: str = EVERYTHING


class RunArrays(dict[str, np.ndarray]):
    """Arrays of a run by name. Checks of a small run are much faster with NumPy arrays than with xarray."""

    def __init__(self, values: Mapping[str, np.ndarray], sizes: Mapping[str, int], attrs: Mapping[str, str]):
        super().__init__(values)
        self.sizes, self.attrs = sizes, attrs


def compare_with_limit(
    name: str, value: float, limit: float, description: str, subject: str, invalidates: str = EVERYTHING
) -> Check:
    """Return the check that a value is finite and at most its limit."""
    value = float(value)
    finite = math.isfinite(value)
    passed = bool(finite and value <= limit)
    return Check(name, value if finite else -1.0, float(limit), passed, description, subject, invalidates)
