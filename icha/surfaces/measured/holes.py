"""Points of a scan without a height, filled by the solution of Laplace's equation."""

from dataclasses import replace

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from icha.support import in_words
from icha.surfaces.measured.scan import Scan
from icha.surfaces.measured.settings import Preparation, UnfitTopography
from icha.surfaces.surface import PERIODIC


def filled(scan: Scan, how: Preparation) -> tuple[Scan, list[str]]:
    """Without missing points."""
    missing = ~np.isfinite(scan.heights)
    count = int(np.count_nonzero(missing))
    if not count:
        return scan, []
    if how.missing == "refuse":
        raise UnfitTopography(
            "missing",
            f"stops at points without a height, and there are {count} among {missing.size}; allowed: fill, or a crop "
            "without them",
        )
    if 2 * count > missing.size:
        raise UnfitTopography("missing", f"would make up {count} of {missing.size} points; allowed: up to half of them")
    heights = scan.heights.copy()
    heights[missing] = _harmonic(heights, missing, periodic=how.boundary == PERIODIC)
    said = f"{count} missing points filled, {in_words.share(count, missing.size)} of the points"
    return replace(scan, heights=heights), [said]


def _harmonic(heights, missing, *, periodic):
    """Heights (count,) of the missing points, each the mean of those of its four neighbours; edges have fewer."""
    row, column = np.nonzero(missing)
    count = len(row)
    index = np.full(missing.shape, -1)
    index[missing] = np.arange(count)
    neighbours, right = np.zeros(count), np.zeros(count)
    pairs = []
    for down, across in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        y, x = row + down, column + across
        if periodic:
            y, x = y % missing.shape[0], x % missing.shape[1]
        there = np.flatnonzero((y >= 0) & (y < missing.shape[0]) & (x >= 0) & (x < missing.shape[1]))
        neighbours[there] += 1
        other = index[y[there], x[there]]
        known = there[other < 0]
        right[known] += heights[y[known], x[known]]
        pairs.append((there[other >= 0], other[other >= 0]))
    first, second = (np.concatenate(each) for each in zip(*pairs, strict=True))
    coupling = scipy.sparse.csc_matrix((np.full(len(first), -1.0), (first, second)), shape=(count, count))
    return scipy.sparse.linalg.spsolve(coupling + scipy.sparse.diags(neighbours, format="csc"), right)
