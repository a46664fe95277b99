"""The periodic interaction against direct image sums, Fourier series, and finite differences."""

import numpy as np
import pytest
from half_space import CENTRES, CURVATURE, ENERGIES, MODULUS, RADIUS, law, periodic_displacement, periodic_point_load

from icha.half_space.ewald import PointHalfSpace
from icha.half_space.interaction import Interaction, displacement_at


def between(centres, largest, R, period=1.0):
    return Interaction.between(PointHalfSpace.at(centres, period, MODULUS), R, largest)


def at_spots(energy, centres=CENTRES, a=RADIUS, R=CURVATURE):
    return between(centres, a, R).displacement(law(energy), a)


@pytest.mark.parametrize("energy", ENERGIES)
def test_spots_against_the_direct_image_sum(energy):
    expected = [
        sum(
            periodic_displacement(*(CENTRES[i] - CENTRES[j]), RADIUS[j], CURVATURE[j], MODULUS, energy, 1.0, own=i != j)
            for j in range(3)
        )
        for i in range(3)
    ]
    np.testing.assert_allclose(at_spots(energy), expected, rtol=1e-6)
    # A lone small spot feels the constant of its own images.
    a, R = np.array([1e-3]), np.array([1.0])
    w = between(np.array([[0.37, 0.81]]), a, R).displacement(law(0.0), a)
    assert w[0] == pytest.approx(-3.900265 * law(0.0).force(a, R)[0] / (np.pi * MODULUS), rel=1e-6)


@pytest.mark.parametrize("energy", ENERGIES)
def test_points_against_the_direct_image_sum(energy):
    # Far away, inside a spot, at its edge, at a corner of the cell, and across its border from a spot.
    points = np.array([[0.5, 0.1], [0.205, 0.31], [0.2 + 0.0201, 0.3], [0.0, 0.0], [0.02, 0.97], [1.2, -0.6]])
    w = displacement_at(law(energy), 1.0, points, CENTRES, RADIUS, CURVATURE)
    expected = [
        sum(periodic_displacement(*(p - CENTRES[j]), RADIUS[j], CURVATURE[j], MODULUS, energy, 1.0) for j in range(3))
        for p in points
    ]
    np.testing.assert_allclose(w, expected, atol=1e-6 * np.max(np.abs(expected)))


@pytest.mark.parametrize("energy", ENERGIES)
def test_point_loads_against_the_direct_image_sum_for_many_spots(energy):
    # Many spots so small that they are points: here the near field covers a part of the cell only.
    rng = np.random.default_rng(4)
    count = 600
    cells = rng.permutation(40 * 40)[:count]
    centres = (np.stack([cells % 40, cells // 40], axis=1) + rng.random((count, 2)) * 0.5) / 40
    a = rng.uniform(0.5, 1.0, count) * 2e-4
    R = rng.uniform(0.5, 1.0, count)
    w = at_spots(energy, centres, a, R)
    table = {}
    force = law(energy).force(a, R)
    moment = law(energy).second_moment(a, R)
    for i in (0, 17, 599):
        total = force[i] * periodic_point_load(0, 0, 6)
        for j in range(count):
            if j == i:
                continue
            d = centres[i] - centres[j]
            d -= np.rint(d)
            psi = table.setdefault((i, j), periodic_point_load(*d, 6))
            total += force[j] * psi + moment[j] / np.hypot(*d) ** 3
        assert w[i] == pytest.approx(total / (np.pi * MODULUS), abs=1e-6 * np.max(np.abs(w)))


def test_tangent_against_differences_for_many_spots():
    rng = np.random.default_rng(5)
    count = 400
    centres, a, R = rng.random((count, 2)), rng.uniform(0.2, 1, count) * 3e-3, rng.uniform(0.5, 1, count)
    spots, interaction = law(1e-6), between(centres, a, R)
    direction = rng.normal(size=count) * a
    above, below = (interaction.displacement(spots, a + sign * 1e-5 * direction) for sign in (1, -1))
    difference = (above - below) / 2e-5
    tangent, approximate = interaction.tangent(spots, a)
    value = tangent(direction)
    # A few pairs overlap or nearly touch: there the neck's part is singular at the edge.
    good = np.abs(value - difference) < 1e-5 * np.max(np.abs(difference))
    assert np.mean(good) > 0.97
    # The operator of the linear solves only has to be close.
    assert np.max(np.abs(approximate(direction) - value)) < 5e-3 * np.max(np.abs(value))


@pytest.mark.parametrize("energy", ENERGIES)
def test_points_may_be_added_later(energy):
    rng = np.random.default_rng(6)
    centres, a = rng.random((300, 2)), rng.uniform(0.2, 1, 300) * 4e-3
    R = np.ones(300)
    grown = PointHalfSpace.at(centres[:170], 1.0, MODULUS).extended(centres[170:210]).extended(centres[210:])
    value = Interaction.between(grown, R, a).displacement(law(energy), a)
    np.testing.assert_allclose(value, at_spots(energy, centres, a, R), atol=1e-7 * np.max(np.abs(value)))


@pytest.mark.parametrize("energy", ENERGIES)
def test_spots_and_points_agree_at_all_distances(energy):
    # Inside spots, across their edges, at the end of the windows and of the near field, and on the centre itself.
    rng = np.random.default_rng(7)
    count = 200
    centres, a, R = rng.random((count, 2)), rng.uniform(0.1, 1, count) * 1e-2, np.ones(count)
    a[::3] = 0.0
    a[1] = 0.06
    w = displacement_at(law(energy), 1.0, centres, centres, a, R)
    own = law(energy).displacement(np.zeros(count), a, R)
    np.testing.assert_allclose(at_spots(energy, centres, a, R), w - own, atol=3e-7 * np.max(np.abs(w)))
