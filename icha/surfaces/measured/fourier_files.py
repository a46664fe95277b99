"""Reader of Fourier series: qx qy Re Im in every line of a text."""

import math
from pathlib import Path

import numpy as np
import scipy.fft

from icha.support.input_files import require_room
from icha.support.rules import GRID
from icha.surfaces.measured.found import Found
from icha.surfaces.measured.settings import Preparation, UnfitTopography
from icha.surfaces.measured.text_tables import read_table

# The spectrum, its conjugate, their difference, the heights, and what is where.
_BYTES_OF_NODE = 64


def read_fourier(path: Path, how: Preparation) -> Found:
    """qx qy Re Im in every line: h = sum h_q exp(i q.r) over all q; opposite ones, if left out, are the conjugates."""
    table = read_table(path).values
    if table.shape[1] != 4:
        raise ValueError(f"{table.shape[1]} numbers in a line, not qx qy Re Im")
    k = _wave_numbers(table[:, :2], how)
    period = 2 * np.pi * np.max(np.abs(k)) / np.max(np.abs(table[:, :2]))
    modes = table[:, 2] + 1j * table[:, 3]
    if not np.all(np.isfinite(modes)):
        raise ValueError("some amplitudes are not finite")
    highest = int(np.max(np.abs(k)))
    n = how.grid or 2 ** math.ceil(math.log2(max(4 * highest, 8)))
    if 2 * highest >= n:
        raise UnfitTopography(
            "grid",
            f"is too coarse for waves {highest} times as short as the period; allowed: at "
            f"least {2 * highest + 2}, advisable: {4 * highest} or more",
        )
    require_room(_BYTES_OF_NODE * n**2)
    spectrum = np.zeros((n, n), dtype=complex)
    order = np.lexsort((k[:, 0], k[:, 1]))
    k, modes = k[order], modes[order]
    if np.any(np.all(np.diff(k, axis=0) == 0, axis=1)):
        raise ValueError("a wave vector is given twice")
    spectrum[k[:, 1], k[:, 0]] = modes
    present = np.zeros((n, n), dtype=bool)
    present[k[:, 1], k[:, 0]] = True
    opposite = -np.arange(n) % n
    alone = present & ~present[np.ix_(opposite, opposite)]
    conjugate = np.conj(spectrum[np.ix_(opposite, opposite)])
    both = present & ~alone
    if np.max(np.abs(spectrum - conjugate)[both], initial=0.0) > 1e-4 * np.max(np.abs(modes)):
        raise ValueError("opposite wave vectors have amplitudes that are not conjugate: the heights would be complex")
    spectrum[alone[np.ix_(opposite, opposite)]] = conjugate[alone[np.ix_(opposite, opposite)]]
    heights = scipy.fft.ifft2(spectrum, norm="forward", workers=1).real
    return Found(heights, coordinates=(period, period))


def _require_few(highest):
    """Refuse waves that no grid has."""
    if highest > GRID.most / 2:
        raise ValueError(f"waves {highest:g} times as short as the period, but a grid has at most {GRID.most} nodes")


def _wave_numbers(q, how):
    """Wave vectors (n, 2) as multiples of 2 pi over the period: as they are written if they are integers."""
    largest = np.max(np.abs(q))
    if not largest > 0 or not np.all(np.isfinite(q)):
        raise ValueError("no wave vectors, or some that are not finite")
    if how.size is not None and how.size[0] != how.size[1]:
        raise UnfitTopography("size", "has two sides that differ, for a Fourier series; allowed: one length")
    if np.all(q == np.rint(q)):
        _require_few(largest)
        if how.size is None:
            raise UnfitTopography(
                "size",
                "is missing, and the wave vectors are integers, multiples of 2 pi/L; allowed: L, such as '0.1 mm'",
            )
        return q.astype(int)
    unit = np.min(np.abs(q)[np.abs(q) > 1e-9 * largest])
    k = np.rint(q / unit)
    # The longest wave fixes the unit only to the digits that it is written with: the shortest one knows it better.
    k = np.rint(q * (np.max(np.abs(k)) / largest))
    if np.max(np.abs(q * (np.max(np.abs(k)) / largest) - k)) > 0.01:
        raise ValueError("the wave vectors are no multiples of the smallest one")
    _require_few(np.max(np.abs(k)))
    return k.astype(int)
