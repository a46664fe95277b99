"""Coalescence: the equivalent spot as the paper defines it, and its independence of the order of input."""

import numpy as np
import pytest
from few_asperities import BARE, HEIGHT, contact_of, counts
from half_space import all_pairs, spot_of_asperity

from icha import Material
from icha.asperity.coalescence import covering_spot, disjoint_pairs, equivalent_spots, overlapping_pairs
from icha.asperity.jkr import JKR
from icha.contact.model import COALESCENCE
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.surfaces.summits import Asperities

LAW = JKR(Material(2.0, 0.0, 1e-5))
PERIOD = 1.0


def equivalent(position, a, R):
    return equivalent_spots(LAW, position[[0]], a[[0]], R[[0]], position[[1]], a[[1]], R[[1]], PERIOD)


def test_area_radius_and_centroid_as_written():
    position, a, R = np.array([[0.3, 0.4], [0.35, 0.46]]), np.array([0.03, 0.05]), np.array([0.6, 1.1])
    centre, a_eq, R_eq = equivalent(position, a, R)
    assert np.pi * a_eq[0] ** 2 == pytest.approx(np.sum(np.pi * a**2), rel=1e-14)
    assert R_eq[0] == pytest.approx(np.sqrt(np.sum(R**2)), rel=1e-14)
    volume = np.pi * a**4 / (4 * R)
    np.testing.assert_allclose(centre[0], volume @ position / volume.sum(), rtol=1e-14)


def test_the_centroid_is_taken_across_the_border():
    inside = equivalent(np.array([[0.50, 0.48], [0.54, 0.52]]), np.array([0.03, 0.02]), np.array([1.0, 2.0]))
    shift = np.array([0.49, 0.51])
    across = equivalent(
        np.mod(np.array([[0.50, 0.48], [0.54, 0.52]]) + shift, 1.0), np.array([0.03, 0.02]), np.array([1.0, 2.0])
    )
    difference = across[0] - inside[0] - shift
    np.testing.assert_allclose(difference - np.rint(difference), 0, atol=1e-14)
    assert np.all((across[0] >= 0) & (across[0] < 1))
    assert across[1:] == inside[1:]


def brute_force_pairs(position, a):
    found = []
    for i in range(len(a)):
        for j in range(i + 1, len(a)):
            d = position[i] - position[j]
            depth = a[i] + a[j] - np.hypot(*(d - np.rint(d)))
            if depth > 0:
                found.append((depth, frozenset((i, j))))
    return [pair for _, pair in sorted(found, key=lambda p: -p[0])]


@pytest.mark.parametrize("seed", range(4))
def test_overlapping_pairs_are_all_found_deepest_first(seed):
    rng = np.random.default_rng(seed)
    position, a = rng.random((60, 2)), rng.exponential(0.03, 60)
    pairs = [frozenset(p) for p in overlapping_pairs(position, a, *all_pairs(position, PERIOD)).tolist()]
    assert len(pairs) > 20
    assert pairs == brute_force_pairs(position, a)


def test_equal_depths_are_ordered_by_position_not_by_input():
    # A ring of equal spots across the border: every depth is the same.
    position = np.array([[0.05, 0.05], [0.95, 0.05], [0.95, 0.95], [0.05, 0.95], [0.5, 0.5]])
    a = np.full(5, 0.06)
    reference = None
    for order in ([0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [2, 0, 4, 1, 3]):
        pairs = disjoint_pairs(overlapping_pairs(position[order], a, *all_pairs(position[order], PERIOD)))
        chosen = {frozenset(order[i] for i in pair) for pair in pairs.tolist()}
        reference = reference or chosen
        assert chosen == reference
    assert len(reference) == 2


def two_bumps(energy, order=(0, 1)):
    """Two asperities near each other, which unite when pressed, and one far away."""
    position = np.array([[0.40, 0.50], [0.43, 0.51]])[list(order)]
    height = np.array([1.0e-3, 0.9e-3])[list(order)]
    R = np.array([0.5, 0.8])[list(order)]
    law = JKR(Material(2.0, energy, 1e-5))
    return InteractingAsperities(law, Asperities(position, height, R, PERIOD), rms_height=1e-3)


def states_around_the_union(contact):
    """The last state with two spots and the first with one, a billionth of the separation's way apart."""
    before = contact.equilibrium(contact.untouched(), 0.9e-3)
    separation, step = before.separation, 5e-5
    while step > 1e-13:
        after = contact.equilibrium(before, separation - step)
        if counts(after)[COALESCENCE]:
            step /= 2
        else:
            before, separation = after, separation - step
    return before, contact.equilibrium(before, separation - 2 * step)


@pytest.mark.parametrize("energy", [0.0, 1e-9])
def test_a_union_keeps_the_area_at_this_separation(energy):
    contact = two_bumps(energy)
    before, after = states_around_the_union(contact)
    assert len(before.spots) == 2 and len(after.spots) == 1 and counts(after)[COALESCENCE] == 1
    two, one = before.spots, after.spots
    # They touched, and the equivalent spot is as the paper defines it, in equilibrium at this separation.
    assert np.sum(two.contact_radius) == pytest.approx(np.hypot(0.03, 0.01), rel=1e-7)
    assert one.contact_radius[0] == pytest.approx(np.hypot(*two.contact_radius), rel=1e-7)
    assert one.radius_of_curvature[0] == pytest.approx(np.hypot(*two.radius_of_curvature), rel=1e-14)
    volume = two.contact_radius**4 / two.radius_of_curvature
    np.testing.assert_allclose(one.position[0], volume @ two.position / np.sum(volume), rtol=1e-7)
    assert one.members.tolist() == [2]
    np.testing.assert_array_equal(spot_of_asperity(after), [0, 0])
    # From here on it is a spot of that height: h - u = delta + w of its own images.
    law, E = contact.law, 2.0
    w = -3.900265 * law.force(one.contact_radius, one.radius_of_curvature) / (np.pi * E * PERIOD)
    error = one.height - after.separation - one.approach - w
    assert abs(error[0]) < 1e-4 * abs(one.approach[0])


@pytest.mark.parametrize("energy", [0.0, 1e-9])
def test_the_order_of_the_input_does_not_matter(energy):
    rng = np.random.default_rng(3)
    position, height, R = rng.random((40, 2)), 1e-3 * rng.random(40), rng.uniform(1, 5, 40)
    results = []
    for seed in (None, 1, 2):
        order = np.arange(40) if seed is None else np.random.default_rng(seed).permutation(40)
        asperities = Asperities(position[order], height[order], R[order], PERIOD)
        contact = InteractingAsperities(JKR(Material(2.0, energy, 1e-5)), asperities, rms_height=3e-4)
        state = contact.untouched()
        for separation in np.arange(0.9e-3, 0, -5e-5):
            state = contact.equilibrium(state, separation)
        assert counts(state)[COALESCENCE] >= 3
        spots = state.spots
        rank = np.argsort(spots.position[:, 0])
        results.append([spots.position[rank, 0], spots.height[rank], spots.contact_radius[rank], spots.members[rank]])
        # Every asperity belongs to the spot into which those near it were united.
        members = np.bincount(spot_of_asperity(state)[spot_of_asperity(state) >= 0], minlength=len(spots))
        assert np.all(members >= spots.members)
    for other in results[1:]:
        for value, reference in zip(other, results[0], strict=True):
            np.testing.assert_allclose(value, reference, rtol=1e-6)


def test_the_deepest_cover_counts():
    points = np.array([[0.5, 0.5], [0.1, 0.1], [0.98, 0.5]])
    spots, a = np.array([[0.52, 0.5], [0.45, 0.5], [0.01, 0.5]]), np.array([0.03, 0.07, 0.05])
    np.testing.assert_array_equal(covering_spot(points, spots, a, PERIOD), [1, -1, 2])
    # Spots among themselves: only in a larger one, and of two equal ones the second in the first.
    twins = np.array([[0.2, 0.2], [0.205, 0.2], [0.21, 0.2]])
    a = np.array([0.02, 0.02, 0.01])
    np.testing.assert_array_equal(covering_spot(twins, twins, a, PERIOD, larger_than=a), [-1, 0, 1])
    assert len(covering_spot(points[:0], spots, a, PERIOD)) == 0
    np.testing.assert_array_equal(covering_spot(points, spots[:0], a[:0], PERIOD), [-1, -1, -1])


def test_asperity_under_a_candidate_out_of_contact_makes_contact_itself():
    """One long step from first contact, in which a blunt asperity first covers a sharp one and then loses contact."""
    angles = np.arange(5) * 2 * np.pi / 5
    ring = 30.68 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    heights = HEIGHT + np.array([0.0, 0.4947, *5 * [0.7919]])
    contact = contact_of(heights, [(0, 0), (2.492, 0), *ring], [46.78, 1.0, *5 * [54.31]], material=BARE)
    stepwise = start = contact.untouched()
    for part in np.linspace(0.05, 1, 20):
        stepwise = contact.equilibrium(stepwise, start.separation - 1.3163 * part)
    at_once = contact.equilibrium(start, stepwise.separation)
    assert contact.spot_count(at_once) == contact.spot_count(stepwise) == 6
    assert contact.pressure(at_once) == pytest.approx(contact.pressure(stepwise), rel=1e-9)
