"""Defects of a scan: outliers, offsets between scan lines, and curvature of the sample."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation, binary_erosion, label, mean, median_filter

from icha.support.formatting import format_count, length

# A point is an outlier if its height differs from the median of the 5 x 5 points around it by more than
# `_OF_NEIGHBOURS` times the usual difference, and by more than `_OF_HEIGHTS` times the usual height.
_WINDOW, _OF_NEIGHBOURS, _OF_HEIGHTS = 5, 10.0, 4.0
# Blocks of points are compared as long as the scan has at least this number of blocks along each side. The edge of a
# patch is steep if a step within `_EDGE` points exceeds `_OF_NEIGHBOURS` times the usual step.
_FEWEST_BLOCKS, _EDGE = 8, 3
# Largest fraction of points that can be replaced. Up to this fraction of single outliers, the error of the rms slope is
# below 1 % on a surface with 8 points per shortest wave.
MOST_OUTLIERS = 0.2
# Largest fraction of points at exactly one height that is not conspicuous, and largest number of rows and columns in
# which such a height is sought.
_MOST_REPEATED, _MOST_EXAMINED = 2e-3, 1000
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

    @property
    def description_of_outliers(self) -> str:
        """Number and size of the outliers; an empty text without outliers."""
        size = f"the largest {self.largest:.3g} rms heights from the points around"
        return f"{format_count(self.outliers, 'outlier')}, {size}" if self.outliers else ""


def find_outliers(heights: np.ndarray) -> tuple[np.ndarray, float]:
    """Find the outliers of a scan: points, and patches with a steep edge, far from the heights around them.

    A point is compared with the median of 5 x 5 points, and with the medians of 5 x 5 blocks of 2, 4, 8, ... points a
    side. The blocks find patches that are wider than four points, such as dust. Return the mask of the outliers, and
    the largest deviation of an outlier divided by the robust rms height.
    """
    known = np.isfinite(heights)
    # Medians, because one outlier may exceed all other heights by the rounding error of a float.
    slope_y, slope_x = (np.nan_to_num(np.nanmedian(np.diff(heights, axis=axis))) for axis in (0, 1))
    rows, columns = heights.shape
    level = heights - slope_y * np.arange(rows)[:, None] - slope_x * np.arange(columns)
    level = np.where(known, level, np.nanmedian(level[known]))
    medians = [median_filter(level, _WINDOW, mode="reflect")]
    plain = known & ~_is_unusual(np.abs(level - medians[0]), known)
    # Single outliers must not disturb the medians of blocks.
    blocks = smoothed = np.where(plain, level, medians[0])
    while min(blocks.shape) >= 2 * _FEWEST_BLOCKS:
        blocks = np.pad(blocks, [(0, n % 2) for n in blocks.shape], mode="edge")
        blocks = np.median([blocks[i::2, j::2] for i in (0, 1) for j in (0, 1)], axis=0)
        medians.append(median_filter(blocks, _WINDOW, mode="reflect"))
        plain &= ~_is_unusual(_deviation(smoothed, medians, len(medians) - 1), known)
    # From percentiles, because the median deviation of a surface with two plateaus may be nearly zero; of medians,
    # because more than 5 % of the points may be outliers.
    usual = float(np.diff(np.percentile(without_trend(medians[0], 1, plain)[known], (5, 95)))[0]) / _NORMAL_RANGE
    outliers, largest = np.zeros(heights.shape, bool), 0.0
    for k in range(len(medians)):
        deviation = _deviation(smoothed if k else level, medians, k)
        found = known & (deviation > _OF_HEIGHTS * usual) & _is_unusual(deviation, known)
        if k and found.any():
            found = _with_steep_edge(found, smoothed, known & (deviation > 0.5 * _OF_HEIGHTS * usual))
        outliers |= found
        largest = max(largest, float(deviation.max(initial=0.0, where=found)))
    return outliers, largest / usual if usual else 0.0


def _deviation(level, medians, k):
    """Return the absolute differences between heights and the medians of the blocks of 2^k x 2^k points around them."""
    rows, columns = level.shape
    return np.abs(level - medians[k].repeat(2**k, axis=0).repeat(2**k, axis=1)[:rows, :columns])


def _is_unusual(deviation, known):
    """Return the mask of the deviations that exceed the usual deviation of the known points."""
    values = deviation[known]
    usual = _NORMAL * float(np.nanmedian(np.abs(values - np.nanmedian(values))))
    return deviation > _OF_NEIGHBOURS * usual


def _with_steep_edge(found, level, high):
    """Return the patches of a mask with unusual steps of height along most of their edge.

    The patches that are returned include the points beside their edges that are `high`.
    """
    steep = np.zeros(found.shape, bool)
    for axis in (0, 1):
        steps = np.diff(level, axis=axis)
        usual = float(np.diff(np.percentile(steps, (5, 95)))[0]) / _NORMAL_RANGE
        unusual = np.abs(steps) > _OF_NEIGHBOURS * usual
        steep |= np.insert(unusual, 0, False, axis) | np.insert(unusual, steps.shape[axis], False, axis)
    patches, count = label(found)
    edge = np.where(found & ~binary_erosion(found, border_value=1), patches, 0)
    share = mean(binary_dilation(steep, iterations=_EDGE), edge, np.arange(1, count + 1))
    kept = np.concatenate([[False], share > 0.5])[patches]
    return binary_dilation(kept, iterations=_EDGE, mask=high) if kept.any() else kept


def repeated_height(heights: np.ndarray) -> str:
    """Describe the height of more than 0.2 % of the points, if no other height is a tenth as frequent; "" without.

    Such a number usually marks missing points, or a scan that is saturated.
    """
    step = max(1, *(points // _MOST_EXAMINED for points in heights.shape))
    examined = heights[::step, ::step]
    values, counts = np.unique(examined[np.isfinite(examined)], return_counts=True)
    *others, most = np.sort(counts)[-2:].tolist() if len(counts) else [0]
    if most <= _MOST_REPEATED * examined.size or 10 * max(others, default=0) > most:
        return ""
    return f"{100 * most / examined.size:.2g} % of the points at exactly {length(values[np.argmax(counts)])}"


def line_offsets(level: np.ndarray) -> dict[str, float]:
    """Return the rms step between neighbouring lines, m, by direction of the lines, if the lines have offsets."""
    means = {"lines": fit_lines(level)[0], "columns": fit_lines(level.T)[0]}
    steps = {name: np.diff(each[np.isfinite(each)]) for name, each in means.items()}
    rms = {name: float(np.sqrt(np.mean(each**2))) for name, each in steps.items()}
    others = {"lines": "columns", "columns": "lines"}
    return {name: rms[name] for name, other in others.items() if _are_independent(steps[name], rms[other])}


def level_lines(heights: np.ndarray) -> tuple[np.ndarray, bool]:
    """Subtract from each row its mean height and, if the tilts of the rows have steps, its tilt.

    Return the heights, and whether tilts were subtracted. The mean heights that rows have without offsets are lost too.
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


def without_trend(heights: np.ndarray, degree: int, fitted: np.ndarray | bool = True) -> np.ndarray:
    """Return heights without the polynomial of x and y of some degree that fits the known heights best.

    fitted : mask of the points that count for the fit.
    """
    known = np.isfinite(heights) & fitted
    rows, columns = heights.shape
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    y, x = (np.vander(np.linspace(-1, 1, n), 2 * degree + 1, increasing=True) for n in (rows, columns))
    # Sum the products of powers over the known points by matrix products, which need little memory.
    moments = y.T @ known.astype(float) @ x
    weighted = y.T @ np.where(known, heights, 0.0) @ x
    matrix = np.array([[moments[i + k, j + m] for k, m in powers] for i, j in powers])
    right = np.array([weighted[i, j] for i, j in powers])
    coefficients = np.zeros((degree + 1, degree + 1))
    coefficients[tuple(np.transpose(powers))] = np.linalg.lstsq(matrix, right, rcond=None)[0]
    return heights - y[:, : degree + 1] @ coefficients @ x[:, : degree + 1].T
