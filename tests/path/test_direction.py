"""Asperities whose edges advance at one work of adhesion and recede at a larger one.

A sphere loads along JKR with the advancing work, stands as a flat punch of the stiffness 2 E* a, and unloads along JKR
with the receding work. Units: modulus, radius and advancing work of adhesion are 1.
"""

import few_asperities as few
import numpy as np
import pytest
from half_space import jkr_approach, jkr_force

import icha
from icha import Material, Path
from icha.asperity.directed_jkr import DirectedJKR
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.surfaces.summits import Asperities
from validation.surfaces import paraboloid


def directed(ratio, heights=(few.HEIGHT,), positions=((0.5, 0.5),)):
    """A contact of asperities with a receding work of adhesion `ratio`."""
    asperities = Asperities(np.array(positions) + few.FAR / 2, np.array(heights), np.ones(len(heights)), few.FAR)
    law = DirectedJKR(Material(1.0, (1.0, ratio), 1 / few.TABOR))
    return InteractingAsperities(law, asperities, few.RMS_HEIGHT, 1e3 / few.FAR**2)


def loop(ratio, stops, **settings):
    """Arrays along a loop of one sphere: leg, approach, contact radius, force, stiffness; and its last waypoint."""
    contact = directed(ratio)
    waypoints = few.travelled(contact, stops, unload=True, **settings)
    rows = [
        (w.leg, few.HEIGHT - w.state.separation, w.state.spots.contact_radius[0], few.load(contact, w),
         contact.stiffness(w.state) * contact.area)
        for w in waypoints if len(w.state.spots)
    ]  # fmt: skip
    few.closed_again(waypoints)
    return contact, *np.array(rows).T, waypoints[-1]


@pytest.mark.parametrize(("ratio", "stop"), [(3.0, 0.03), (10.0, 0.003), (1 + 1e-9, 0.01)])
def test_a_sphere_advances_stands_and_recedes(ratio, stop):
    contact, leg, d, a, force, stiffness, last = loop(ratio, [stop])
    largest, jump_off, pull_off = a.max(), np.cbrt(np.pi * ratio / 8), np.cbrt(np.pi * ratio * 9 / 8)
    turn = jkr_approach(largest, 1.0, 1.0, ratio)
    # Approaches have an error of up to 1e-6.
    stands, recedes = (leg == 1) & (d > turn + 1e-6), (leg == 1) & (d < turn - 1e-6)
    for branch, work in ((leg == 0, 1.0), (recedes, ratio)):
        np.testing.assert_allclose(jkr_approach(a[branch], 1.0, 1.0, work), d[branch], atol=1e-6)
        np.testing.assert_allclose(force[branch], jkr_force(a[branch], 1.0, 1.0, work), rtol=1e-9, atol=1e-9)
    if ratio > 2:
        assert stands.sum() > 3
        np.testing.assert_allclose(a[stands], largest, rtol=1e-12)
        np.testing.assert_allclose(stiffness[stands], 2 * largest, rtol=1e-9)
        np.testing.assert_allclose(force[stands] - force.max(), 2 * largest * (d[stands] - d.max()), atol=1e-8)
    # Pull-off of JKR or, from a smaller contact, of Kendall's punch.
    weakest = jkr_force(min(largest, pull_off), 1.0, 1.0, ratio)
    assert force.min() == pytest.approx(weakest, rel=1e-7)
    assert (weakest == pytest.approx(-1.5 * np.pi * ratio)) == (largest > pull_off)
    # The loop loses the difference of both works at the edge, and the jumps; the receding law stores the jump's energy.
    balance, area = last.balance, contact.area
    assert balance.front * area == pytest.approx((ratio - 1) * np.pi * largest**2, rel=1e-9, abs=1e-12)
    stored = contact.law.receding.energy(min(largest, jump_off), 1.0)
    assert balance.jump_off * area == pytest.approx(stored, rel=1e-5)
    assert abs(balance.unattributed) < 2e-4 * balance.work


def test_a_smaller_contact_than_at_jump_off_breaks_as_a_punch():
    contact, _leg, d, a, force, _stiffness, last = loop(100.0, [0.001])
    assert a.max() < np.cbrt(100 * np.pi / 8)
    lowest = jkr_approach(a.max(), 1.0, 1.0, 100.0)
    assert d.min() == pytest.approx(lowest, abs=1e-3)
    assert force.min() == pytest.approx(jkr_force(a.max(), 1.0, 1.0, 100.0), rel=1e-4)
    assert last.balance.front * contact.area == pytest.approx(99 * np.pi * a.max() ** 2, rel=1e-9)


def test_an_edge_stands_between_turning_points():
    """A reload goes back along the same straight line, and advances again from the state where it stood."""
    turns = [("reduced_pressure", 0.0), ("reduced_pressure", 0.04)]
    contact, leg, _d, a, force, _stiffness, last = loop(3.0, [0.02], turning_points=turns, max_step=0.05)
    first = a[leg == 0].max()
    for each in (1, 2):
        stood = (leg == each) & (force < 19.9)
        assert stood.sum() >= 3
        np.testing.assert_allclose(a[stood], first, rtol=1e-12)
    assert last.balance.front * contact.area == pytest.approx(2 * np.pi * a.max() ** 2, rel=1e-9)


def test_one_work_is_the_limit_of_two():
    runs = [
        icha.simulate(paraboloid(48, 24.0), Material(1.0, energy, 1 / few.TABOR), Path([1e-3], unload=True))
        for energy in (1.0, (1.0, 1 + 1e-9))
    ]
    for name in ("pull_off_pressure", "hysteresis_loss", "largest_contact_area_fraction"):
        assert float(runs[1][name]) == pytest.approx(float(runs[0][name]), rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("control", ["separation", "load"])
def test_a_rough_surface_loses_what_its_fronts_dissipate_and_its_jumps(control):
    surface, material = few.small()
    work = material.surface_energy
    two = Material(material.contact_modulus, (work, 4 * work), material.interaction_range)
    turns = [("reduced_pressure", 0.0), ("reduced_pressure", 1e-2)]
    run = icha.simulate(surface, two, Path([2e-3], unload=True, control=control, turning_points=turns))
    loss, scale = float(run.hysteresis_loss), float(np.abs(run.work).max())
    assert float(run.front_dissipation) == float(run.dissipated_by_front[-1])
    assert loss >= float(run.front_dissipation) - 1e-3 * scale
    # The area that adhered at the largest load has receded at least once.
    assert float(run.front_dissipation) >= 3 * work * float(run.largest_contact_area_fraction) * (1 - 1e-9)
    assert np.all(np.diff(run.dissipated_by_front) >= 0)
    # The work is stored or lost at every step; what is left is the error of the interaction.
    lost = sum(run[f"dissipated_by_{name}"] for name in ("jump_in", "jump_off", "coalescence", "load_jump", "front"))
    np.testing.assert_allclose((run.work - run.stored_energy - lost) / scale, 0.0, atol=0.01)
    assert abs(float(run.loss_unattributed)) < 0.01 * scale


@pytest.mark.slow
def test_spots_unite_split_and_separate_at_two_works():
    surface, material = few.small()
    work = material.surface_energy
    two = Material(material.contact_modulus, (work, 2 * work), material.interaction_range)
    run = icha.simulate(surface, two, Path([3.5e-2], unload=True))
    assert int(run.coalescence_count[-1]) > 0 and int(run.spot_count[-1]) == 0
    assert float(run.pull_off_pressure) > float(few.united_run().pull_off_pressure)


def test_a_map_is_refused():
    surface, material = few.small()
    patterned = Material(material.contact_modulus, np.full((32, 32), 1e-3) + np.eye(32) * 1e-3)
    with pytest.raises(ValueError, match=r"same work of adhesion at every place\. Use boundary elements"):
        icha.simulate(surface, patterned, Path([1e-2]))
