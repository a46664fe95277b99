"""A single square on a free half-space, against closed forms and direct sums of single spots' displacements."""

import itertools

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize
from fields import contact_cover, covered_nodes, displacement, displacement_field, gap
from half_space import displacement_by_quadrature, jkr_approach, jkr_force, spot_of_asperity

import icha
from icha.asperity.jkr import JKR
from icha.contact.model import Control, gap_bins
from icha.equilibrium.distributions import gap_distribution
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.half_space.ewald import PointHalfSpace
from icha.half_space.free_square import mean_displacement
from icha.half_space.interaction import Interaction, displacement_at
from icha.surfaces.summits import Asperities, find_summits

MODULUS, RANGE = 1.0, 1e-3
ENERGIES = [0.0, 3e-4]
# Jump-off radii that are small beside the distances of the spots.
WEAK = [0.0, 1e-7]
# Sum of 1/r over the images of a unit cell less the uniform background, at the origin.
MADELUNG = -3.900264920001956


def law(energy):
    return JKR(icha.Material(MODULUS, energy, RANGE))


def spots(count, largest=0.02, seed=0):
    """Centres in the unit square, the first in a corner and the second at the opposite edge; radii and curvatures."""
    rng = np.random.default_rng(seed)
    position = rng.random((count, 2))
    position[:2] = [[0.0, 0.0], [0.9999, 0.6]][:count]
    return position, largest * rng.uniform(0.2, 1.0, count), rng.uniform(0.5, 2.0, count)


def direct_sum(points, position, a, R, energy, leave_out=()):
    """The sum over spots of what every one of them does alone, ring by ring."""
    total = np.zeros(len(points))
    for i, point in enumerate(points):
        for j, (centre, a_j, R_j) in enumerate(zip(position, a, R, strict=True)):
            if (i, j) not in leave_out:
                total[i] += displacement_by_quadrature(np.hypot(*(point - centre)), a_j, R_j, MODULUS, energy)
    return total


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize(("count", "largest"), [(1, 0.1), (3, 0.05), (150, 0.01)])
def test_displacement_is_the_plain_sum(energy, count, largest):
    position, a, R = spots(count, largest)
    points = np.vstack([np.random.default_rng(1).random((12, 2)), [[0, 0], [1, 0], [0, 1], [1, 1]]])
    exact = direct_sum(points, position, a, R, energy)
    w = displacement_at(law(energy), 1.0, points, position, a, R, free=True)
    np.testing.assert_allclose(w, exact, atol=2e-7 * np.max(np.abs(exact)), rtol=0)


@pytest.mark.parametrize("energy", ENERGIES)
def test_interaction_leaves_out_the_own_spot_alone(energy):
    position, a, R = spots(40)
    half_space = PointHalfSpace.at(position[:25], 1.0, MODULUS, free=True).extended(position[25:])
    interaction = Interaction.between(half_space, R, 1.2 * a)
    exact = direct_sum(position, position, a, R, energy, leave_out={(i, i) for i in range(40)})
    w = interaction.displacement(law(energy), a)
    np.testing.assert_allclose(w, exact, atol=1e-7 * np.max(np.abs(exact)), rtol=0)
    # One spot alone feels nothing, wherever it is.
    for place in ([0.0, 0.0], [0.5, 0.5], [0.9999, 0.2]):
        alone = Interaction.between(PointHalfSpace.at(np.array([place]), 1.0, MODULUS, free=True), R[:1], a[:1])
        assert abs(alone.displacement(law(energy), a[:1])[0]) < 1e-10 * abs(jkr_approach(a[0], R[0], MODULUS, energy))


@pytest.mark.parametrize("energy", ENERGIES)
def test_tangent_is_the_derivative(energy):
    position, a, R = spots(30)
    half_space = PointHalfSpace.at(position, 1.0, MODULUS, free=True)
    one, interaction = law(energy), Interaction.between(half_space, R, 1.5 * a)
    change = 1e-5 * a * np.random.default_rng(2).normal(size=30)
    difference = 0.5 * (interaction.displacement(one, a + change) - interaction.displacement(one, a - change))
    tangent, approximate = interaction.tangent(one, a)
    largest = np.max(np.abs(difference))
    np.testing.assert_allclose(tangent(change), difference, atol=1e-5 * largest, rtol=0)
    np.testing.assert_allclose(approximate(change), difference, atol=3e-3 * largest, rtol=0)


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("grid", [12, 64])
def test_field_is_the_plain_sum_at_the_nodes(energy, grid):
    position, a, R = spots(8, 0.06)
    field = displacement_field(law(energy), 1.0, grid, position, a, R, free=True)
    nodes = np.random.default_rng(3).integers(0, grid, (12, 2))
    nodes[:3] = [[0, 0], [0, grid - 1], [grid - 1, grid - 1]]
    exact = direct_sum(nodes[:, ::-1] / grid, position, a, R, energy)
    np.testing.assert_allclose(field[tuple(nodes.T)], exact, atol=1e-7 * np.max(np.abs(exact)), rtol=0)


def contact_of(position, height, R, energy, period=1.0, free=True):
    position, height, R = np.array(position, float), np.array(height, float), np.array(R, float)
    return InteractingAsperities(law(energy), Asperities(position, height, R, period, free), rms_height=1e-3)


def pressed(contact, separation, steps=12):
    state = contact.untouched()
    for u in np.linspace(state.separation, separation, steps + 1)[1:]:
        state = contact.equilibrium(state, u)
    return state


@pytest.mark.parametrize("energy", WEAK)
@pytest.mark.parametrize("place", [[0.5, 0.5], [0.0, 0.0], [0.999, 0.3]])
def test_a_single_spot_is_hertz_or_jkr_exactly(energy, place):
    contact = contact_of([place], [0.0], [1.0], energy)
    state = pressed(contact, -4e-3)
    (a,) = state.spots.contact_radius
    assert jkr_approach(a, 1.0, MODULUS, energy) == pytest.approx(4e-3, rel=1e-9)
    assert contact.pressure(state) == pytest.approx(jkr_force(a, 1.0, MODULUS, energy), rel=1e-9)
    if energy == 0:
        assert contact.pressure(state) == pytest.approx(4 / 3 * (4e-3) ** 1.5, rel=1e-9)
    stiffness = contact.stiffness(state)
    if energy == 0:
        assert stiffness == pytest.approx(2 * a * MODULUS, rel=1e-6)


@pytest.mark.parametrize("energy", WEAK)
def test_unlike_spots_in_equilibrium(energy):
    position, height = [[0.0, 0.1], [0.15, 0.0], [0.7, 0.99]], np.array([0.0, -4e-4, -1e-4])
    R, u = np.array([1.0, 0.5, 1.5]), -2e-3
    contact = contact_of(position, height, R, energy)
    state = pressed(contact, u)
    ways = [[np.hypot(*np.subtract(p, q)) for q in position] for p in position]

    def error(a):
        w = [
            sum(displacement_by_quadrature(ways[i][j], a[j], R[j], MODULUS, energy) for j in range(3) if j != i)
            for i in range(3)
        ]
        return (jkr_approach(a, R, MODULUS, energy) + w - (height - u)) * 1e3

    found = scipy.optimize.root(error, np.sqrt(R * (height - u)) * 0.9, tol=1e-13)
    assert found.success
    np.testing.assert_allclose(state.spots.contact_radius[spot_of_asperity(state)], found.x, rtol=1e-7)


def test_united_spots_lie_between_their_parts_and_not_across_the_edges():
    contact = contact_of([[0.01, 0.02], [0.03, 0.98]], [0.0, 0.0], [1.0, 1.0], 0.0)
    assert len(pressed(contact, -4e-3).spots) == 2
    across = contact_of([[0.01, 0.02], [0.03, 0.98]], [0.0, 0.0], [1.0, 1.0], 0.0, free=False)
    assert len(pressed(across, -4e-3).spots) == 1
    together = contact_of([[0.01, 0.02], [0.07, 0.02]], [0.0, 0.0], [1.0, 1.0], 0.0)
    united = pressed(together, -4e-3).spots
    np.testing.assert_allclose(united.position, [[0.04, 0.02]], atol=1e-9)


def test_spots_far_apart_do_not_see_the_boundary():
    """As the period grows, periodic and free half-space agree; what is left first is the counter-pressure."""
    rng = np.random.default_rng(5)
    place, height, R = rng.random((10, 2)), -1e-3 * rng.random(10), rng.uniform(0.5, 1.5, 10)
    differences = []
    for period in (4.0, 32.0):
        free, periodic = (
            contact_of(place + (period - 1) / 2, height, R, 0.0, period, is_free) for is_free in (True, False)
        )
        held = free.equilibrium(pressed(free, -1e-3), -1e-3)
        load = free.pressure(held)
        same = periodic.equilibrium(pressed(periodic, -1e-3), -1e-3, Control("pressure", load))
        # The same spots under the same load ...
        differences.append(np.max(np.abs(same.spots.contact_radius / held.spots.contact_radius - 1)))
        # ... but for how far the half-space's mean plane has gone up.
        shift = -MADELUNG * load * period / (np.pi * MODULUS)
        assert same.separation - held.separation == pytest.approx(shift, rel=0.1 / period)
    # Beyond that images act by the third power of the distance.
    assert 8**2 * differences[1] < differences[0] < 0.01


def test_mean_displacement_is_exact_for_forces():
    """Against adaptive quadrature of 1/r; in the middle 4 asinh(1)/pi of F/(E* L), in a corner half of it."""
    middle = 4 * np.arcsinh(1.0) / np.pi
    found = {}
    for x, y in ((0.5, 0.5), (0.0, 0.0), (0.31, 0.88), (1.0, 0.4)):

        def distance_to_edge(angle, x=x, y=y):
            c, s = np.cos(angle), np.sin(angle)
            return min((1 - x if c > 0 else x) / abs(c), (1 - y if s > 0 else y) / abs(s))

        # In polar coordinates around the point the integrand is the distance to the edge.
        corners = [np.mod(np.arctan2(v - y, u - x), 2 * np.pi) for u in (0, 1) for v in (0, 1)]
        turns = sorted({0.0, *corners, np.pi / 2, np.pi, 1.5 * np.pi, 2 * np.pi})
        parts = (scipy.integrate.quad(distance_to_edge, *ends, epsrel=1e-11)[0] for ends in itertools.pairwise(turns))
        found[x, y] = mean_displacement(2.0, MODULUS, np.array([[2 * x, 2 * y]]), np.array([3.0])) * 2.0 / 3.0
        assert found[x, y] == pytest.approx(sum(parts) / np.pi, rel=1e-9)
    assert (found[0.5, 0.5], found[0.0, 0.0]) == pytest.approx((middle, middle / 2), rel=1e-12)


def whole_and_part(n=160, low=24, high=104):
    """A periodic surface, and a part of it as a single square."""
    whole = icha.SelfAffineSpectrum(1.0, 0.4, 0.06, 0.8).realise(n, 5)
    heights = whole.heights[low:high, low:high]
    return whole, icha.Surface(heights, (high - low) / n, boundary="free"), heights.mean(), low / n


def test_summits_of_a_part_are_those_of_the_whole():
    whole, part, mean, origin = whole_and_part()
    expected, found = find_summits(whole), find_summits(part)
    inner = part.period - part.spacing
    inside = np.all((expected.position > origin) & (expected.position < origin + inner), axis=1)
    place = found.position + origin
    # Away from the edges all of them, at the same place, with the same height and radius.
    margin = 8 * part.spacing
    for one, other in ((expected.position[inside], place), (place, expected.position)):
        core = np.all((one > origin + margin) & (one < origin + inner - margin), axis=1)
        nearest = np.min(np.hypot(*(one[core][:, None] - other).transpose(2, 0, 1)), axis=1)
        assert np.max(nearest) < 1e-3 * part.spacing
    for k, position in enumerate(place):
        if np.all((position > origin + margin) & (position < origin + inner - margin)):
            same = np.argmin(np.hypot(*(expected.position - position).T))
            assert found.height[k] + mean == pytest.approx(expected.height[same], abs=1e-6 * whole.rms_height)
            assert found.radius_of_curvature[k] == pytest.approx(expected.radius_of_curvature[same], rel=1e-3)
    # And next to them neither many more nor many fewer.
    assert abs(len(found) - np.count_nonzero(inside)) <= 0.05 * len(found) + 1
    assert np.all((found.position > 0) & (found.position < inner))


def test_moments_of_a_free_square_are_means_over_it():
    whole, part, mean, _ = whole_and_part()
    k = 2 * np.pi * np.fft.fftfreq(whole.grid, 1 / whole.grid)
    spectrum = np.fft.fft2(whole.heights)
    cut = (slice(24, 104), slice(24, 104))
    gy, gx, laplacian = (
        np.fft.ifft2(factor * spectrum).real[cut] for factor in (1j * k[:, None], 1j * k, -(k[:, None] ** 2 + k**2))
    )
    exact = np.mean((whole.heights[cut] - mean) ** 2), np.mean(gx**2 + gy**2), np.mean(laplacian**2)
    np.testing.assert_allclose(part.spectral_moments, exact, rtol=0.01)
    # A quintic spline knows polynomials, right up to the edges.
    y, x = np.mgrid[:20, :20] * 0.1
    surface = icha.Surface(0.3 * x**2 - 0.2 * x * y + 0.5 * y, 2.0, boundary="free")
    slope = np.mean((0.6 * x - 0.2 * y) ** 2 + (0.5 - 0.2 * x) ** 2)
    assert surface.spectral_moments[1:] == pytest.approx((slope, 0.36), rel=1e-10)
    scaled = surface.scaled_to_rms_slope(0.7)
    assert scaled.free and scaled.rms_slope == pytest.approx(0.7, rel=1e-12)
    with pytest.raises(ValueError, match="boundary: 'free'"):
        surface.refined(2)
    with pytest.raises(ValueError, match="boundary: 'open' must be one of periodic, free"):
        icha.Surface(surface.heights, 1.0, boundary="open")


def test_distributions_and_fields_of_a_free_square():
    """Spots over the edges: no part of them comes in on the other side, and what lies outside is counted."""
    energy, grid = 0.0, 60
    contact = contact_of([[0.003, 0.5], [0.6, 0.985], [0.4, 0.4]], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0], energy)
    state = pressed(contact, -1e-3)
    surface = icha.Surface(1e-4 * np.random.default_rng(1).normal(size=(grid, grid)), 1.0, boundary="free")
    spots = state.spots
    cover = contact_cover(surface, spots)
    # Discs by counting points of a fine grid within the square of all cells.
    fine = (np.arange(20 * grid) + 0.5) / (20 * grid) - 0.5 / grid
    within = np.zeros((20 * grid, 20 * grid), bool)
    for (x, y), a in zip(spots.position, spots.contact_radius, strict=True):
        within |= (fine - x) ** 2 + (fine[:, None] - y) ** 2 < a**2
    counted = within.reshape(grid, 20, grid, 20).mean(axis=(1, 3))
    np.testing.assert_allclose(cover, counted, atol=0.02)
    assert cover.mean() == pytest.approx(within.mean(), rel=2e-3)
    assert not covered_nodes(surface, spots)[:, -5:].any() and not covered_nodes(surface, spots)[:5].any()

    found = gap_distribution(contact.law, surface, state)
    area = np.pi * np.sum(spots.contact_radius**2)
    assert 0 < found["area_beyond_edges"] == pytest.approx(area - within.mean(), rel=0.01)
    total = np.sum(found["gap_density"] * np.diff(gap_bins(surface))) + area + found["overlap_fraction"]
    assert total == pytest.approx(1.0 + found["area_beyond_edges"], abs=1e-12)

    w = displacement(contact.law, surface, state)
    nodes = np.array([[3, 59], [0, 0], [31, 2]])
    exact = direct_sum(nodes[:, ::-1] / grid, spots.position, spots.contact_radius, spots.radius_of_curvature, energy)
    np.testing.assert_allclose(w[tuple(nodes.T)], exact, rtol=1e-6)
    fine = displacement_field(
        contact.law, 1.0, 600, spots.position, spots.contact_radius, spots.radius_of_curvature, free=True
    )
    # Nodes stand for the cells that follow them, too: the mean over the square by the trapezoidal rule.
    mean = 0.25 * sum(np.mean(fine[y, x]) for y in (slice(-1), slice(1, None)) for x in (slice(-1), slice(1, None)))
    assert contact.mean_gap(state) - state.separation == pytest.approx(mean, rel=0.01)
    np.testing.assert_allclose(gap(contact.law, surface, state), w + state.separation - surface.heights, atol=1e-15)
