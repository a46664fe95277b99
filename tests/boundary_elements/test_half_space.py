"""Fields by blocks of rows and columns, as on large grids, against transforms of the whole grid."""

import numpy as np
import pytest

from icha.boundary_elements import transforms
from icha.boundary_elements.half_space import HalfSpace
from icha.support import parallel


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("largest", [0, 10**6], ids=["on all cores", "on one"])
@pytest.mark.parametrize("grid", [48, 64, 65])
def test_fields_by_blocks_are_those_of_the_whole_grid(grid, largest, kind, monkeypatch):
    space, rng = HalfSpace.of(grid), np.random.default_rng(grid)
    # Some rows are empty, of what is given as of what is asked for.
    cells = np.sort(rng.choice(grid * grid // 2, 300, replace=False))
    at = np.sort(rng.choice(np.arange(grid * grid // 3, grid * grid), 200, replace=False))
    values = rng.normal(size=300).astype(kind)
    whole = [space.filter(cells, values, space.compliance[np.dtype(kind)], where) for where in (None, at)]
    # Blocks of a few rows and columns, of which the last ones are smaller.
    monkeypatch.setattr(transforms, "CACHE", 2 * 5 * grid * values.itemsize)
    monkeypatch.setattr(transforms, "_COLUMNS", 7)
    monkeypatch.setattr(parallel, "LARGE_GRID", largest)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    by_blocks = [space.filter(cells, values, space.compliance[np.dtype(kind)], where) for where in (None, at)]
    for one, other in zip(whole, by_blocks, strict=True):
        assert one.dtype == other.dtype == kind
        np.testing.assert_allclose(other, one, rtol=0, atol=20 * np.finfo(kind).eps * np.abs(whole[0]).max())
