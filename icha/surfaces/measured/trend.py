"""The mean plane or paraboloid of a scan, removed."""

from dataclasses import replace

import numpy as np

from icha.surfaces.measured.scan import Scan
from icha.surfaces.measured.settings import Preparation, UnfitTopography

# Heights that differ by less than this part of the largest one, once their trend is removed, are rounding.
_FLAT = 1e-13


def detrended(scan: Scan, how: Preparation) -> tuple[Scan, list[str]]:
    """Without the plane or paraboloid that fits the known heights best."""
    known = np.isfinite(scan.heights)
    if not known.any():
        raise UnfitTopography("path", "holds no height at all in the part that is used; allowed: another part or file")
    degree = {"none": 0, "tilt": 1, "curvature": 2}[how.detrend]
    if degree == 0:
        return scan, []
    rows, columns = scan.heights.shape
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    y, x = (np.vander(np.linspace(-1, 1, n), 2 * degree + 1, increasing=True) for n in (rows, columns))
    # Sums over the known points of all products of powers, without a table of all points.
    moments = y.T @ known.astype(float) @ x
    weighted = y.T @ np.where(known, scan.heights, 0.0) @ x
    matrix = np.array([[moments[i + k, j + m] for k, m in powers] for i, j in powers])
    right = np.array([weighted[i, j] for i, j in powers])
    coefficients = np.zeros((degree + 1, degree + 1))
    coefficients[tuple(np.transpose(powers))] = np.linalg.lstsq(matrix, right, rcond=None)[0]
    trend = y[:, : degree + 1] @ coefficients @ x[:, : degree + 1].T
    return replace(scan, heights=scan.heights - trend), [f"{how.detrend} removed"]


def refuse_flat(left: Scan, part: Scan, how: Preparation) -> None:
    """Raise unless the heights that are left of a part of the scan are more than the rounding of those that it had."""
    if np.ptp(left.heights) <= _FLAT * np.nanmax(np.abs(part.heights), where=np.isfinite(part.heights), initial=0.0):
        without = "" if how.detrend == "none" else " but for the trend that is removed"
        raise UnfitTopography("path", f"holds heights that are all the same{without}; allowed: a rough surface")
