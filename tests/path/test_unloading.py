"""Unloading: the stable JKR branch of every spot, its jumps, turning points, and what is refused.

Asperities have radius 1 in units of modulus and surface energy; the cell is so large that its images do not matter,
unless a test has another period.
"""

from itertools import pairwise
from types import SimpleNamespace

import few_asperities as few
import numpy as np
import pytest
from half_space import periodic_point_load
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

import icha
from icha import Material, Path
from icha.checks.run import check_run
from icha.contact.model import COALESCENCE, JUMP_OFF, SPLIT, events_between
from icha.contact.models import PathAccuracy
from icha.path.step_accuracy import StepAccuracy
from icha.path.targets import LOAD_CONTROL
from icha.surfaces.summits import find_summits
from validation.surfaces import paraboloid


def test_one_asperity_is_on_its_stable_branch_from_jump_in_to_jump_off():
    assert pytest.approx([few.JUMP_OFF_APPROACH, few.PULL_OFF_APPROACH], abs=1e-6) == [-1.608772, -0.773417]
    contact, waypoints = few.alone()
    for leg, first, last in ((0, few.WU, None), (1, None, few.JUMP_OFF_APPROACH)):
        touching = [w.state for w in waypoints if w.leg == leg and len(w.state.spots)]
        d = few.HEIGHT - np.array([state.separation for state in touching])
        a = np.array([state.spots.contact_radius[0] for state in touching])
        assert np.all(a >= few.JUMP_OFF_RADIUS)
        np.testing.assert_allclose(few.approach(a), d, atol=1e-6)
        forces = [contact.pressure(state) * contact.area for state in touching]
        np.testing.assert_allclose(forces, few.force(a), rtol=1e-10, atol=1e-10)
        assert np.all(np.diff(d) * (1 if leg == 0 else -1) > 0)
        if first:
            assert d[0] == pytest.approx(first, abs=1e-9)
        if last:
            assert d[-1] == pytest.approx(last, abs=1e-6)
            assert forces[-1] == pytest.approx(-5 / 6 * np.pi, rel=1e-4)
    assert few.counts(few.closed_again(waypoints)) == [1, 1, 0, 0]
    weakest = min((w for w in waypoints if w.leg == 1), key=lambda w: few.load(contact, w))
    assert few.load(contact, weakest) == pytest.approx(-1.5 * np.pi, rel=1e-7)
    assert few.HEIGHT - weakest.state.separation == pytest.approx(few.PULL_OFF_APPROACH, abs=1e-3)


@pytest.mark.parametrize("p, q, slope, end_slope", [(-2.4, -0.95, -43.2, 18.1), (-2.4, -2.5, -43.2, 50.0)])
def test_the_largest_tension_between_two_states_is_that_of_their_cubic(p, q, slope, end_slope):
    """Also if a front hops, so that the pressure jumps without an event, and the tangents meet outside the step."""
    length = 0.075
    start, end = (
        SimpleNamespace(separation=u, pressure=f, slope=k) for u, f, k in ((1, p, slope), (1 + length, q, end_slope))
    )
    contact = SimpleNamespace(
        pressure=lambda state: state.pressure, stiffness=lambda state: -state.slope, path_accuracy=PathAccuracy()
    )
    step = SimpleNamespace(separation_change=length, may_change_pressure=False)
    found = StepAccuracy(contact, 0.15, lowest_pressure=-2.3).locate_largest_tension(start, end, step)
    curve = CubicHermiteSpline([0, length], [p, q], [slope, end_slope])
    (lowest,) = [u for u in curve.derivative().roots(extrapolate=False) if curve(u, 2) > 0]
    assert found - 1 == pytest.approx(lowest, rel=1e-9)
    assert curve(lowest) < min(p, q)
    # It is no larger than an earlier tension.
    assert StepAccuracy(contact, 0.15, lowest_pressure=-5.0).locate_largest_tension(start, end, step) is None


def test_a_load_falls_on_no_load_and_breaks_contact_at_the_largest_tension():
    contact, waypoints = few.alone(LOAD_CONTROL)
    touching = [w for w in waypoints if len(w.state.spots)]
    assert few.load(contact, touching[0]) == pytest.approx(0.0, abs=1e-8)
    assert touching[0].state.spots.contact_radius[0] == pytest.approx(few.NO_LOAD_RADIUS, rel=1e-8)
    assert few.load(contact, touching[-1]) == pytest.approx(-1.5 * np.pi, rel=1e-7)
    assert touching[-1].state.spots.contact_radius[0] == pytest.approx(few.PULL_OFF_RADIUS, rel=1e-3)
    few.closed_again(waypoints)
    for leg in (0, 1):
        assert np.all(
            np.diff([few.load(contact, w) for w in waypoints if w.leg == leg][: -1 if leg else None])
            * (1 if leg == 0 else -1)
            >= -1e-12
        )


def test_a_bump_in_a_cell_has_the_law_and_its_images():
    """The images, and the counter-pressure, lower the surface under the spot by -3.9003 F/(pi E* L)."""
    period = 24.0
    surface = paraboloid(48, period)
    top = float(surface.heights.max())
    run = icha.simulate(surface, few.STICKY, Path([1e-3], unload=True))
    raised = periodic_point_load(0.0, 0.0) / (np.pi * period)
    assert raised * np.pi * period == pytest.approx(-3.9003, abs=1e-4)
    lowest, most = few.JUMP_OFF_APPROACH + raised * few.force(few.JUMP_OFF_RADIUS), -1.5 * np.pi
    assert top - float(run.detachment_separation) == pytest.approx(lowest, abs=1e-3)
    assert lowest - few.JUMP_OFF_APPROACH > 0.1  # the images are seen
    assert float(run.detachment_pressure) * period**2 == pytest.approx(-5 / 6 * np.pi, rel=1e-4)
    assert float(run.pull_off_pressure) * period**2 == pytest.approx(-most, rel=1e-6)
    assert float(run.pull_off_over_summits) == pytest.approx(1.0, rel=1e-5)
    there = few.approach(few.PULL_OFF_RADIUS) + raised * most
    assert top - float(run.pull_off_separation) == pytest.approx(there, abs=2e-3)
    start = brentq(lambda a: few.approach(a) + raised * few.force(a) - few.WU, few.JUMP_OFF_RADIUS, 4)
    stored = [few.energy(a) + 0.5 * raised * few.force(a) ** 2 for a in (few.JUMP_OFF_RADIUS, start)]
    assert float(run.hysteresis_loss) * period**2 == pytest.approx(stored[0] - stored[1], rel=1e-3)
    # Two snapshots: the last stop, and the largest tension.
    assert run.snapshot_kind.values.tolist() == ["reduced_pressure", "pull_off"]
    assert int(run.snapshot_step[1]) == int(np.argmin(run.nominal_pressure.values))


def test_two_equal_asperities_let_go_at_their_common_limit_point():
    """It comes before the jump-off of either: every spot pulls the surface away from the other."""
    _, waypoints = few.equal_pair()
    above, radius = few.limit_point(lambda a: few.beside(8.0, a))
    touching = [w.state for w in waypoints if len(w.state.spots)]
    assert touching[-1].separation - few.HEIGHT == pytest.approx(above, abs=2e-5)
    assert touching[-1].separation - few.HEIGHT < above + 1e-9
    np.testing.assert_allclose(touching[-1].spots.contact_radius, radius, rtol=1e-3)
    assert radius > 1.05 * few.JUMP_OFF_RADIUS
    end = few.closed_again(waypoints)
    assert few.counts(end) == [2, 2, 0, 0]
    events = few.history(waypoints)
    np.testing.assert_allclose(np.sort(events.position[events.kind == JUMP_OFF, 0]), few.FAR / 2 + np.array([-4, 4]))


def some():
    """Two asperities that interact with each other and with their images."""
    return few.contact_of([few.HEIGHT, few.HEIGHT - 1.5], [[-9, 0], [8, 3]], period=60.0)


@pytest.mark.parametrize(
    ("kind", "back", "forth", "control"),
    [
        ("reduced_pressure", -0.002, 0.004, "load"),
        ("area_fraction", 0.002, 0.006, "separation"),
    ],
)
def test_turning_points_are_hit_exactly(kind, back, forth, control):
    contact = some()
    turns = [(kind, back), (kind, forth)]
    waypoints = few.travelled(contact, [0.01], unload=True, turning_points=turns, control=control)
    legs = np.array([w.leg for w in waypoints])
    assert np.all(np.diff(legs) >= 0) and set(legs) == {0, 1, 2, 3}
    for leg, value in ((1, back), (2, forth)):
        turn = waypoints[np.flatnonzero(legs == leg)[-1]]
        assert (turn.target.kind, turn.target.value) == (kind, value)
        scale = max(abs(value), 1e-3)
        area, load = contact.area_fraction(turn.state), few.load(contact, turn) / 1e3
        assert (area if kind == "area_fraction" else load) == pytest.approx(value, abs=1e-8 * scale)
    assert [w.loading for w in waypoints] == [leg in (0, 2) for leg in legs]
    u = np.array([w.state.separation for w in waypoints])
    for leg in range(4):
        assert np.all(np.diff(u[legs == leg]) * (-1 if leg in (0, 2) else 1) > 0)
    few.closed_again(waypoints)


def test_a_loop_without_events_is_reversible():
    contact = some()
    turns = [("reduced_pressure", -0.002), ("reduced_pressure", 0.01)]
    waypoints = few.travelled(contact, [0.01], turning_points=turns, max_step=0.1)
    there, back, again = ([w for w in waypoints if w.leg == leg] for leg in range(3))
    for waypoints in (there, again):
        assert few.counts(waypoints[-1].state)[: JUMP_OFF + 1] == [2, 0]
    assert again[-1].state.separation == pytest.approx(there[-1].state.separation, rel=1e-9)
    assert abs(again[-1].balance.work - there[-1].balance.work) < 1e-6 * abs(there[-1].balance.work)
    # Reloading visits all separations of unloading except the turning point.
    met = {round(w.state.separation, 7): few.load(contact, w) for w in again}
    common = [w for w in back if round(w.state.separation, 7) in met]
    assert len(common) >= 5
    for w in common:
        assert met[round(w.state.separation, 7)] == pytest.approx(few.load(contact, w), abs=1e-6)


def test_loading_again_goes_on_beyond_the_old_maximum():
    contact = few.contact_of([few.HEIGHT])
    turns = [("reduced_pressure", -0.003), ("reduced_pressure", 0.03)]
    waypoints = few.travelled(contact, [0.01], turning_points=turns)
    a = waypoints[-1].state.spots.contact_radius[0]
    assert waypoints[-1].leg == 2 and not any(w.leg > 2 for w in waypoints)
    assert few.force(a) == pytest.approx(30.0, rel=1e-8)
    assert few.approach(a) == pytest.approx(few.HEIGHT - waypoints[-1].state.separation, abs=1e-6)
    once = few.travelled(contact, [0.03], unload=True)
    last = [w for w in once if w.leg == 0][-1]
    assert last.state.separation == pytest.approx(waypoints[-1].state.separation, abs=1e-7)
    assert last.balance.work == pytest.approx(waypoints[-1].balance.work, rel=1e-4)


def test_a_contact_without_an_equilibrium_is_not_recorded():
    """The images of an asperity that jumps in pull it off again at once: no equilibrium exists at its jump-in."""
    contact = few.contact_of([few.HEIGHT], period=20.0, material=Material(1.0, 1.0, 1 / 1.1))
    start = contact.untouched()
    state = contact.equilibrium(start, start.separation - 1e-6)
    assert (state.barred_count, len(state.spots)) == (1, 0)
    assert state.history == ()


def test_a_union_that_jumps_off_releases_its_asperities():
    """Where both of them have a stable state they stay in contact, and unite again."""
    contact = few.pair(3.0, 4.0)
    united = [w.state for w in few.travelled(contact, [0.03]) if w.state.spots.members.tolist() == [2]][-1]
    after = contact.equilibrium(united, united.separation, let_go=1)
    events = events_between(united, after)
    assert events.kind.tolist() == [JUMP_OFF, SPLIT, COALESCENCE] and events.members.tolist() == [2, 2, 2]
    assert after.spots.members.tolist() == [2]


def test_a_union_splits_where_it_was_made():
    """The two spots that a union was made of come apart about where they met, and break one after the other."""
    waypoints = few.travelled(few.pair(3.0, 6.0), [0.04], unload=True)
    end = few.closed_again(waypoints)
    assert few.counts(end)[JUMP_OFF:] == [2, 1, 1]

    def change(leg, before, after):
        way = [w.state for w in waypoints if w.leg == leg]
        return next(
            two.separation
            for one, two in pairwise(way)
            if one.spots.members.tolist() == before and two.spots.members.tolist() == after
        )

    united, parted = change(0, [1, 1], [2]), change(1, [2], [1, 1])
    assert parted == pytest.approx(united, abs=0.02)
    assert few.HEIGHT - [w.state for w in waypoints if len(w.state.spots)][-1].separation == pytest.approx(
        few.JUMP_OFF_APPROACH, abs=1e-5
    )


def test_an_edge_of_contact_within_the_accuracy_of_the_solver_is_passed():
    """A sticky bump, as wide as a quarter of the cell, is drawn off; near the end no step is too short to go on."""
    n, period = 64, 100e-6
    x = (np.arange(n) + 0.5) * period / n - period / 2
    heights = 1e-6 * np.exp(-(x[:, None] ** 2 + x**2) / (2 * (10e-6) ** 2))
    surface = icha.Surface(heights=heights, period=period)
    sticky = icha.Material(contact_modulus=0.24e6, surface_energy=0.05, interaction_range=2e-9)
    run = icha.simulate(surface, sticky, icha.Path(mean_separations=[5e-7, 2e-7], unload=True))
    assert run.sizes["step"] < 400
    (radius,) = find_summits(surface).radius_of_curvature
    most = 1.5 * np.pi * 0.05 * radius / period**2
    assert float(run.pull_off_pressure) == pytest.approx(most, rel=1e-6)
    assert float(run.detachment_pressure) == pytest.approx(-5 / 9 * most, rel=1e-3)


def test_a_wave_without_summits_has_no_pull_off_of_summits():
    n = 16
    surface = icha.Surface(np.tile(1e-3 * np.cos(2 * np.pi * np.arange(n) / n), (n, 1)), 1.0)
    run = icha.simulate(surface, icha.Material(1.0, 1e-6, 1e-6), Path([1e-4], unload=True), model="boundary_elements")
    assert float(run.asperity_count) == 0 and float(run.pull_off_pressure) > 0
    assert np.isposinf(float(run.pull_off_over_summits))
    assert all(check.passed for check in check_run(run) if check.name == "finite")
