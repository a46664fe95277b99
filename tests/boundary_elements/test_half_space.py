"""Elastic half-spaces and layers: displacements and pressures on a grid."""

import numpy as np
import pytest

from icha.boundary_elements.elastic import HalfSpace
from icha.half_space.layer import Layer, layer_compliance
from icha.surfaces.surface import full_contact_pressure


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("grid", [48, 65])
def test_the_pressure_under_a_displacement_is_the_inverse_of_the_displacement_under_a_pressure(grid, free):
    space = HalfSpace.under(grid, free=free)
    pressure = np.random.default_rng(grid).normal(size=(space.grid, space.grid))
    pressure -= pressure.mean()
    np.testing.assert_allclose(space.pressure(space.displacement(pressure)), pressure, atol=1e-12)


def smooth_patch(grid, width, middle):
    x = np.arange(grid) - middle
    return np.exp(-0.5 * (x[:, None] ** 2 + x**2) / width**2)


@pytest.mark.parametrize(("layer", "periods"), [(None, 24), (Layer(6.0, 0.5), 6), (Layer(6.0, 0.3), 6)])
def test_a_free_square_is_displaced_like_one_square_of_a_much_larger_period(layer, periods):
    # The displacement of a periodic half-space has zero mean, so only differences between two places are compared.
    grid = 48
    free, periodic = HalfSpace.under(grid, layer, free=True), HalfSpace.under(periods * grid, layer)
    pressure = smooth_patch(grid, 5.0, 24)
    fields = [np.pad(pressure, (0, space.grid - grid)) for space in (free, periodic)]
    found = free.displacement(fields[0])[:grid, :grid]
    expected = periodic.displacement(fields[1])
    expected = (expected - expected.mean())[:grid, :grid]
    uniform = layer.uniform_compliance * pressure.sum() / periodic.grid**2 if layer else 0.0
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


@pytest.mark.parametrize("free", [False, True])
def test_the_pressure_in_full_contact_with_a_layer_displaces_it_by_the_heights(free):
    layer, grid = Layer(5.0, 0.4), 32
    heights = smooth_patch(grid, 4.0, 10) + 0.5 * smooth_patch(grid, 3.0, 20)
    heights -= heights.mean()
    pressure = full_contact_pressure(heights, grid, free=free, softness=layer.factor)
    # A free square counts as a quarter of a periodic cell that consists of the square and its mirror images.
    if free:
        pressure = np.block([[pressure, pressure[:, ::-1]], [pressure[::-1], pressure[::-1, ::-1]]])
    displaced = HalfSpace.under(len(pressure), layer).displacement(pressure)
    np.testing.assert_allclose(displaced[:grid, :grid], heights, atol=1e-10)
