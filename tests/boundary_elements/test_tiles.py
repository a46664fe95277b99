"""The half-space by tiles and a coarse grid, against sums one by one and the whole; and contacts that come of both."""

import numpy as np
import pytest

from icha import Material, SelfAffineSpectrum
from icha.boundary_elements import tiles as module
from icha.boundary_elements.contact import contact_of
from icha.boundary_elements.half_space import HalfSpace
from icha.boundary_elements.tiles import RANGE, TILE, TiledGrid
from icha.contact.model import PRESSURE
from icha.support import parallel


def patches(grid, rng, count):
    """Cells of squares at random, some of them across the edges of the grid."""
    inside = np.zeros((grid, grid), dtype=bool)
    for row, column, side in zip(*rng.integers(0, grid, (2, count)), rng.integers(1, 40, count), strict=True):
        inside[np.ix_((row + np.arange(side)) % grid, (column + np.arange(side)) % grid)] = True
    return np.flatnonzero(inside)


@pytest.mark.parametrize("grid", [700, 768, 1000])
def test_sums_nearby_are_those_of_cells_one_by_one(grid):
    rng = np.random.default_rng(grid)
    way = np.fft.fftfreq(TILE) * TILE
    kernel = np.exp(-np.hypot(way[:, None], way) / 5) * (np.hypot(way[:, None], way) < RANGE)
    cells = patches(grid, rng, 6)
    values = rng.normal(size=len(cells))
    tiles = TiledGrid.of(cells, grid)
    assert 1 < tiles.count and sum(len(which) for which, _ in tiles.sources.batches) > len(cells)
    found = tiles.convolve_short(values, np.fft.rfft2(kernel).real)

    row, column = np.divmod(cells, grid)
    for at in rng.choice(len(cells), 200, replace=False):
        down, right = ((along - along[at] + grid // 2) % grid - grid // 2 for along in (row, column))
        near = np.maximum(np.abs(down), np.abs(right)) < RANGE
        assert found[at] == pytest.approx(float(np.sum(kernel[down[near], right[near]] * values[near])), abs=1e-12)


@pytest.mark.parametrize("grid", [800, 1004])
@pytest.mark.parametrize("all_at_once", [False, True], ids=["at random", "all alike"])
def test_displacements_are_those_of_the_whole_to_the_error_that_is_told(grid, all_at_once):
    rng = np.random.default_rng(grid)
    cells = patches(grid, rng, 6)
    pressure = (np.ones(len(cells)) if all_at_once else rng.normal(size=len(cells))).astype(np.float32)
    tiles, exact = TiledGrid.of(cells, grid), HalfSpace.of(grid).displacement(cells, pressure, cells)
    assert np.abs(tiles.displacement(pressure) - exact).max() < tiles.error * np.abs(exact).max()


def test_where_cells_are_everywhere_there_are_no_tiles():
    assert TiledGrid.of(np.arange(0, 700**2, 97), 700) is None


def test_a_grid_that_the_coarse_one_does_not_fit_has_no_tiles():
    assert TiledGrid.of(np.arange(10), 1001) is None


@pytest.mark.parametrize("adhesion", [0.0, 0.05])
def test_contacts_are_the_same_with_tiles_and_without(adhesion, monkeypatch):
    spectrum = SelfAffineSpectrum(100e-6, 20e-6, short_wavelength=2e-6, hurst=0.8, rms_slope=1.0)
    surface, material = spectrum.realise(800, seed=5), Material(25e6, adhesion, 2e-9)
    results, used = [], []
    of = TiledGrid.of
    monkeypatch.setattr(parallel, "LARGE_GRID", 800)
    monkeypatch.setattr(TiledGrid, "of", lambda *given: used.append(of(*given)) or used[-1])
    for part in (module._LARGEST_COVER_LARGE, 0.0):
        monkeypatch.setattr(module, "_LARGEST_COVER_LARGE", part)
        contact = contact_of(surface, material)
        state = contact.untouched()
        for closer in (0.1, 0.3, 0.45):
            state = contact.equilibrium(state, contact.untouched().separation - closer * surface.rms_height)
        results.append((contact.pressure(state), contact.area_fraction(state), contact.slope(PRESSURE, state)))
        assert any(tiles is not None for tiles in used) == (part > 0)
        used.clear()
    assert results[0][1] > 0
    np.testing.assert_allclose(results[0][:2], results[1][:2], rtol=1e-7)
    assert results[0][2] == pytest.approx(results[1][2], rel=1e-3)
