"""Fields of displacement against Fourier series of the pressures, image sums, and evaluation at single points."""

import numpy as np
import pytest
import scipy.special
from fields import displacement_field
from half_space import CENTRES, CURVATURE, ENERGIES, MODULUS, RADIUS, law, periodic_displacement, spectral_displacement

from icha.half_space.grid_displacement import windows
from icha.half_space.split import smooth_half


@pytest.mark.parametrize("k", range(4))
def test_smooth_half_against_its_hankel_transform(k):
    # erf(x)/x = int erfc(q/2) J0(q x) dq, and the Laplacian multiplies by -q^2.
    q, weight = np.polynomial.legendre.leggauss(300)
    q, weight = 9 * (q + 1), 9 * weight
    x = np.linspace(0, 4.6, 500)
    expected = ((-(q**2)) ** k * scipy.special.erfc(q / 2) * weight) @ scipy.special.j0(q[:, None] * x)
    value = smooth_half((x**2)[None], np.eye(4)[[k]])[0]
    np.testing.assert_allclose(value, expected, rtol=0, atol=1e-12 * np.max(np.abs(expected)))
    both = smooth_half(np.array([x**2, x**2]), np.array([[1.0, -2.0, 0.5, 0.0], [0.0, 0.0, 0.0, 3.0]]))
    apart = [smooth_half((x**2)[None], np.eye(4)[[j]])[0] for j in range(4)]
    np.testing.assert_allclose(both, [apart[0] - 2 * apart[1] + 0.5 * apart[2], 3 * apart[3]], rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("spots", [[0, 1, 2], [1]])
def test_field_against_the_fourier_series_of_the_pressures(energy, spots):
    n = 1024
    centres, a, R = CENTRES[spots], RADIUS[spots] + 0.01, CURVATURE[spots]
    series = spectral_displacement(centres, a, R, MODULUS, energy, 1.0, n)
    field = displacement_field(law(energy), 1.0, n, centres, a, R)
    node = np.arange(n) / n
    smooth = np.ones((n, n), dtype=bool)
    for centre, radius in zip(centres, a, strict=True):
        dx, dy = node - centre[0], node - centre[1]
        r = np.hypot((dx - np.rint(dx))[None, :], (dy - np.rint(dy))[:, None])
        # Near an edge the series is cut off too early to be exact.
        smooth &= np.abs(r - radius) > 20 / n
    assert smooth.mean() > 0.9
    # Both under the contact and outside.
    assert np.max(np.abs(field - series)[smooth]) < 1e-7 * np.max(np.abs(field))


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("n", [8, 16, 23, 64, 97, 200])
def test_nodes_of_coarse_and_fine_grids_against_the_direct_image_sum(energy, n):
    # The coarsest cannot hold the Fourier series themselves.
    field = displacement_field(law(energy), 1.0, n, CENTRES, RADIUS, CURVATURE)
    # Far from all spots, inside the first one, and at the border.
    for row, column in [(0, 0), (round(0.31 * n), round(0.19 * n)), (n // 3, n // 5), (n - 1, n // 2)]:
        x, y = column / n, row / n
        expected = sum(
            periodic_displacement(x - cx, y - cy, a, R, MODULUS, energy, 1.0)
            for (cx, cy), a, R in zip(CENTRES, RADIUS, CURVATURE, strict=True)
        )
        assert field[row, column] == pytest.approx(expected, abs=1e-6 * np.max(np.abs(field)))


@pytest.mark.parametrize("energy", ENERGIES)
def test_large_and_small_spots_together_are_the_sum_of_each_alone(energy):
    # Alone, a spot's Fourier series and window are others than among two hundred of very different sizes.
    rng, n = np.random.default_rng(6), 96
    a = 10 ** rng.uniform(-3.5, -1.6, 200)
    centres, R = rng.random((200, 2)), rng.uniform(0.5, 2, 200) * a / 0.2
    together = displacement_field(law(energy), 1.0, n, centres, a, R)
    alone = sum(displacement_field(law(energy), 1.0, n, centres[[j]], a[[j]], R[[j]]) for j in range(len(a)))
    np.testing.assert_allclose(together, alone, rtol=0, atol=3e-8 * np.max(np.abs(alone)))


def test_spots_of_no_radius_and_no_spots_displace_nothing():
    empty = np.empty(0)
    np.testing.assert_array_equal(displacement_field(law(0.0), 1.0, 16, np.empty((0, 2)), empty, empty), 0)
    a = np.array([0.02, 0.0, 0.015])
    three = displacement_field(law(0.0), 1.0, 64, CENTRES, a, CURVATURE)
    two = displacement_field(law(0.0), 1.0, 64, CENTRES[[0, 2]], a[[0, 2]], CURVATURE[[0, 2]])
    np.testing.assert_allclose(three, two, rtol=0, atol=1e-9 * np.max(np.abs(two)))


@pytest.mark.parametrize(("grid", "reach"), [(20, 0.23), (21, 0.07), (20, 0.7), (21, 0.5)])
def test_windows_hold_every_node_within_reach_once(grid, reach):
    centres = np.array([[0.31, 0.97], [1.02, -0.013], [0.5, 0.5]])
    found = np.zeros((3, grid, grid), dtype=int)
    for rows in (slice(0, 6), slice(6, 7), slice(7, grid)):
        for window in windows(centres, reach, grid, 1.0, rows):
            for spot, dy, dx, node in zip(*window, strict=True):
                row, column = node // grid + rows.start, node % grid
                assert np.all(row == row[0])
                np.testing.assert_allclose(np.mod(centres[spot, 1] + dy - row[0] / grid + 0.5, 1), 0.5, atol=1e-12)
                np.testing.assert_allclose(np.mod(centres[spot, 0] + dx - column / grid + 0.5, 1), 0.5, atol=1e-12)
                assert np.max(np.abs(dx)) <= 0.5 + 1 / grid and abs(dy) <= 0.5 + 1 / grid
                found[spot, row[0], column] += 1
    assert found.max() == 1
    node = np.arange(grid) / grid
    for count, (x, y) in zip(found, centres, strict=True):
        dx, dy = node - x, node - y
        near = np.hypot((dx - np.rint(dx))[None, :], (dy - np.rint(dy))[:, None]) <= reach
        assert np.all(count[near] == 1)
