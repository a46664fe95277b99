"""Displacements of cells in contact on large grids: tiles for short distances, a coarse grid for long distances.

The kernel 2/q is split as in `icha.half_space.ewald`. The term (2/q) erf(q/(2 alpha)), in real space erfc(alpha r)/(pi
r), has a short range and is summed tile by tile. The term (2/q) erfc(q/(2 alpha)) is smooth, and is computed on a
coarser grid; splines transfer values between both grids (R. W. Hockney & J. W. Eastwood, Computer Simulation Using
Particles, 1988, ch. 8). The inverse kernel also has a short range. So a small contact needs only few tiles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.fft
from scipy.interpolate import BSpline
from scipy.special import erf, erfc

from icha.boundary_elements.transforms import filter_by_blocks, reusable_field
from icha.support import parallel
from icha.support.parallel import blocks, on_cores

# Number of cells along a side of a tile. Range of the short kernel in cells; tiles have a margin of this width.
TILE, RANGE = 128, 16
# Spacing of the coarse grid in cells, and order of its splines. The support of a spline is at most RANGE.
COARSENING, _ORDER = 4, 4
_NODES = TILE // COARSENING
# Ewald parameter alpha, per cell size. With this value the cut-off part of the short kernel and the error of the coarse
# grid are both below `error`.
_ALPHA = 2.3 / RANGE
# If the total area of the tiles, divided by the area of the grid, is larger than this, the whole grid is faster. The
# second value is for grids whose transforms run on several cores.
_LARGEST_COVER, _LARGEST_COVER_LARGE = 0.6, 1.2
# Number of tiles that are transformed together; they fit in the cache.
_BATCH = 8


@dataclass(frozen=True, eq=False)
class TiledGrid:
    """Fast, approximate `Operator` of `half_space` for k cells of a periodic grid, by square tiles around the cells.

    Parameters
    ----------
    grid : number of cells along a side of the grid.
    count : number t of tiles.
    sources : cells inside each tile, including the margin.
    targets : cells inside each tile without its margin, so that each cell is in one tile; for results and coarse sums.
    nodes : (m,) int, nodes of the coarse grid inside the tiles, ascending.
    covered : (t, _NODES, _NODES) int, indices in `nodes` of the coarse nodes inside each tile.
    """

    grid: int
    count: int
    sources: _CellsByTile
    targets: _CellsByTile
    nodes: np.ndarray
    covered: np.ndarray

    error = 1e-3

    @classmethod
    def of(cls, cells: np.ndarray, grid: int) -> TiledGrid | None:
        """Return tiles of cells (k,), ascending; None without cells, if not faster, or if `grid` % COARSENING > 0."""
        if grid % COARSENING:
            return None
        many = -(-grid // (TILE - 2 * RANGE))
        starts = COARSENING * (np.arange(many + 1) * (grid // COARSENING) // many)
        tile_of = np.searchsorted(starts, np.arange(grid), "right") - 1
        occupied = np.zeros((many, many), dtype=bool)
        occupied[tuple(tile_of[along] for along in np.divmod(cells, grid))] = True
        tiles = np.argwhere(occupied)
        cover = _LARGEST_COVER if grid < parallel.LARGE_GRID else _LARGEST_COVER_LARGE
        if not 0 < len(tiles) * TILE**2 <= cover * grid**2:
            return None
        corner, coarse = starts[tiles] - RANGE, grid // COARSENING
        sources, targets = _cells_by_tile(cells, grid, corner, starts[tiles + 1] - starts[tiles])
        row, column = ((first[:, None] // COARSENING + np.arange(_NODES)) % coarse for first in corner.T)
        covered = row[:, :, None] * coarse + column[:, None, :]
        number = np.zeros(coarse**2, int)
        number[covered] = 1
        nodes = np.flatnonzero(number)
        number[nodes] = np.arange(len(nodes))
        return cls(grid, len(tiles), sources, targets, nodes, number[covered])

    def convolve_short(self, values: np.ndarray, modes: np.ndarray) -> np.ndarray:
        """Convolve values (k,) on the cells with a kernel of range RANGE; `modes` are its modes on a tile."""
        result = np.empty_like(values)
        self._convolve(modes, values, result)
        return result

    def approximate_inverse(self, displacement: np.ndarray) -> np.ndarray:
        """Return approximate pressures of the k cells for given displacements."""
        return self.convolve_short(displacement, _inverse_modes())

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """Return the displacements of the k cells under pressures on these cells, in single precision."""
        near, far = _displacement_modes(self.grid)
        result, shares = np.empty_like(pressure), np.empty((self.count, _NODES, _NODES), np.float32)

        def restrict(batch):
            shares[batch] = _restrict(self.targets.field(batch, pressure))

        on_cores(restrict, blocks(self.count, _BATCH))
        coarse = np.bincount(self.covered.ravel(), shares.ravel()).astype(np.float32)
        smooth = filter_by_blocks(self.grid // COARSENING, self.nodes, coarse, far, self.nodes)
        self._convolve(near, pressure, result, smooth[self.covered])
        return result

    def _convolve(self, modes, values, result, coarse=None):
        """Write to `result` the convolution of values with a short kernel, plus interpolated values of coarse nodes."""

        def convolve(batch):
            field = scipy.fft.rfft2(self.sources.field(batch, values), workers=1)
            field *= modes
            field = scipy.fft.irfft2(field, s=(TILE, TILE), overwrite_x=True, workers=1)
            if coarse is not None:
                field += _interpolate(coarse[batch])
            indices, positions = self.targets.of_batch(batch)
            result[indices] = field.ravel()[positions]

        on_cores(convolve, blocks(self.count, _BATCH))


@dataclass(frozen=True, eq=False)
class _CellsByTile:
    """For each batch of tiles: indices of its cells in the list of k cells, and their positions in the tiles."""

    batches: tuple[tuple[np.ndarray, np.ndarray], ...]

    def of_batch(self, batch):
        """Return list indices and flat positions of the cells in a batch: a slice from `blocks(count, _BATCH)`."""
        return self.batches[batch.start // _BATCH]

    def field(self, batch, values):
        """Return a batch of tiles, (t, TILE, TILE), filled with the values (k,) of its cells and zeros elsewhere."""
        field = np.zeros((batch.stop - batch.start, TILE, TILE), values.dtype)
        indices, positions = self.of_batch(batch)
        field.ravel()[positions] = values[indices]
        return field


def _cells_by_tile(cells, grid, corner, size):
    """Return the cells inside each tile including its margin, and the cells inside each tile without its margin.

    corner : (t, 2) int, first row and column of each tile. size : (t, 2) int, rows and columns without the margin.
    """
    number = reusable_field((grid, grid), np.dtype(np.int32))  # zeros before and after
    number.ravel()[cells] = np.arange(1, len(cells) + 1)

    def assign(batch):
        with_margin = np.stack([_window(number, *at) for at in corner[batch].tolist()])
        without = np.zeros_like(with_margin)
        for source, target, (rows, columns) in zip(with_margin, without, size[batch].tolist(), strict=True):
            inner = slice(RANGE, RANGE + rows), slice(RANGE, RANGE + columns)
            target[inner] = source[inner]
        return _indices_and_positions(with_margin), _indices_and_positions(without)

    try:
        sources, targets = zip(*on_cores(assign, blocks(len(corner), _BATCH)), strict=True)
    finally:
        number.ravel()[cells] = 0
    return _CellsByTile(sources), _CellsByTile(targets)


def _window(field, row, column):
    """Return the tile, (TILE, TILE), of a periodic field that starts at a given row and column."""
    grid, along = len(field), np.arange(TILE)
    if min(row, column) >= 0 and max(row, column) <= grid - TILE:
        return field[row : row + TILE, column : column + TILE]
    return field[np.ix_((row + along) % grid, (column + along) % grid)]


def _indices_and_positions(tiles):
    """Return list indices and flat positions of cells in `tiles`, (t, TILE, TILE): index + 1 at cells, 0 elsewhere."""
    positions = np.flatnonzero(tiles)
    return tiles.ravel()[positions].astype(int) - 1, positions


# Spline of one coarse node, evaluated on the cells around it; splines of all coarse nodes of a tile, on its cells.
_HALF = _ORDER * COARSENING // 2
_SPLINE = BSpline.basis_element(np.arange(_ORDER + 1) - _ORDER / 2)(np.arange(-_HALF, _HALF) / COARSENING)
_SPLINES = np.zeros((TILE + 2 * _HALF, _NODES), np.float32)
for _node in range(_NODES):
    _SPLINES[COARSENING * _node : COARSENING * _node + 2 * _HALF, _node] = _SPLINE
_SPLINES = _SPLINES[_HALF:-_HALF]


# Products on several threads could change rounding, but no library uses several threads for such small matrices.
def _restrict(field):
    """Distribute values of the cells of tiles to coarse nodes, (t, _NODES, _NODES): transpose of `_interpolate`."""
    rows = (field.reshape(-1, _NODES, TILE) @ _SPLINES).reshape(-1, TILE, _NODES)
    return _SPLINES.T @ rows


def _interpolate(coarse):
    """Interpolate values from the coarse nodes, (t, _NODES, _NODES), to the cells of tiles, (t, TILE, TILE)."""
    rows = _SPLINES @ coarse
    return (rows.reshape(-1, _NODES, _NODES) @ _SPLINES.T).reshape(-1, TILE, TILE)


@cache
def _inverse_modes():
    """Return the Fourier modes on a tile of the inverse kernel q/2, cut off at RANGE: positive, all above 0.03."""
    along = scipy.fft.fftfreq(TILE) * TILE
    table = scipy.fft.irfft2(_wave_numbers(TILE) / 2)
    return scipy.fft.rfft2(np.where(np.hypot(along[:, None], along) <= RANGE, table, 0.0)).real.astype(np.float32)


@cache
def _displacement_modes(grid):
    """Return the modes of the short kernel on a tile, and of the smooth kernel on the coarse grid of splines."""
    many = 8 * TILE
    q = _wave_numbers(many)
    q[0, 0] = 1.0
    modes = 2 / q * erf(q / (2 * _ALPHA))
    modes[0, 0] = at_zero = 2 / (np.sqrt(np.pi) * _ALPHA)
    along = scipy.fft.fftfreq(TILE) * TILE
    table = scipy.fft.irfft2(modes)[np.ix_(along.astype(int), along.astype(int))]
    near = scipy.fft.rfft2(np.where(np.hypot(along[:, None], along) <= RANGE, table, 0.0)).real.astype(np.float32)

    coarse = grid // COARSENING
    q = _wave_numbers(coarse) / COARSENING
    q[0, 0] = 1.0
    far = 2 / q * erfc(q / (2 * _ALPHA))
    far[0, 0] = -at_zero
    spline = np.zeros(grid)
    spline[np.arange(-_HALF, _HALF)] = _SPLINE
    # Correct for the splines' effect on each wave of the coarse grid and on its aliases.
    waves = (scipy.fft.fft(spline).real ** 2).reshape(COARSENING, coarse)
    nearest = np.rint(scipy.fft.fftfreq(coarse) * coarse).astype(int)
    of_wave = (scipy.fft.fft(spline).real ** 2)[nearest] / waves.sum(axis=0) ** 2 * COARSENING
    return near, (far * np.outer(of_wave, of_wave[: coarse // 2 + 1])).astype(np.float32)


def _wave_numbers(grid):
    """Return the wave number q of each Fourier mode of an n x n grid, (n, n//2 + 1), per cell size."""
    return 2 * np.pi * np.hypot(scipy.fft.fftfreq(grid)[:, None], scipy.fft.rfftfreq(grid))
