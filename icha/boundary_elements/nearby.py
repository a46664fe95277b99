"""Sums over cells nearby, tile by tile where there is contact: short kernels need no transform of the whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft

from icha.support.parallel import blocks, on_cores

# Cells a side of a tile, and around its own cells those that reach into it. So far, less than, does a kernel.
TILE, REACH = 128, 16
# All tiles together, over the whole grid: more are no short way. So many are transformed at a time, in the cache.
_PART, _TOGETHER = 0.5, 8


@dataclass(frozen=True, eq=False)
class Tiles:
    """Cells of a periodic grid, (k,), rising, by the square tiles in which they or their neighbours lie.

    count: of tiles. which: cells by their number in the list, (m,), for every tile into which they reach, and place:
    where there, counted through all tiles. own: place of every cell in its own tile, (k,).
    """

    count: int
    which: np.ndarray
    place: np.ndarray
    own: np.ndarray

    @classmethod
    def of(cls, cells: np.ndarray, grid: int) -> Tiles | None:
        """The tiles of cells, counted through a grid of so many a side; None if these are no short way."""
        many = -(-grid // (TILE - 2 * REACH))
        starts = np.arange(many) * grid // many
        position = np.divmod(cells, grid)
        down, across = (np.searchsorted(starts, along, "right") - 1 for along in position)
        tiles, own = np.unique(down * many + across, return_inverse=True)
        if len(tiles) * TILE**2 > _PART * grid**2:
            return None
        number = np.full(many**2, -1)
        number[tiles] = np.arange(len(tiles))

        def along(axis, tile, way):
            """Which tile lies so many farther, and where its window has the cells, if it has them."""
            turns, other = np.divmod(tile + way, many)
            return other, position[axis] - starts[other] - turns * grid + REACH

        rows, columns = ([along(axis, tile, way) for way in (-1, 0, 1)] for axis, tile in enumerate((down, across)))
        which, place = [], []
        for below, row in rows:
            for right, column in columns:
                into = number[below * many + right]
                there = np.flatnonzero((into >= 0) & (row >= 0) & (row < TILE) & (column >= 0) & (column < TILE))
                which.append(there)
                place.append((into[there] * TILE + row[there]) * TILE + column[there])
        own = (own * TILE + rows[1][1]) * TILE + columns[1][1]
        return cls(len(tiles), np.concatenate(which), np.concatenate(place), own)

    def sums(self, values: np.ndarray, modes: np.ndarray) -> np.ndarray:
        """At every cell, (k,), the sum of the values (k,) of those around it, times a kernel given by its `modes`."""
        field = np.zeros((self.count, TILE, TILE), values.dtype)
        field.ravel()[self.place] = values[self.which]

        def summed(some):
            field[some] = scipy.fft.irfft2(
                scipy.fft.rfft2(field[some], workers=1) * modes, s=(TILE, TILE), overwrite_x=True, workers=1
            )

        on_cores(summed, blocks(self.count, _TOGETHER))
        return field.ravel()[self.own]


def modes_nearby(kernel: np.ndarray) -> np.ndarray:
    """Modes, in single precision, of a kernel (TILE, TILE) that begins at [0, 0], is even, and is cut off smoothly."""
    way = scipy.fft.fftfreq(TILE) * TILE
    distance = np.minimum(np.hypot(way[:, None], way) / REACH, 1.0)
    # H. Wendland, Adv. Comput. Math. 4 (1995) 389: with it what is positive definite remains so.
    return scipy.fft.rfft2(kernel * (1 - distance) ** 4 * (1 + 4 * distance)).real.astype(np.float32)
