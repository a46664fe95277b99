"""Defects of a scan: outliers, offsets between scan lines, and curvature of the sample."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

# A point is an outlier if its height differs from the median of the 5 x 5 points around it by more than
# `_OF_NEIGHBOURS` times the usual difference, and by more than `_OF_HEIGHTS` times the usual height.
_WINDOW, _OF_NEIGHBOURS, _OF_HEIGHTS = 5, 10.0, 4.0
# Robust standard deviation of normal values, divided by their median absolute deviation.
_NORMAL = 1.4826
# Distance of the 5th and the 95th percentile of normal values, divided by their standard deviation.
_NORMAL_RANGE = 3.29
# Scan lines have offsets if the steps between lines exceed the steps across lines by this factor, and if neighbouring
# steps have at most this correlation. Independent offsets have -1/2; grooves and long waves have positive correlations.
_RATIO_OF_STEPS, _CORRELATION, _FEWEST_STEPS = 3.0, -0.25, 8


@dataclass(frozen=True)
class Defects:
    """Defects of a scan, before they are removed.

    Attributes
    ----------
    outliers : number of outliers.
    largest : largest deviation of an outlier from its neighbours, divided by the robust rms height; 0 without outliers.
    offsets : rms step between neighbouring scan lines, m, along x ("lines") or y ("columns"); empty if the steps are
        those of the surface.
    curvature : fraction of the variance, after removal of the tilt, that a paraboloid takes.
    """

    outliers: int
    largest: float
    offsets: dict[str, float]
    curvature: float


def robust_deviation(values: np.ndarray) -> float:
    """Return the robust standard deviation of the known values."""
    return _NORMAL * float(np.nanmedian(np.abs(values - np.nanmedian(values))))


def find_outliers(level: np.ndarray) -> tuple[np.ndarray, float]:
    """Find the outliers of a scan.

    Parameters
    ----------
    level : (ny, nx) array of heights without tilt, m; nan where missing.

    Returns
    -------
    Mask of the outliers, and the largest deviation of an outlier divided by the robust rms height.
    """
    known = np.isfinite(level)
    deviation = np.abs(level - median_filter(np.where(known, level, np.nanmedian(level)), _WINDOW, mode="reflect"))
    # From percentiles, because the median deviation of a surface with two plateaus may be nearly zero.
    usual = float(np.diff(np.percentile(level[known], (5, 95)))[0]) / _NORMAL_RANGE
    outliers = (deviation > _OF_NEIGHBOURS * robust_deviation(deviation[known])) & (deviation > _OF_HEIGHTS * usual)
    return outliers, float(deviation[outliers].max() / usual) if outliers.any() and usual else 0.0


def line_offsets(level: np.ndarray) -> dict[str, float]:
    """Return the rms step between neighbouring lines, m, by direction of the lines, if the lines have offsets."""
    means = {"lines": fit_lines(level)[0], "columns": fit_lines(level.T)[0]}
    steps = {name: np.diff(each[np.isfinite(each)]) for name, each in means.items()}
    rms = {name: float(np.sqrt(np.mean(each**2))) for name, each in steps.items()}
    others = {"lines": "columns", "columns": "lines"}
    return {name: rms[name] for name, other in others.items() if _are_independent(steps[name], rms[other])}


def level_lines(heights: np.ndarray) -> tuple[np.ndarray, bool]:
    """Subtract from each row its mean height and, if the tilts of the rows have steps, its tilt.

    Returns
    -------
    Heights, and whether tilts were subtracted. The mean heights that rows have without offsets are lost too.
    """
    means, tilts, x = fit_lines(heights)
    steps = np.diff(tilts[np.isfinite(tilts)])
    across = np.diff(fit_lines(heights.T)[1])
    tilted = _are_independent(steps, float(np.sqrt(np.nanmean(across**2))))
    trend = means[:, None] + (tilts[:, None] * x if tilted else 0.0)
    return heights - np.nan_to_num(trend), tilted


def fit_lines(heights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mean and tilt of each row of heights, nan without known heights, and the positions to which tilts apply.

    The positions x are those of the points of each row, relative to the mean position of the known points.
    """
    known = np.isfinite(heights)
    count = np.where(known.any(axis=1), known.sum(axis=1), np.nan)
    x = np.linspace(-1, 1, heights.shape[1])
    x = x - ((known * x).sum(axis=1) / count)[:, None]
    values = np.where(known, heights, 0.0)
    spread = np.where(known, x**2, 0.0).sum(axis=1)
    tilts = np.divide(
        (np.where(known, x, 0.0) * values).sum(axis=1), spread, out=np.full(len(x), np.nan), where=spread > 0
    )
    return values.sum(axis=1) / count, tilts, x


def _are_independent(steps: np.ndarray, usual: float) -> bool:
    """Return whether steps between lines are those of independent offsets, and larger than the `usual` step."""
    if len(steps) < _FEWEST_STEPS or not np.sqrt(np.mean(steps**2)) > _RATIO_OF_STEPS * usual:
        return False
    return bool(np.corrcoef(steps[1:], steps[:-1])[0, 1] <= _CORRELATION)
