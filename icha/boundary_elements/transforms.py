"""Fourier filter for large periodic fields, computed in blocks of rows and columns that fit in the cache."""

from __future__ import annotations

import threading

import numpy as np
import scipy.fft

from icha.support import parallel
from icha.support.parallel import blocks, on_cores

# Size of the cache in bytes: larger fields are filtered in blocks of rows of half this size. Columns in a block.
CACHE, _COLUMNS = 2_000_000, 32


def filter_by_blocks(
    grid: int,
    cells: np.ndarray,
    values: np.ndarray,
    factor: np.ndarray,
    at: np.ndarray | None = None,
    out: np.ndarray | None = None,
) -> np.ndarray:
    """Multiply the Fourier modes of a field by factors, and transform the product back.

    Parameters
    ----------
    grid : number n of cells along a side.
    cells : (k,) int, ascending, the cells where the field is not zero.
    values : (k,), values of the field at these cells; the result has the same precision.
    factor : (n, n//2 + 1), factor of each mode.
    at : (m,) int, ascending, the cells where the result is computed; None for the whole grid, (n, n).
    out : array in which the result is stored; None for a new array.
    """
    each = on_cores if grid >= parallel.LARGE_GRID else _one_by_one
    modes = reusable_field((grid, grid // 2 + 1), np.result_type(values.dtype, np.complex64))
    result = np.empty((grid, grid) if at is None else len(at), values.dtype) if out is None else out
    rows = blocks(grid, max(CACHE // (2 * grid * values.itemsize), 1))
    starts = grid * np.array([block.start for block in rows] + [grid])
    sources, targets = np.searchsorted(cells, starts), None if at is None else np.searchsorted(at, starts)

    def transform_rows(block):
        inside = slice(sources[block], sources[block + 1])
        if inside.start == inside.stop:
            modes[rows[block]] = 0
            return
        field = np.zeros((rows[block].stop - rows[block].start, grid), values.dtype)
        field.ravel()[cells[inside] - starts[block]] = values[inside]
        modes[rows[block]] = scipy.fft.rfft(field, axis=1, overwrite_x=True, workers=1)

    def filter_columns(columns):
        block = scipy.fft.fft(modes[:, columns], axis=0, workers=1)
        block *= factor[:, columns]
        modes[:, columns] = scipy.fft.ifft(block, axis=0, overwrite_x=True, workers=1)

    def transform_back(block):
        if targets is None:
            result[rows[block]] = scipy.fft.irfft(modes[rows[block]], n=grid, axis=1, workers=1)
        elif targets[block] < targets[block + 1]:
            inside = slice(targets[block], targets[block + 1])
            field = scipy.fft.irfft(modes[rows[block]], n=grid, axis=1, workers=1)
            result[inside] = field.ravel()[at[inside] - starts[block]]

    each(transform_rows, range(len(rows)))
    each(filter_columns, blocks(modes.shape[1], _COLUMNS))
    each(transform_back, range(len(rows)))
    return result


_fields = threading.local()


def reusable_field(shape: tuple[int, int], dtype: np.dtype) -> np.ndarray:
    """Return the array that this thread reuses for a shape and type; it has zeros at first use, old values later."""
    fields: dict = vars(_fields)
    if (shape, dtype) not in fields:
        fields[shape, dtype] = np.zeros(shape, dtype)
    return fields[shape, dtype]


def _one_by_one(function, items):
    """Call a function with each item in turn, and ignore the results; used for small grids instead of `on_cores`."""
    for item in items:
        function(item)
