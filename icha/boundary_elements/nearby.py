"""The half-space for cells in contact, nearly: by tiles what is near, on a coarse grid what is far.

The kernel of the half-space is split as in `icha.half_space.ewald`: 2/q = (2/q) erf(q/2a) + (2/q) erfc(q/2a). The first
part has a short reach, and is summed tile by tile. The second is smooth, and goes over a grid that is coarser by a
factor, with splines there and back (R. W. Hockney & J. W. Eastwood, Computer Simulation Using Particles, 1988, ch. 8).
The inverse has a short reach altogether. Tiles are few where there is little contact, and no transform is that of the
whole grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.fft
from scipy.interpolate import BSpline
from scipy.special import erf, erfc

from icha.boundary_elements.transforms import filtered, kept
from icha.support import parallel
from icha.support.parallel import blocks, on_cores

# Cells a side of a tile, and around its own cells those that reach into it. So far, less than, does a kernel.
TILE, REACH = 128, 16
# The coarse grid's cells in those of the grid, and the order of its splines: as far as REACH, at most.
COARSER, _ORDER = 4, 4
_NODES = TILE // COARSER
# What splits the kernel, per cell: at this, both what is cut off and what the coarse grid misses are small.
_ALPHA = 2.3 / REACH
# All tiles together, over the whole grid: more are no short way; on large grids, whose own transforms leave the cache.
_PART, _LARGE_PART = 0.6, 1.2
# So many tiles are transformed at a time, in the cache.
_TOGETHER = 8


@dataclass(frozen=True, eq=False)
class Tiles:
    """Cells of a periodic grid, (k,), rising, by the square tiles in which they lie.

    count: of tiles. reaching: cells that reach into the tiles. own: those that each tile has for itself. nodes: of the
    coarse grid, counted through, that tiles cover, rising, (m,). covered: which of these every tile does, (count,
    _NODES, _NODES).
    """

    grid: int
    count: int
    reaching: _Placed
    own: _Placed
    nodes: np.ndarray
    covered: np.ndarray

    # Largest error of displacements, over the largest displacement.
    error = 1e-3

    @classmethod
    def of(cls, cells: np.ndarray, grid: int) -> Tiles | None:
        """The tiles of cells, counted through a grid of so many a side; None if these are no short way."""
        if grid % COARSER:
            return None
        many = -(-grid // (TILE - 2 * REACH))
        starts = COARSER * (np.arange(many + 1) * (grid // COARSER) // many)
        tile_of = np.searchsorted(starts, np.arange(grid), "right") - 1
        there = np.zeros((many, many), dtype=bool)
        there[tuple(tile_of[along] for along in np.divmod(cells, grid))] = True
        tiles = np.argwhere(there)
        part = _PART if grid < parallel.LARGE_GRID else _LARGE_PART
        if not 0 < len(tiles) * TILE**2 <= part * grid**2:
            return None
        corner, coarse = starts[tiles] - REACH, grid // COARSER
        reaching, own = _placed(cells, grid, corner, starts[tiles + 1] - starts[tiles])
        row, column = ((first[:, None] // COARSER + np.arange(_NODES)) % coarse for first in corner.T)
        covered = row[:, :, None] * coarse + column[:, None, :]
        number = np.zeros(coarse**2, int)
        number[covered] = 1
        nodes = np.flatnonzero(number)
        number[nodes] = np.arange(len(nodes))
        return cls(grid, len(tiles), reaching, own, nodes, number[covered])

    def sums(self, values: np.ndarray, modes: np.ndarray) -> np.ndarray:
        """At every cell, (k,), the sum of the values (k,) of those around it, times a kernel given by its modes.

        modes: of a tile, (TILE, TILE//2 + 1), in the precision of the values.
        """
        found = np.empty_like(values)
        self._add_near(modes, values, found)
        return found

    def inverse(self, displacement: np.ndarray) -> np.ndarray:
        """Pressures in E* that displace the cells about so, (k,), and nothing else: a preconditioner."""
        return self.sums(displacement, _inverse_modes())

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """What pressures in E* displace the cells, (k,), in cells, to an accuracy of `error`. Single precision."""
        near, far = _displacement_modes(self.grid)
        found, patches = np.empty_like(pressure), np.empty((self.count, _NODES, _NODES), np.float32)

        def spread(some):
            patches[some] = _spread(self.own.field(some, pressure))

        on_cores(spread, blocks(self.count, _TOGETHER))
        shares = np.bincount(self.covered.ravel(), patches.ravel()).astype(np.float32)
        smooth = filtered(self.grid // COARSER, self.nodes, shares, far, self.nodes)
        self._add_near(near, pressure, found, smooth[self.covered])
        return found

    def _add_near(self, modes, values, found, patches=None):
        """Sums over cells nearby, by the modes of a kernel, and what the coarse grid has in the tiles: to `found`."""

        def summed(some):
            field = scipy.fft.rfft2(self.reaching.field(some, values), workers=1)
            field *= modes
            field = scipy.fft.irfft2(field, s=(TILE, TILE), overwrite_x=True, workers=1)
            if patches is not None:
                field += _interpolated(patches[some])
            which, place = self.own.of_tiles(some)
            found[which] = field.ravel()[place]

        on_cores(summed, blocks(self.count, _TOGETHER))


@dataclass(frozen=True, eq=False)
class _Placed:
    """Cells of a list by tiles, some tiles at a time: their numbers in the list, and their places in these tiles."""

    parts: tuple[tuple[np.ndarray, np.ndarray], ...]

    def of_tiles(self, some):
        """Cells of some tiles, by their numbers, and their places in these."""
        return self.parts[some.start // _TOGETHER]

    def field(self, some, values):
        """The values (k,) of cells in some tiles, (t, TILE, TILE)."""
        field = np.zeros((some.stop - some.start, TILE, TILE), values.dtype)
        which, place = self.of_tiles(some)
        field.ravel()[place] = values[which]
        return field


def _placed(cells, grid, corner, size):
    """Which cells, (k,), lie in the windows of tiles with these corners, (t, 2), and which are the tiles' own.

    size: how many rows and columns a tile has of its own, (t, 2).
    """
    number = kept((grid, grid), np.dtype(np.int32))  # zeros, and to be left so
    number.ravel()[cells] = np.arange(1, len(cells) + 1)

    def found(some):
        windows = np.stack([_window(number, *at) for at in corner[some].tolist()])
        own = np.zeros_like(windows)
        for whole, part, (rows, columns) in zip(windows, own, size[some].tolist(), strict=True):
            inner = slice(REACH, REACH + rows), slice(REACH, REACH + columns)
            part[inner] = whole[inner]
        return _numbered(windows), _numbered(own)

    try:
        reaching, own = zip(*on_cores(found, blocks(len(corner), _TOGETHER)), strict=True)
    finally:
        number.ravel()[cells] = 0
    return _Placed(reaching), _Placed(own)


def _window(field, row, column):
    """The window of a tile with its corner there, (TILE, TILE), of a periodic field."""
    grid, way = len(field), np.arange(TILE)
    if min(row, column) >= 0 and max(row, column) <= grid - TILE:
        return field[row : row + TILE, column : column + TILE]
    return field[np.ix_((row + way) % grid, (column + way) % grid)]


def _numbered(windows):
    """The cells that have numbers, from 1 on, in tiles (t, TILE, TILE), and their places there."""
    place = np.flatnonzero(windows)
    return windows.ravel()[place].astype(int) - 1, place


# A spline of the coarse grid, on the nodes of the grid around; and those of all coarse nodes of a tile, on its nodes.
_HALF = _ORDER * COARSER // 2
_SPLINE = BSpline.basis_element(np.arange(_ORDER + 1) - _ORDER / 2)(np.arange(-_HALF, _HALF) / COARSER)
_SPLINES = np.zeros((TILE + 2 * _HALF, _NODES), np.float32)
for _node in range(_NODES):
    _SPLINES[COARSER * _node : COARSER * _node + 2 * _HALF, _node] = _SPLINE
_SPLINES = _SPLINES[_HALF:-_HALF]


# In products of matrices so small that no library shares them out among threads, which might change bytes.
def _spread(field):
    """What is on the nodes of tiles, (t, TILE, TILE), by shares of coarse ones, (t, _NODES, _NODES)."""
    rows = (field.reshape(-1, _NODES, TILE) @ _SPLINES).reshape(-1, TILE, _NODES)
    return _SPLINES.T @ rows


def _interpolated(coarse):
    """The splines of coarse nodes, (t, _NODES, _NODES), on the nodes of tiles, (t, TILE, TILE)."""
    rows = _SPLINES @ coarse
    return (rows.reshape(-1, _NODES, _NODES) @ _SPLINES.T).reshape(-1, TILE, TILE)


@cache
def _inverse_modes():
    """Modes of the inverse of the kernel, q/2, cut off: it remains positive at every wave, by 0.03 at least."""
    way = scipy.fft.fftfreq(TILE) * TILE
    table = scipy.fft.irfft2(_wave_numbers(TILE) / 2)
    return scipy.fft.rfft2(np.where(np.hypot(way[:, None], way) <= REACH, table, 0.0)).real.astype(np.float32)


@cache
def _displacement_modes(grid):
    """Modes of the kernel's part nearby, of a tile, and of that far away, of the coarse grid with its splines."""
    many = 8 * TILE
    q = _wave_numbers(many)
    q[0, 0] = 1.0
    modes = 2 / q * erf(q / (2 * _ALPHA))
    modes[0, 0] = at_zero = 2 / (np.sqrt(np.pi) * _ALPHA)
    way = scipy.fft.fftfreq(TILE) * TILE
    table = scipy.fft.irfft2(modes)[np.ix_(way.astype(int), way.astype(int))]
    near = scipy.fft.rfft2(np.where(np.hypot(way[:, None], way) <= REACH, table, 0.0)).real.astype(np.float32)

    coarse = grid // COARSER
    q = _wave_numbers(coarse) / COARSER
    q[0, 0] = 1.0
    far = 2 / q * erfc(q / (2 * _ALPHA))
    far[0, 0] = -at_zero
    spline = np.zeros(grid)
    spline[np.arange(-_HALF, _HALF)] = _SPLINE
    # What splines make of a wave of the coarse grid, and of those that it cannot tell from it.
    waves = (scipy.fft.fft(spline).real ** 2).reshape(COARSER, coarse)
    nearest = np.rint(scipy.fft.fftfreq(coarse) * coarse).astype(int)
    of_wave = (scipy.fft.fft(spline).real ** 2)[nearest] / waves.sum(axis=0) ** 2 * COARSER
    return near, (far * np.outer(of_wave, of_wave[: coarse // 2 + 1])).astype(np.float32)


def _wave_numbers(grid):
    """Wave numbers q of a grid, (n, n//2 + 1), per cell."""
    return 2 * np.pi * np.hypot(scipy.fft.fftfreq(grid)[:, None], scipy.fft.rfftfreq(grid))
