"""Equilibrium of spots against independent solutions, jumps at the right separations, and that it always ends."""

import numpy as np
import pytest
import scipy.optimize
from half_space import all_pairs, jkr_approach, jkr_force, periodic_displacement, spot_of_asperity
from hypothesis import example, given
from hypothesis import strategies as st

from icha import Material, SelfAffineSpectrum, Surface
from icha.asperity.jkr import JKR
from icha.contact.model import COALESCENCE, JUMP_OFF, Control, Events, NotConverged
from icha.contact.models import RESIDUAL_TOLERANCE
from icha.equilibrium import solver
from icha.equilibrium.interacting_asperities import InteractingAsperities, contact_of
from icha.half_space.ewald import PointHalfSpace
from icha.half_space.interaction import Interaction, displacement_at
from icha.surfaces.square import periodic_difference
from icha.surfaces.summits import Asperities, find_summits

MODULUS, ENERGY = 25e6, 0.05
PERIOD, R = 100e-6, 100e-6
# A Tabor parameter of three, so that Wu's formula holds.
RANGE = ((ENERGY / MODULUS) ** 2 * R) ** (1 / 3) / 3


def bump_heights(n=64, centre=(0.503, 0.4963)):
    x = np.arange(n) / n
    dx, dy = x - centre[0], x - centre[1]
    return -(((dx - np.rint(dx)) ** 2)[None, :] + ((dy - np.rint(dy)) ** 2)[:, None]) * PERIOD**2 / (2 * R)


def bump(energy):
    """The contact problem of one paraboloid on a grid, and the height of its top above the mean plane."""
    contact = contact_of(Surface(bump_heights(), PERIOD), Material(MODULUS, energy, RANGE))
    assert len(contact.asperities) == 1
    return contact, -bump_heights().mean()


def displacement_by_own_images(a, energy):
    return periodic_displacement(0.0, 0.0, a, R, MODULUS, energy, PERIOD, own=False)


def lone_spot(separation, top, energy, larger_than):
    """Radius of a lone spot: delta(a) + w(images) = h - u, by bracketing."""
    return scipy.optimize.brentq(
        lambda a: jkr_approach(a, R, MODULUS, energy) + displacement_by_own_images(a, energy) - (top - separation),
        larger_than,
        0.2 * PERIOD,
        xtol=1e-18,
        rtol=1e-14,
    )


def test_hertz_bump_against_a_scalar_equation():
    contact, top = bump(0.0)
    state = contact.untouched()
    assert state.separation == pytest.approx(top, rel=1e-9)
    for depth in (1e-9, 1e-8, 1e-7):
        state = contact.equilibrium(state, top - depth)
        a = lone_spot(state.separation, top, 0.0, 1e-12)
        assert state.spots.contact_radius[0] == pytest.approx(a, rel=1e-6)
        assert contact.pressure(state) * PERIOD**2 == pytest.approx(jkr_force(a, R, MODULUS, 0.0), rel=3e-6)
        assert contact.area_fraction(state) * PERIOD**2 == pytest.approx(np.pi * a**2, rel=2e-6)
    # And it lets go where it began.
    assert len(contact.equilibrium(state, top + 1e-12).spots) == 0


def test_jump_in_of_a_bump_happens_at_wus_gap():
    contact, top = bump(ENERGY)
    gap = -(1 - 2.641 * 3 ** (3 / 7)) * RANGE
    assert contact.untouched().separation == pytest.approx(top + gap, rel=1e-9)
    before = contact.equilibrium(contact.untouched(), (top + gap) * (1 + 1e-8))
    assert len(before.spots) == 0
    after = contact.equilibrium(before, (top + gap) * (1 - 1e-8))
    assert len(after.spots) == 1
    assert [len(each) for each in after.history] == [1]
    expected = lone_spot(after.separation, top, ENERGY, contact.law.jump_off_radius(R))
    assert after.spots.contact_radius[0] == pytest.approx(expected, rel=1e-6)
    # The jump is into tension.
    assert contact.pressure(after) < 0


def group(count, energy):
    position = np.array([[0.45, 0.5], [0.52, 0.53], [0.47, 0.58]])[:count] * PERIOD
    height = np.array([1.0e-6, 0.97e-6, 1.02e-6])[:count]
    radius = np.array([0.1, 0.14, 0.07])[:count] * R
    law = JKR(Material(MODULUS, energy, RANGE))
    return InteractingAsperities(law, Asperities(position, height, radius, PERIOD), rms_height=1e-6)


def independent_solution(contact, separation, energy, guess):
    """Radii of interacting spots: own kernel by quadrature and image sums, and SciPy's hybrid method."""
    asperities = contact.asperities
    position, radius, height = asperities.position, asperities.radius_of_curvature, asperities.height
    n = len(height)

    def error(scaled):
        a = scaled * guess
        return [
            (
                jkr_approach(a[i], radius[i], MODULUS, energy)
                + sum(
                    periodic_displacement(
                        *(position[i] - position[j]), a[j], radius[j], MODULUS, energy, PERIOD, own=i != j
                    )
                    for j in range(n)
                )
                + separation
                - height[i]
            )
            / height[i]
            for i in range(n)
        ]

    solution = scipy.optimize.root(error, np.ones(n), tol=1e-12)
    assert np.max(np.abs(error(solution.x))) < 1e-10
    return solution.x * guess


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("energy", [0.0, ENERGY])
def test_interacting_spots_against_an_independent_solution(count, energy):
    contact = group(count, energy)
    state = contact.equilibrium(contact.untouched(), 0.85e-6)
    assert len(state.spots) == count
    spots = state.spots
    np.testing.assert_array_equal(np.sort(spot_of_asperity(state)), np.arange(count))
    order = [int(np.argmin(np.hypot(*(spots.position - p).T))) for p in contact.asperities.position]
    alone = contact.law.contact_radius(contact.asperities.height - 0.85e-6, contact.asperities.radius_of_curvature)
    expected = independent_solution(contact, 0.85e-6, energy, alone)
    # The interaction matters here.
    assert np.max(np.abs(expected / alone - 1)) > 0.005
    np.testing.assert_allclose(spots.contact_radius[order], expected, rtol=1e-6)
    force = np.sum(jkr_force(expected, contact.asperities.radius_of_curvature, MODULUS, energy))
    assert contact.pressure(state) * PERIOD**2 == pytest.approx(force, rel=5e-6)


def test_a_shielded_asperity_does_not_touch():
    # Lower than its neighbour's displacement there, though above the undeformed plane.
    low = 1e-6 - 0.3e-6
    law = JKR(Material(MODULUS, 0.0, RANGE))
    position = np.array([[0.5, 0.5], [0.58, 0.5]]) * PERIOD
    contact = InteractingAsperities(
        law, Asperities(position, np.array([1e-6, low]), np.full(2, R), PERIOD), rms_height=1e-6
    )
    u = low - 0.01e-6
    state = contact.equilibrium(contact.untouched(), u)
    assert len(state.spots) == 1
    a = state.spots.contact_radius[0]
    w = periodic_displacement(0.08 * PERIOD, 0.0, a, R, MODULUS, 0.0, PERIOD)
    assert low - u - w < 0


def rough(energy, grid=64, seed=1, ratio=16):
    surface = SelfAffineSpectrum(PERIOD, 0.2 * PERIOD, PERIOD / ratio, 0.8).realise(grid, seed)
    return contact_of(surface, Material(MODULUS, energy, 2.071e-9))


@pytest.mark.parametrize("energy", [0.0, ENERGY])
def test_stiffness_against_differences(energy):
    contact = rough(energy)
    state = contact.untouched()
    for level in (2.5, 2.0, 1.5, 1.2):
        state = contact.equilibrium(state, level * contact.rms_height)
    step = 1e-6 * contact.rms_height
    ahead, behind = (contact.equilibrium(state, state.separation + s) for s in (-step, step))
    np.testing.assert_array_equal(spot_of_asperity(ahead), spot_of_asperity(behind))
    difference = (contact.pressure(ahead) - contact.pressure(behind)) / (2 * step)
    assert contact.stiffness(state) == pytest.approx(difference, rel=1e-5)


@pytest.mark.parametrize("energy", [0.0, ENERGY])
@pytest.mark.parametrize("quantity", ["pressure", "area_fraction"])
def test_holding_a_quantity(energy, quantity):
    contact = rough(energy)
    state = contact.equilibrium(contact.untouched(), 2.0 * contact.rms_height)
    measure = getattr(contact, quantity)
    target = 1.02 * measure(state)
    held = contact.equilibrium(state, state.separation, Control(quantity, target))
    assert measure(held) == pytest.approx(target, rel=2e-11)
    assert held.residual <= RESIDUAL_TOLERANCE
    # The same state at that separation, without the control.
    again = contact.equilibrium(state, held.separation)
    assert measure(again) == pytest.approx(target, rel=1e-6)


def test_without_adhesion_the_light_load_limit_is_greenwood_and_williamson():
    # Independent asperities: A = sum pi R d, F = sum 4/3 E* sqrt(R) d^(3/2), d = h - u. As the load vanishes the
    # interaction does, and with it the difference of A at equal load.
    contact = rough(0.0, seed=1)
    height, radius = contact.asperities.height, contact.asperities.radius_of_curvature

    def independent(u):
        depth = np.maximum(height - u, 0)
        return np.sum(np.pi * radius * depth), np.sum(4 / 3 * MODULUS * np.sqrt(radius) * depth**1.5)

    state, errors, counts = contact.untouched(), [], []
    top, second = np.sort(height)[::-1][:2]
    for u in (top - 0.5 * (top - second), 2.6 * contact.rms_height, 2.3 * contact.rms_height):
        state = contact.equilibrium(state, u)
        force = contact.pressure(state) * contact.area
        area = contact.area_fraction(state) * contact.area
        matched = scipy.optimize.brentq(
            lambda v, f=force: independent(v)[1] - f, u - contact.rms_height, top, xtol=1e-20
        )
        errors.append(area / independent(matched)[0] - 1)
        counts.append(len(state.spots))
    assert counts[0] == 1 < counts[1] < counts[2]
    # A lone spot: area against load is Hertz's, whatever the images do.
    assert abs(errors[0]) < 1e-9
    assert abs(errors[1]) < 0.02
    assert abs(errors[1]) < abs(errors[2]) < 0.1


def assert_consistent(contact, state):
    """Assert what must hold in every equilibrium."""
    spots, law, period = state.spots, contact.law, contact.asperities.period
    assert state.residual <= RESIDUAL_TOLERANCE
    assert np.all(np.isfinite(spots.contact_radius)) and np.all(spots.contact_radius > 0)
    assert np.all(spots.approach >= law.jump_off_approach(spots.radius_of_curvature))
    np.testing.assert_allclose(
        law.approach(spots.contact_radius, spots.radius_of_curvature), spots.approach, atol=1e-10 * contact.rms_height
    )
    a, R = spots.contact_radius, spots.radius_of_curvature
    half_space = PointHalfSpace.at(spots.position, period, law.material.contact_modulus)
    w = Interaction.between(half_space, R, a).displacement(law, a)
    error = spots.approach + w + state.separation - spots.height
    # The sum over the spots alone is split otherwise than that over the sites of the solve.
    assert np.max(np.abs(error), initial=0) <= 2e-7 * contact.rms_height
    first, second, r = all_pairs(spots.position, period)
    # Only the two spots of one split may overlap, until the unloading ends.
    split = state.sites.split_from[state.sites.contact_radius > 0]
    together = np.not_equal(split[first], None) & (split[first] == split[second])
    assert np.all((r >= spots.contact_radius[first] + spots.contact_radius[second]) | together)
    assert np.all(
        np.isin(state.site_of_asperity[state.site_of_asperity >= 0], np.flatnonzero(state.sites.contact_radius > 0))
    )
    # Every spot has an owner, and no free asperity is left beyond its jump-in but the pending ones.
    assert set(spot_of_asperity(state)[spot_of_asperity(state) >= 0]) == set(range(len(spots)))
    free = spot_of_asperity(state) < 0
    there = contact.asperities.position[free]
    w = displacement_at(law, period, there, spots.position, a, R)
    approach = contact.asperities.height[free] - state.separation - w
    scale = 2e-7 * contact.rms_height
    beyond = approach >= contact.jump_in_approach[free] + scale
    if len(spots) and beyond.any():
        distance = [np.hypot(*periodic_difference(spots.position, p, period).T) for p in there[beyond]]
        covered = [np.any(d < spots.contact_radius) for d in distance]
        assert not any(covered)
    assert np.count_nonzero(beyond) <= state.barred_count


def count_rounds(monkeypatch, most):
    """Count the rounds of events, and stop at more than `most`."""
    rounds = []
    original = solver.apply_events

    def apply_events(*arguments):
        state, changed = original(*arguments)
        rounds.append(changed)
        assert sum(rounds) <= most, "the rounds do not end"
        return state, changed

    monkeypatch.setattr(solver, "apply_events", apply_events)
    return rounds


# Here the two spots of a split overlap by 0.8 % of their distance.
@example(seed=248404, noise=False, adhesion=0.0, tabor=1.0, first=0.203125, moves=[0.46875])
# Here contacts that break would be made again for ever.
@example(seed=140, noise=False, adhesion=-0.5, tabor=1.04, first=2.54, moves=[-0.16, -0.43])
@example(seed=180, noise=True, adhesion=-0.6, tabor=0.5, first=1.5, moves=[0.33, -0.8])
@example(seed=231, noise=False, adhesion=-0.09, tabor=1.07, first=2.13, moves=[-0.02, -0.4])
@given(
    seed=st.integers(0, 10**6),
    noise=st.booleans(),
    adhesion=st.one_of(st.just(0.0), st.floats(-5, 0)),
    tabor=st.floats(0.2, 8),
    first=st.floats(0.2, 3.0),
    moves=st.lists(st.floats(-1.0, 0.6), min_size=1, max_size=3),
)
def test_equilibrium_always_ends(seed, noise, adhesion, tabor, first, moves):
    if noise:
        # Every node its own: summits as close as they can be.
        surface = Surface(1e-6 * np.random.default_rng(seed).normal(size=(12, 12)), PERIOD)
    else:
        surface = SelfAffineSpectrum(PERIOD, 0.5 * PERIOD, PERIOD / 6, 0.6).realise(24, seed)
    # Surface energy as a power of ten of what bends the summits flat: E* h_rms^2 times their mean curvature.
    strength = 0.0 if adhesion == 0 else 10.0**adhesion
    asperities = find_summits(surface)
    radius = float(np.median(asperities.radius_of_curvature))
    energy = strength * MODULUS * surface.rms_height**1.5 / radius**0.5
    range_ = np.cbrt((energy / MODULUS) ** 2 * radius) / tabor if energy else 1e-9
    contact = InteractingAsperities(JKR(Material(MODULUS, energy, range_)), asperities, surface.rms_height)
    state, separation = contact.untouched(), first * surface.rms_height
    with pytest.MonkeyPatch.context() as monkeypatch:
        # Every round but the last adds an asperity, loses one for good, or unites two spots.
        rounds = count_rounds(monkeypatch, 3 * len(asperities) + 2)
        for move in [0.0, *moves]:
            separation += move * surface.rms_height
            rounds.clear()
            try:
                state = contact.equilibrium(state, separation)
            except NotConverged:
                pass
            else:
                assert_consistent(contact, state)


@pytest.mark.parametrize("energy", [0.0, ENERGY])
def test_states_along_a_path_are_consistent(energy):
    contact = rough(energy, seed=3)
    state = contact.untouched()
    for levels in (np.arange(2.8, 0.6, -0.2), np.arange(0.8, 3.2, 0.4), np.arange(2.6, 0.6, -0.3)):
        for level in levels:
            state = contact.equilibrium(state, level * contact.rms_height)
            assert_consistent(contact, state)
    events = Events.concatenate(state.history)
    assert events.count(COALESCENCE) > 0 and events.count(JUMP_OFF) > 0


def test_too_few_newton_steps_are_reported_not_passed_off(monkeypatch):
    contact = rough(ENERGY)
    monkeypatch.setattr(solver, "_MAX_NEWTON_STEPS", 1)
    with pytest.raises(NotConverged, match="equilibrium error"):
        contact.equilibrium(contact.untouched(), 1.5 * contact.rms_height)
