"""Fields by blocks of rows and columns, as on large grids, against transforms of the whole grid."""

import numpy as np
import pytest

from icha.boundary_elements import transforms
from icha.boundary_elements.half_space import HalfSpace
from icha.half_space.layer import Layer, layer_compliance
from icha.support import parallel
from icha.surfaces.surface import full_contact_pressure


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


def smooth_patch(grid, width, middle):
    x = np.arange(grid) - middle
    return np.exp(-0.5 * (x[:, None] ** 2 + x**2) / width**2)


@pytest.mark.parametrize(("layer", "periods"), [(None, 24), (Layer(6.0, 0.5), 6), (Layer(6.0, 0.3), 6)])
def test_a_free_square_is_displaced_like_one_square_of_a_much_larger_period(layer, periods):
    # The displacement of a periodic half-space has zero mean, so only differences between two places are compared.
    grid = 48
    free, periodic = HalfSpace.of(grid, layer, free=True), HalfSpace.of(periods * grid, layer)
    pressure = smooth_patch(grid, 5.0, 24)
    large = np.zeros(periodic.shape)
    large[:grid, :grid] = pressure
    found = free.displacement(np.arange(grid**2), pressure.ravel())
    expected = periodic.displacement(np.arange(periodic.size), large.ravel())[:grid, :grid]
    uniform = layer.uniform_compliance * pressure.sum() / periodic.size if layer else 0.0
    difference = found - expected - uniform
    if layer is None:
        difference -= difference[24, 24]
    # The pressure is uniform over each cell of a free square. This smooths it by its Laplacian/24, 2/(24 5^2) = 0.33 %.
    assert np.abs(difference).max() < 4e-3 * found.max()


def test_a_thick_layer_is_a_half_space_and_a_thin_one_an_elastic_foundation():
    q = np.array([0.1, 1.0])
    np.testing.assert_allclose(layer_compliance(q, Layer(1e4, 0.3)), 2 / q, rtol=1e-12)
    thin = Layer(1e-3, 0.3)
    np.testing.assert_allclose(layer_compliance(q, thin), thin.uniform_compliance, rtol=1e-5)
    # An incompressible thin layer: (3/4) (q t)^2 t (times 2/3 in units of E* = 4 G).
    np.testing.assert_allclose(layer_compliance(q, Layer(1e-2, 0.5)), 4 * 1e-6 * q**2 / 3, rtol=1e-3)


def test_a_smaller_square_around_the_contact_has_the_displacements_of_the_whole_square():
    space, rng = HalfSpace.of(60, Layer(9.0, 0.4), free=True), np.random.default_rng(3)
    row, column = np.meshgrid(np.arange(20, 41), np.arange(7, 30), indexing="ij")
    cells = (row * 60 + column).ravel()
    pressure = rng.normal(size=len(cells)).astype(np.float32)
    operator = space.restrict_to(cells)
    assert operator.space.grid < 60
    np.testing.assert_allclose(operator.displacement(pressure), space.displacement(cells, pressure, cells), atol=1e-5)


@pytest.mark.parametrize("free", [False, True])
def test_the_pressure_in_full_contact_with_a_layer_displaces_it_by_the_heights(free):
    layer, grid = Layer(5.0, 0.4), 32
    heights = smooth_patch(grid, 4.0, 10) + 0.5 * smooth_patch(grid, 3.0, 20)
    heights -= heights.mean()
    pressure = full_contact_pressure(heights, grid, free=free, softness=layer.factor)
    # A free square counts as a quarter of a periodic cell that consists of the square and its mirror images.
    if free:
        pressure = np.block([[pressure, pressure[:, ::-1]], [pressure[::-1], pressure[::-1, ::-1]]])
    displaced = HalfSpace.of(len(pressure), layer).displacement(np.arange(pressure.size), pressure.ravel())
    np.testing.assert_allclose(displaced[:grid, :grid], heights, atol=1e-10)
