"""Sums over cells nearby, tile by tile, against sums one by one; and what they do to the equations of contact."""

import numpy as np
import pytest

from icha.boundary_elements import kernel, nearby
from icha.boundary_elements.elasticity import solve_bonds
from icha.boundary_elements.kernel import HalfSpace
from icha.boundary_elements.nearby import REACH, TILE, Tiles, modes_nearby


def patches(grid, rng, count):
    """Cells of squares at random, some of them across the edges of the grid."""
    inside = np.zeros((grid, grid), dtype=bool)
    for row, column, side in zip(*rng.integers(0, grid, (2, count)), rng.integers(1, 40, count), strict=True):
        inside[np.ix_((row + np.arange(side)) % grid, (column + np.arange(side)) % grid)] = True
    return np.flatnonzero(inside)


@pytest.mark.parametrize("grid", [700, 768, 1001])
def test_sums_nearby_are_those_of_cells_one_by_one(grid):
    rng = np.random.default_rng(grid)
    way = np.fft.fftfreq(TILE) * TILE
    whole = np.exp(-np.hypot(way[:, None], way) / 5)
    cells = patches(grid, rng, 6)
    values = rng.normal(size=len(cells)).astype(np.float32)
    tiles = Tiles.of(cells, grid)
    assert 1 < tiles.count and len(tiles.which) > len(cells)
    found = tiles.sums(values, modes_nearby(whole))

    cut = np.fft.irfft2(modes_nearby(whole), s=(TILE, TILE))
    assert np.abs(cut[REACH:-REACH]).max() < 1e-7
    row, column = np.divmod(cells, grid)
    for at in rng.choice(len(cells), 200, replace=False):
        down, right = ((along - along[at] + grid // 2) % grid - grid // 2 for along in (row, column))
        near = np.maximum(np.abs(down), np.abs(right)) < REACH
        assert found[at] == pytest.approx(float(np.sum(cut[down[near], right[near]] * values[near])), abs=1e-5)


def test_where_cells_are_everywhere_there_are_no_tiles():
    assert Tiles.of(np.arange(0, 700**2, 97), 700) is None


def test_pressures_are_the_same_with_an_inverse_of_short_reach(monkeypatch):
    grid, rng = 800, np.random.default_rng(3)
    space, cells = HalfSpace.of(grid), patches(800, rng, 6)
    wanted = rng.normal(size=len(cells))
    results, used = [], []
    of = Tiles.of
    monkeypatch.setattr(kernel.Tiles, "of", lambda *given: used.append(of(*given)) or used[-1])
    for part in (nearby._PART, 0.0):
        monkeypatch.setattr(nearby, "_PART", part)
        results.append(solve_bonds(space, cells, np.full(len(cells), 0.5), wanted, np.zeros(len(cells)), 1e-9)[0])
    assert used[0] is not None and used[1] is None
    np.testing.assert_allclose(results[0], results[1], rtol=0, atol=1e-7)
