"""Lengths of the edges of contact patches, against straight lines, circles and contour lines of fine fields."""

import math

import contourpy
import numpy as np
import pytest

import icha
from icha.boundary_elements.patches import edge_lengths, label_patches


def lengths(contact):
    """Return the lengths of the edges of the patches of a map of contact areas, (n, n), in cell sizes."""
    cells, grid = np.flatnonzero(contact), len(contact)
    labels, count = label_patches(cells, grid)
    return edge_lengths(cells, contact.ravel()[cells].astype(float), grid, labels, count)


def inside(shape, grid=96, parts=4):
    """Return the part of each cell that is inside a shape, a function of x and y in cells from the middle."""
    y, x = (np.mgrid[: grid * parts, : grid * parts] + 0.5) / parts - grid / 2
    return shape(x, y).reshape(grid, parts, grid, parts).mean(axis=(1, 3))


@pytest.mark.parametrize("degrees", [0, 7, 13.3, 26.6, 36, 45, 61])
@pytest.mark.parametrize("parts", [1, 4])
def test_edges_of_squares_in_any_direction(degrees, parts):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    square = inside(lambda x, y: (abs(c * x + s * y) < 30) & (abs(c * y - s * x) < 30), parts=parts)
    assert lengths(square) == pytest.approx([240], rel=0.03)


def test_stripes_across_the_periodic_boundary_and_patches_side_by_side():
    contact = np.zeros((64, 64))
    contact[60:] = contact[:4] = 1
    assert lengths(contact) == pytest.approx([2 * 64], rel=0.02)
    # A gap of one cell, which long steps cross.
    contact[6:10] = contact[5] = 1
    assert lengths(contact) == pytest.approx([2 * 64, 2 * 64], rel=0.02)


def test_edges_of_a_random_contact():
    rng, grid = np.random.default_rng(3), 2048
    k = np.hypot(*np.meshgrid(*2 * [np.fft.fftfreq(grid, 1 / grid)]))
    waves = np.where((k >= 4) & (k <= 16), np.maximum(k, 1) ** -1.8, 0) * np.exp(2j * np.pi * rng.random(k.shape))
    heights = np.fft.ifft2(waves).real
    level = 1.5 * heights.std()
    lines = contourpy.contour_generator(z=heights).lines(level)
    exact = sum(np.hypot(*np.diff(line, axis=0).T).sum() for line in lines)
    step = 8  # 16 cells per shortest wave
    found = lengths(heights[::step, ::step] > level)
    assert len(found) > 20
    assert found.sum() * step == pytest.approx(exact, rel=0.015)


@pytest.mark.parametrize("energy", [0.0, 0.05])
def test_spots_of_spheres_are_circles_and_those_of_waves_have_two_edges(energy):
    period, grid = 480e-6, 64
    sphere = icha.Surface(np.zeros((grid, grid)), period, boundary="free", shape=icha.Sphere(1e-3))
    run = icha.simulate(sphere, icha.Material(2.7e6, energy, 2e-9), icha.Path(forces=[2e-4]), model="boundary_elements")
    assert run.spot_perimeter.item() == pytest.approx(2 * np.pi * run.contact_radius.values[-1], rel=0.01)
    heights = np.tile(0.5e-6 * np.cos(2 * np.pi * np.arange(grid) / grid), (grid, 1))
    path = icha.Path(pressures=[np.pi * 10e6 * 0.5e-6 / period / 2])
    wave = icha.simulate(icha.Surface(heights, period), icha.Material(10e6, 0.0), path, model="boundary_elements")
    assert wave.spot_perimeter.item() == pytest.approx(2 * period, rel=0.03)
