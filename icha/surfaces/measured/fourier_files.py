"""Text files with the waves of a Fourier series: qx qy Re Im in every line."""

import math

import numpy as np
import scipy.fft

from icha.support.input_files import require_room
from icha.support.rules import GRID
from icha.surfaces.measured.settings import FileContent, Preparation, UnfitTopography
from icha.surfaces.measured.text_tables import SourceFile

# The spectrum, its conjugate, their difference, the heights, and the masks of waves.
_BYTES_OF_NODE = 64
# Largest difference of conjugate amplitudes, relative to the largest amplitude.
_CONJUGATE = 1e-4


def read_fourier(file: SourceFile, settings: Preparation) -> FileContent:
    """Sum h = sum h_q exp(i q.r) over all waves; a wave without its opposite stands for both of them."""
    table = file.values
    if table.shape[1] != 4 or not np.all(np.isfinite(table)):
        raise _not_waves("expected four numbers in each line: qx qy Re Im")
    k = _wave_numbers(table[:, :2], settings)
    period = 2 * np.pi * np.max(np.abs(k)) / np.max(np.abs(table[:, :2]))
    modes = table[:, 2] + 1j * table[:, 3]
    if len(np.unique(k, axis=0)) < len(k):
        raise _not_waves("a wave vector is given twice; expected every wave vector once")
    highest = int(np.max(np.abs(k)))
    n = settings.grid or 2 ** math.ceil(math.log2(max(4 * highest, 8)))
    if 2 * highest >= n:
        raise UnfitTopography(
            "grid",
            f"is too coarse for waves {highest} times as short as the period; expected at least {2 * highest + 2}, "
            f"better {4 * highest} or more",
        )
    require_room(_BYTES_OF_NODE * n**2)
    spectrum, present = np.zeros((n, n), dtype=complex), np.zeros((n, n), dtype=bool)
    spectrum[k[:, 1], k[:, 0]] = modes
    present[k[:, 1], k[:, 0]] = True
    opposite = np.ix_(-np.arange(n) % n, -np.arange(n) % n)
    conjugate, opposite_present = np.conj(spectrum[opposite]), present[opposite]
    differences = np.abs(spectrum - conjugate)[present & opposite_present]
    if np.max(differences, initial=0.0) > _CONJUGATE * np.max(np.abs(modes)):
        raise _not_waves("the heights would be complex; expected conjugate amplitudes of opposite wave vectors")
    spectrum = np.where(opposite_present & ~present, conjugate, spectrum)
    heights = scipy.fft.ifft2(spectrum, norm="forward", workers=1).real
    return FileContent(heights, coordinates=(period, period))


def _not_waves(problem):
    return UnfitTopography("path", f"cannot be read as fourier: {problem}")


def _wave_numbers(q, settings):
    """Return the wave vectors (n, 2) as multiples of 2 pi over the period; integers are such multiples already."""
    largest = np.max(np.abs(q))
    if settings.size is not None and settings.size[0] != settings.size[1]:
        raise UnfitTopography("size", "has two sides that differ, for a Fourier series; expected one length")
    if np.all(q == np.rint(q)):
        if settings.size is None:
            raise UnfitTopography(
                "size",
                "is missing, and the wave vectors are integers, multiples of 2 pi/L; expected L, such as '0.1 mm'",
            )
        k = q
    else:
        unit = np.min(np.abs(q)[np.abs(q) > 1e-9 * largest])
        # The longest wave fixes the unit only to the digits that it is written with; the shortest is more accurate.
        k = np.rint(q * (np.max(np.abs(np.rint(q / unit))) / largest))
        if np.max(np.abs(q * (np.max(np.abs(k)) / largest) - k)) > 0.01:
            raise _not_waves("expected wave vectors that are multiples of the smallest one")
    if not 0 < np.max(np.abs(k)) <= GRID.most / 2:
        raise _not_waves(f"expected waves up to {GRID.most // 2} times as short as the period")
    return k.astype(int)
