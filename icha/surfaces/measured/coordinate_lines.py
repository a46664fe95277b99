"""Detect rows and columns of a table that contain coordinates or numbers of points instead of heights.

Along a row or column of heights of a rough surface, the heights do not rise in equal steps. If they do so in all rows,
the surface is a plane.
"""

import numpy as np

from icha.surfaces.measured.settings import UnfitTopography

# Largest difference of two steps that count as equal, as a fraction of a step, if digits do not limit it.
_EQUAL_STEPS = 1e-2
# Smallest range of coordinates in units of their last digit.
_FEWEST_UNITS = 4
# Limits with which a first line of heights resembles the second and the third line. The first and second line differ by
# at most `_DIFFERENCE` times the difference of second and third. Besides, the fraction `_SAME_SIGN` of the steps in the
# first and second line has the same sign, or second and third differ by at most `_SMOOTH` times their heights.
_DIFFERENCE, _SAME_SIGN, _SMOOTH = 3, 0.8, 0.2
# Fewest numbers of a line that can be coordinates.
_FEWEST_COORDINATES = 8


def drop_coordinates(values: np.ndarray) -> tuple[np.ndarray, tuple[float, float] | None, str]:
    """Remove a first row and a first column that contain coordinates or numbers of points.

    Returns
    -------
    heights, steps of the coordinates along x and y (None unless both are given), and a remark on what was removed.

    Raises
    ------
    UnfitTopography
        If the first row or column seems to contain coordinates in unequal steps, or the last one in equal steps.
    """
    heights, steps = values, {}
    for name in ("row", "column"):
        table = heights if name == "row" else heights.T
        step = _coordinate_step(table)
        if step is None:
            continue
        if np.isnan(step):
            raise UnfitTopography(
                "path",
                f"has a first {name} whose numbers rise or fall in unequal steps, as coordinates do; "
                f"expected heights in equal distances. Remove the {name}, or interpolate the heights; if these numbers "
                "are heights, give all of them as .npy",
            )
        steps[name] = step
        heights = table[1:] if name == "row" else table[1:].T
    for name, table in (("row", heights[::-1]), ("column", heights.T[::-1])):
        step = _coordinate_step(table)
        if step is not None and not np.isnan(step):
            raise UnfitTopography(
                "path",
                f"has numbers in equal steps in its last {name}; expected heights. Remove the {name}",
            )
    remark = f"first {' and '.join(steps)} left out: numbers in equal steps, not heights" if steps else ""
    return heights, (steps["row"], steps["column"]) if len(steps) == 2 else None, remark


def _coordinate_step(table):
    """Return the step of coordinates in the first line of a table: nan if it varies, None if the line has heights."""
    line, others = table[0], table[1:3]
    if len(table) < 3 or len(line) < _FEWEST_COORDINATES or any(_equal_step(each) is not None for each in others):
        return None
    step = _equal_step(line, rounded=False)
    if step is None and not _resembles(line[1:], others[:, 1:]):
        step = _equal_step(line)
        differences = np.diff(line[1:])
        if step is None and (np.all(differences > 0) or np.all(differences < 0)):
            step = np.nan
    return None if step is None else abs(step)


def _resembles(line, others):
    """Return whether the heights in a line resemble those of the next two lines."""
    known = np.isfinite(line) & np.all(np.isfinite(others), axis=0)
    if np.count_nonzero(known) < 3:
        return False
    line, others = line[known], others[:, known]
    same = np.mean(np.sign(np.diff(line)) == np.sign(np.diff(others[0])))
    usual = np.std(others[0] - others[1])
    smooth = usual <= _SMOOTH * np.std(others[0])
    return (same >= _SAME_SIGN or smooth) and np.std(line - others[0]) <= _DIFFERENCE * usual


def _equal_step(line: np.ndarray, *, rounded: bool = True) -> float | None:
    """Return the step from number to number in a line; None if the steps are not equal. The first number may be any.

    rounded : whether steps may differ because the file has few digits.
    """
    for numbers in (line, line[1:]):
        steps = np.diff(numbers)
        if not len(steps) or not np.all(np.isfinite(steps)):
            continue
        mean = float(numbers[-1] - numbers[0]) / len(steps)
        if mean and np.ptp(steps) <= _EQUAL_STEPS * abs(mean):
            return mean
        if not rounded:
            continue
        # Rounding shifts every number by up to half a unit of the last digit.
        unit = _last_digit(numbers)
        error = np.max(np.abs(numbers - numbers[0] - mean * np.arange(len(numbers))))
        if np.all(steps * mean >= 0) and error <= 1.001 * unit and np.ptp(numbers) >= _FEWEST_UNITS * unit:
            return mean
    return None


def _last_digit(numbers):
    """Return the unit of the last digit with which the largest number was probably written."""
    largest = np.max(np.abs(numbers))
    digits = max(len(f"{abs(number):.14e}".partition("e")[0].replace(".", "").rstrip("0")) for number in numbers)
    return 10.0 ** (np.floor(np.log10(largest)) + 1 - digits) if largest else 0.0
