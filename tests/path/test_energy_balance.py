"""Energy balance: losses against closed forms, their parts, and what they do not depend on.

Asperities have radius 1 in units of modulus and surface energy.
"""

from functools import cache

import few_asperities as few
import numpy as np
import pytest
from scipy.optimize import brentq

import icha
from icha import Material, Path
from icha.contact.model import COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, Events
from icha.path import step_accuracy
from icha.path.energy_balance import EnergyBalance, Step
from icha.path.targets import DEFAULT_STEP
from icha.surfaces.summits import find_summits

LOSSES = ("by_jump_in", "by_jump_off", "by_coalescence", "by_load_jump")


def lost(contact, waypoints):
    """Work lost by the end of a path, and its parts, as energies."""
    balance = waypoints[-1].balance
    parts = (balance.jump_in, balance.jump_off, balance.coalescence, balance.load_jump, balance.unattributed)
    return sum(parts) * contact.area, *(part * contact.area for part in parts)


@pytest.mark.parametrize("step", [0.05, 0.5])
def test_one_asperity_loses_what_lies_between_jump_in_and_jump_off(step):
    """Its jumps are found as sharply as necessary, whatever the longest step."""
    contact = few.contact_of([few.HEIGHT])
    waypoints = few.travelled(contact, [0.01], unload=True, max_step=step)
    stored, released = few.energy(few.JUMP_OFF_RADIUS), -few.energy(few.stable_radius(few.WU))
    total, jump_in, jump_off, coalescence, load_jump, _ = lost(contact, waypoints)
    assert total == pytest.approx(stored + released, rel=5e-4)
    assert jump_in == pytest.approx(released, rel=1e-4)
    assert jump_off == pytest.approx(stored, rel=1e-4)
    assert coalescence == load_jump == 0
    assert waypoints[-1].balance.work * contact.area == pytest.approx(total, rel=1e-9)


def test_under_load_one_asperity_loses_more():
    """From first contact it jumps to zero load; the largest tension pulls it to where contact ends."""
    contact, waypoints = few.alone("load")
    total, jump_in, jump_off, coalescence, load_jump, _ = lost(contact, waypoints)
    pulled = -few.force(few.PULL_OFF_RADIUS) * (few.approach(few.PULL_OFF_RADIUS) - few.approach(few.JUMP_OFF_RADIUS))
    assert total == pytest.approx(few.energy(few.PULL_OFF_RADIUS) - few.energy(few.NO_LOAD_RADIUS) + pulled, rel=5e-4)
    assert load_jump == pytest.approx(total, rel=1e-4)
    assert jump_in == jump_off == coalescence == 0


def test_two_equal_asperities_lose_what_their_limit_point_says():
    contact, waypoints = few.equal_pair()
    _, last = few.limit_point(lambda a: few.beside(8.0, a))
    first = brentq(lambda a: few.approach(a) + few.beside(8.0, a) - few.WU, 1.0, 5.0)
    stored, released = (2 * few.energy(a) + few.force(a) * few.beside(8.0, a) for a in (last, first))
    total, jump_in, jump_off, *_ = lost(contact, waypoints)
    assert total == pytest.approx(stored - released, rel=1e-3)
    assert jump_in == pytest.approx(-released, rel=1e-3)
    assert jump_off == pytest.approx(stored, rel=1e-3)


HEIGHTS = few.HEIGHT - np.array([0, 0.8, 1.1, 2.5, 3.9, 4.1])
RADII = np.array([1, 0.6, 1.8, 1.2, 0.8, 1.5])


@cache
def dilute():
    positions = np.random.default_rng(3).uniform(-0.5, 0.5, (6, 2)) * few.FAR
    contact = few.contact_of(HEIGHTS, positions, RADII)
    return contact, few.travelled(contact, [0.06], unload=True)


def dilute_edges():
    """Approaches at jump-in and jump-off: Wu's with the Tabor parameter of every radius, and the end of the branch."""
    inward = (1 - 2.641 * (RADII ** (1 / 3) * 2.5) ** (3 / 7)) / 2.5
    outward = np.array([few.approach(np.cbrt(np.pi / 8 * R**2), R) for R in RADII])
    return inward, outward


def radius(d, R):
    return brentq(lambda a: few.approach(a, R) - d, np.cbrt(np.pi / 8 * R**2), 50)


def test_separate_asperities_lose_the_sum_of_their_own_loops():
    contact, waypoints = dilute()
    inward, _ = dilute_edges()
    released = -sum(few.energy(radius(d, R), R) for d, R in zip(inward, RADII, strict=True))
    stored = sum(few.energy(np.cbrt(np.pi / 8 * R**2), R) for R in RADII)
    total, jump_in, jump_off, coalescence, _, rest = lost(contact, waypoints)
    assert total == pytest.approx(stored + released, rel=1e-3)
    assert jump_in == pytest.approx(released, rel=5e-4)
    assert jump_off == pytest.approx(stored, rel=5e-4)
    assert coalescence == 0 and abs(rest) < 1e-3 * total


def test_separate_asperities_jump_one_by_one():
    contact, waypoints = dilute()
    inward, outward = dilute_edges()
    end, events = few.closed_again(waypoints), few.history(waypoints)
    assert few.counts(end) == [6, 6, 0, 0]
    assert events.kind.tolist() == [JUMP_IN] * 6 + [JUMP_OFF] * 6
    for leg, edge, kind in ((0, inward, JUMP_IN), (1, outward, JUMP_OFF)):
        order = np.argsort((HEIGHTS - edge) * (1 if leg else -1))
        np.testing.assert_allclose(events.position[events.kind == kind], contact.asperities.position[order])
        way = [w.state for w in waypoints if w.leg == leg]
        for above, below, moved in zip(way, way[1:], np.diff([len(s.spots) for s in way]), strict=False):
            low, high = sorted((above.separation, below.separation))
            passed = np.count_nonzero((HEIGHTS - edge > low - 1e-6) & (HEIGHTS - edge < high + 1e-6))
            assert passed >= abs(moved)


def test_without_adhesion_and_unions_nothing_is_lost():
    surface = icha.SelfAffineSpectrum(100e-6, 20e-6, 12.5e-6, 0.8, rms_slope=0.2).realise(64, 1)
    run = icha.simulate(surface, Material(1e6, 0.0, 2e-9), Path([1e-3, 1e-2], unload=True))
    assert int(run.coalescence_count[-1]) == 0 and int(run.spot_count.max()) >= 10
    assert abs(float(run.hysteresis_loss)) <= 1e-8 * float(run.work.max())
    assert float(run.pull_off_pressure) == 0
    # Unloading visits the separations of loading.
    first, last = (run.isel(step=np.flatnonzero(run.leg == leg)) for leg in (0, int(run.leg.max())))
    u = first.mean_separation.values
    met = 0
    for step in last.step.values:
        one = last.sel(step=step)
        same = np.flatnonzero(np.abs(u - float(one.mean_separation)) < 1e-12 * u)
        if len(same):
            met += 1
            for name in ("nominal_pressure", "contact_area_fraction"):
                error = abs(float(one[name]) - float(first[name][same[0]]))
                assert error <= 1e-9 * float(run[name].max()), name
    assert met >= 0.9 * (last.sizes["step"] - 2) and met > 20


def test_without_adhesion_a_union_costs_nothing():
    """A union splits into its two spots where it was formed, so the loop is reversible."""
    contact = few.pair(1.0, 4.0, few.BARE)
    waypoints = few.travelled(contact, [0.03], unload=True)
    end = few.closed_again(waypoints)
    assert few.counts(end)[COALESCENCE:] == [1, 1]  # every union is undone
    assert abs(lost(contact, waypoints)[0]) < 1e-8 * max(w.balance.work * contact.area for w in waypoints)


@cache
def separate_run():
    """A small sticky surface whose spots interact but do not unite."""
    return icha.simulate(*few.small(), Path([5e-3], unload=True))


def test_the_losses_by_jumps_make_up_the_loop():
    run = separate_run()
    assert int(run.coalescence_count[-1]) == 0 and int(run.jump_in_count[-1]) >= 5
    loss = float(run.hysteresis_loss)
    assert abs(float(run.loss_unattributed)) < 0.02 * loss
    assert float(run.loss_by_jump_in + run.loss_by_jump_off) == pytest.approx(loss, rel=0.02)
    # The loop's area, by the trapezoidal rule.
    p, u = run.nominal_pressure.values, run.mean_separation.values
    assert -np.sum(0.5 * (p[1:] + p[:-1]) * np.diff(u)) == pytest.approx(loss, rel=0.05)


@pytest.mark.parametrize("which", ["separate", "united"])
def test_work_is_stored_or_lost_at_every_step(which):
    run = {"separate": separate_run, "united": few.united_run}[which]()
    parts = sum(run[f"dissipated_{name}"].values for name in LOSSES)
    rest = (run.work - run.stored_energy).values - parts  # what no event accounts for
    assert rest[0] == 0 and rest[-1] == pytest.approx(float(run.loss_unattributed), rel=1e-9)
    assert np.max(np.abs(rest)) < 2e-3 * np.max(np.abs(run.work.values))
    # It does not change in steps in which anything unites or comes apart.
    united = np.diff(run.coalescence_count + run.split_count) > 0
    assert np.all(np.abs(np.diff(rest)[united]) <= 1e-12 * np.max(np.abs(run.work.values)))
    assert abs(float(run.stored_energy[0])) == abs(float(run.stored_energy[-1])) == 0
    assert float(run.hysteresis_loss) == float(run.work[-1])
    # Nothing is lost by what has not happened.
    for name, count in (("by_jump_in", run.jump_in_count), ("by_jump_off", run.jump_off_count)):
        changed = np.diff(run[f"dissipated_{name}"]) != 0
        assert np.all(np.diff(count)[changed] > 0)


def test_the_log_of_events_agrees_with_the_counts():
    run = few.united_run()
    assert int(run.coalescence_count[-1]) > 0 and int(run.split_count[-1]) > 0
    assert run.event_kind.attrs["flag_meanings"].split() == ["jump_in", "jump_off", "coalescence", "split"]
    counts = ("jump_in_count", "jump_off_count", "coalescence_count", "split_count")
    for kind, name in zip((JUMP_IN, JUMP_OFF, COALESCENCE, SPLIT), counts, strict=True):
        logged = np.bincount(run.event_step[run.event_kind == kind], minlength=run.sizes["step"])
        np.testing.assert_array_equal(np.cumsum(logged), run[name])
    assert np.all(np.diff(run.event_step) >= 0)
    np.testing.assert_array_equal(run.event_separation, run.mean_separation[run.event_step.values])
    # Single asperities jump in where they are, each once in one loading.
    surface, _ = few.small()
    summits = find_summits(surface).position
    inward = run.event_kind.values == JUMP_IN
    where = np.stack([run.event_x.values, run.event_y.values], axis=1)[inward]
    assert np.all(run.event_members.values[inward] == 1)
    nearest = np.min(np.linalg.norm(where[:, None] - summits, axis=2), axis=1)
    assert len(where) and np.all(nearest < 1e-12)
    assert len(np.unique(where, axis=0)) == len(where)


@pytest.mark.slow
def test_the_step_does_not_matter(monkeypatch):
    """Half the longest step, and half of the allowed errors of the work, change pull-off and loss by less than 1 %."""
    coarse = few.united_run()
    assert int(coarse.coalescence_count[-1]) > 0
    for name in ("ERROR_OVER_RELEASED", "UNION_STEP"):
        monkeypatch.setattr(step_accuracy, name, 0.5 * getattr(step_accuracy, name))
    fine = icha.simulate(*few.small(), Path([3.5e-2], unload=True, max_step=0.5 * DEFAULT_STEP))
    assert fine.sizes["step"] > coarse.sizes["step"]
    for name in ("pull_off_pressure", "hysteresis_loss"):
        assert float(fine[name]) == pytest.approx(float(coarse[name]), rel=0.01), name


@pytest.mark.parametrize("gained_and_lost", [(-1.0, 1.0001), (1.0001, -1.0)])
def test_jumps_that_nearly_cancel_lose_no_more_than_each_alone(gained_and_lost):
    """Where the range is long a jump into contact may be uphill; the two are not a share of what the step loses."""
    events = Events(np.array([JUMP_IN, JUMP_OFF]), np.zeros((2, 2)), np.ones(2, int), np.array(gained_and_lost))
    step = Step(
        0.1,
        work=0.6,
        stored=0.1,
        front=0.0,
        jump_error=0.0,
        may_change_pressure=True,
        events=events,
    )
    balance = EnergyBalance().add_step(few.contact_of([few.HEIGHT], period=1.0), step)
    assert (balance.jump_in, balance.jump_off) == pytest.approx(gained_and_lost)
    assert balance.jump_in + balance.jump_off + balance.unattributed == pytest.approx(0.5)
