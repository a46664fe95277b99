"""Periodic fields whose Fourier modes are multiplied by factors: transforms some rows or columns at a time."""

from __future__ import annotations

import threading

import numpy as np
import scipy.fft

from icha.support import parallel
from icha.support.parallel import blocks, on_cores

# Bytes of a field from which it pays to transform some rows or columns at a time, so many columns.
CACHE, _COLUMNS = 2_000_000, 32


def filtered(
    grid: int,
    cells: np.ndarray,
    values: np.ndarray,
    factor: np.ndarray,
    at: np.ndarray | None = None,
    out: np.ndarray | None = None,
) -> np.ndarray:
    """A field that has values (k,) on cells, rising, of a grid and is zero elsewhere, times factors (n, n//2 + 1).

    In the precision of the values; given at cells (m,), rising, or everywhere, in the place of `out` if there is one.
    Rows and columns are transformed while they are in the cache, and empty rows not at all.
    """
    each = on_cores if grid >= parallel.LARGE_GRID else _one_by_one
    modes = kept((grid, grid // 2 + 1), np.result_type(values.dtype, np.complex64))
    found = np.empty((grid, grid) if at is None else len(at), values.dtype) if out is None else out
    rows = blocks(grid, max(CACHE // (2 * grid * values.itemsize), 1))
    starts = grid * np.array([some.start for some in rows] + [grid])
    given, asked = np.searchsorted(cells, starts), None if at is None else np.searchsorted(at, starts)

    def along_rows(block):
        mine = slice(given[block], given[block + 1])
        if mine.start == mine.stop:
            modes[rows[block]] = 0
            return
        some = np.zeros((rows[block].stop - rows[block].start, grid), values.dtype)
        some.ravel()[cells[mine] - starts[block]] = values[mine]
        modes[rows[block]] = scipy.fft.rfft(some, axis=1, overwrite_x=True, workers=1)

    def along_columns(columns):
        some = scipy.fft.fft(modes[:, columns], axis=0, workers=1)
        some *= factor[:, columns]
        modes[:, columns] = scipy.fft.ifft(some, axis=0, overwrite_x=True, workers=1)

    def back_along_rows(block):
        if asked is None:
            found[rows[block]] = scipy.fft.irfft(modes[rows[block]], n=grid, axis=1, workers=1)
        elif asked[block] < asked[block + 1]:
            mine = slice(asked[block], asked[block + 1])
            some = scipy.fft.irfft(modes[rows[block]], n=grid, axis=1, workers=1)
            found[mine] = some.ravel()[at[mine] - starts[block]]

    each(along_rows, range(len(rows)))
    each(along_columns, blocks(modes.shape[1], _COLUMNS))
    each(back_along_rows, range(len(rows)))
    return found


def kept(shape: tuple[int, int], kind: np.dtype) -> np.ndarray:
    """A field that a thread keeps, zeros at first: new memory can take longer than what is done in it."""
    if (shape, kind) not in _kept.fields:
        _kept.fields[shape, kind] = np.zeros(shape, kind)
    return _kept.fields[shape, kind]


class _Kept(threading.local):
    """Fields by shape and kind, of every thread its own."""

    def __init__(self):
        """None yet, in a thread."""
        self.fields = {}


_kept = _Kept()


def _one_by_one(function, items):
    for item in items:
        function(item)
