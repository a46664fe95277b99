"""Coalescence: the equivalent spot as the paper defines it, and its independence of the order of input."""

import numpy as np
import pytest

from icha import Material
from icha.asperities import Asperities
from icha.coalescence import disjoint_pairs, equivalent_spots, overlapping_pairs
from icha.equilibrium import Contact, Spots, balance, coalesce
from icha.jkr import JKR

PERIOD = 1.0


def equivalent(position, a, R):
    pairs = np.array([[0, 1]])
    return equivalent_spots(position[pairs[:, 0]], a[[0]], R[[0]], position[pairs[:, 1]], a[[1]], R[[1]], PERIOD)


def test_area_radius_and_centroid_as_written():
    position, a, R = np.array([[0.3, 0.4], [0.35, 0.46]]), np.array([0.03, 0.05]), np.array([0.6, 1.1])
    centre, a_eq, R_eq = equivalent(position, a, R)
    assert np.pi * a_eq[0] ** 2 == pytest.approx(np.sum(np.pi * a**2), rel=1e-14)
    assert R_eq[0] == pytest.approx(np.sqrt(np.sum(R**2)), rel=1e-14)
    volume = np.pi * a**4 / (4 * R)
    np.testing.assert_allclose(centre[0], volume @ position / volume.sum(), rtol=1e-14)


def test_the_weight_is_the_volume_of_the_cap():
    # A paraboloid r^2/(2R) cut at r = a: the volume between it and the plane of its edge, by quadrature.
    a, R = 0.03, 0.7
    r = (np.arange(4000) + 0.5) / 4000 * a
    volume = np.sum(2 * np.pi * r * (a**2 - r**2) / (2 * R)) * a / 4000
    assert np.pi * a**4 / (4 * R) == pytest.approx(volume, rel=1e-6)


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


def test_the_order_of_a_pair_does_not_matter():
    position, a, R = np.array([[0.02, 0.98], [0.97, 0.03]]), np.array([0.03, 0.05]), np.array([0.6, 1.1])
    one, other = equivalent(position, a, R), equivalent(position[::-1], a[::-1], R[::-1])
    for first, second in zip(one, other, strict=True):
        np.testing.assert_allclose(first, second, rtol=1e-13)


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
    pairs = [frozenset(p) for p in overlapping_pairs(position, a, PERIOD).tolist()]
    assert len(pairs) > 20
    assert pairs == brute_force_pairs(position, a)


def test_touching_spots_do_not_overlap():
    position = np.array([[0.25, 0.5], [0.5, 0.5]])
    assert len(overlapping_pairs(position, np.array([0.125, 0.125]), PERIOD)) == 0
    assert len(overlapping_pairs(position, np.array([0.125, 0.12500001]), PERIOD)) == 1
    # A small spot wholly inside a large one.
    inside = np.array([[0.5, 0.5], [0.51, 0.5]])
    assert len(overlapping_pairs(inside, np.array([0.1, 0.001]), PERIOD)) == 1


def test_equal_depths_are_ordered_by_position_not_by_input():
    # A ring of equal spots across the border: every depth is the same.
    position = np.array([[0.05, 0.05], [0.95, 0.05], [0.95, 0.95], [0.05, 0.95], [0.5, 0.5]])
    a = np.full(5, 0.06)
    reference = None
    for order in ([0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [2, 0, 4, 1, 3]):
        pairs = disjoint_pairs(overlapping_pairs(position[order], a, PERIOD))
        chosen = {frozenset(order[i] for i in pair) for pair in pairs.tolist()}
        reference = reference or chosen
        assert chosen == reference
    assert len(reference) == 2


def test_every_spot_merges_at_most_once_at_a_time():
    pairs = disjoint_pairs(np.array([[3, 1], [1, 2], [0, 2], [4, 3]]))
    np.testing.assert_array_equal(pairs, [[3, 1], [0, 2]])
    assert disjoint_pairs(np.empty((0, 2), dtype=int)).shape == (0, 2)


def contact_and_spots(energy, order=(0, 1, 2, 3, 4)):
    position = np.array([[0.20, 0.30], [0.23, 0.31], [0.70, 0.72], [0.72, 0.69], [0.5, 0.1]])[list(order)]
    a = np.array([0.02, 0.018, 0.03, 0.015, 0.01])[list(order)]
    R = np.array([0.5, 0.8, 1.1, 0.4, 0.7])[list(order)]
    law = JKR(Material(2.0, energy, 1e-3))
    contact = Contact(law, Asperities(position, np.zeros(5), R, PERIOD), rms_height=1e-2)
    spots = Spots(position, np.zeros(5), R, a, law.approach(a, R), np.array([1, 2, 1, 3, 1])[list(order)])
    separation = 0.013
    height = separation + spots.approach + contact.interaction(spots).displacement(a)
    return contact, Spots(position, height, R, a, spots.approach, spots.members), separation


@pytest.mark.parametrize("energy", [0.0, 1e-5])
def test_the_height_holds_the_merged_radius_at_this_separation(energy):
    contact, spots, separation = contact_and_spots(energy)
    pairs = np.array([[0, 1], [2, 3]])
    merged, owner = coalesce(contact, spots, np.arange(5), pairs, separation)
    assert len(merged) == 3
    np.testing.assert_array_equal(owner, [1, 1, 2, 2, 0])
    np.testing.assert_array_equal(merged.members, [1, 3, 4])
    area = np.pi * spots.contact_radius**2
    np.testing.assert_allclose(np.pi * merged.contact_radius[1:] ** 2, [area[:2].sum(), area[2:4].sum()], rtol=1e-14)
    # h_eq - u = delta(a_eq, R_eq) + w of all others, as they now are.
    approach = contact.law.approach(merged.contact_radius, merged.radius_of_curvature)
    w = contact.interaction(merged).displacement(merged.contact_radius)
    np.testing.assert_allclose((merged.height - separation - approach - w)[1:], 0, atol=1e-15)
    # The equilibrium keeps that radius but for the answer of the spot that did not merge.
    settled, _, residual = balance(contact, merged, separation)
    assert residual < 1e-10
    np.testing.assert_allclose(settled.contact_radius[1:], merged.contact_radius[1:], rtol=1e-3)


def test_two_lone_spots_keep_their_merged_radius_exactly():
    contact, spots, separation = contact_and_spots(1e-5)
    two = spots.take(np.array([0, 1]))
    merged, _ = coalesce(contact, two, np.array([0, 1, -1, -1, -1]), np.array([[0, 1]]), separation)
    settled, _, _ = balance(contact, merged, separation)
    np.testing.assert_allclose(settled.contact_radius, np.hypot(*two.contact_radius), rtol=1e-9)


@pytest.mark.parametrize("energy", [0.0, 1e-5])
def test_the_order_of_the_input_does_not_matter(energy):
    results = []
    for order in ([0, 1, 2, 3, 4], [3, 1, 4, 0, 2], [4, 3, 2, 1, 0]):
        contact, spots, separation = contact_and_spots(energy, order)
        pairs = disjoint_pairs(overlapping_pairs(spots.position, spots.contact_radius, PERIOD))
        assert len(pairs) == 2
        merged, owner = coalesce(contact, spots, np.arange(5), pairs, separation)
        rank = np.argsort(merged.position[:, 0])
        values = (
            merged.position[:, 0],
            merged.height,
            merged.radius_of_curvature,
            merged.contact_radius,
            merged.members,
        )
        results.append([value[rank] for value in values])
        # Every asperity still belongs to the spot nearest to it.
        np.testing.assert_array_equal(np.sort(owner), [0, 1, 1, 2, 2])
    for other in results[1:]:
        for value, reference in zip(other, results[0], strict=True):
            np.testing.assert_allclose(value, reference, rtol=1e-10)
