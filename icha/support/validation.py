"""Checks of single values, so that every wrong number is refused by name."""

from __future__ import annotations

import math
import numbers

import numpy as np


def number(name: str, value, unit: str = "1") -> float:
    """Return `value` as a float; raise ValueError naming it unless it is a finite real number."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ValueError(f"{name}: {value!r} is not a number (in {unit})")
    value = float(value)
    if not math.isfinite(value):
        raise ValueError(f"{name}: {value!r} is not finite (in {unit})")
    return value


def positive(name: str, value, unit: str = "1") -> float:
    """Return `value` as a float; raise ValueError naming it unless it is finite and greater than zero."""
    value = number(name, value, unit)
    if value <= 0:
        raise ValueError(f"{name}: {value!r} must be greater than 0 (in {unit})")
    return value


def not_negative(name: str, value, unit: str = "1") -> float:
    """Return `value` as a float; raise ValueError naming it unless it is finite and at least zero."""
    value = number(name, value, unit)
    if value < 0:
        raise ValueError(f"{name}: {value!r} must not be negative (in {unit})")
    return value


def integer(name: str, value, least: int) -> int:
    """Return `value` as an int; raise ValueError naming it unless it is an integer of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise ValueError(f"{name}: {value!r} is not an integer")
    if value < least:
        raise ValueError(f"{name}: {value!r} must be at least {least}")
    return int(value)


def flaw_of_heights(heights: np.ndarray) -> str | None:
    """What keeps an array of real numbers from being a height map: its shape, values that are not finite, flatness."""
    if heights.ndim != 2 or heights.shape[0] != heights.shape[1] or heights.shape[0] < 8:
        return f"an array of shape {heights.shape}, not a square of at least 8 x 8"
    bad = int(np.count_nonzero(~np.isfinite(heights)))
    if bad:
        return f"{bad} of {heights.size} heights that are not finite"
    if np.ptp(heights) == 0:
        return "heights that are all the same"
    return None
