"""Works of adhesion by direction: JKR with one value on loading and another on unloading, and a front that stands."""

import numpy as np
import pytest

from icha import Material, Path, SelfAffineSpectrum, Surface, simulate
from icha.boundary_elements.laws import DirectedBonds, LinearBonds
from icha.references.indentation import sphere_contact
from icha.surfaces.shapes import Sphere
from validation.random_loops import follow_loop, random_works

MODULUS, RADIUS, ADVANCING = 2e6, 1e-3, 0.03
MODEL = "boundary_elements"


def bonds(before, ratio=3.0):
    closing = LinearBonds(np.arange(len(before)), 1.0, 2.0)
    return DirectedBonds(closing, closing.stronger(ratio), before)


def test_the_tension_is_the_slope_of_the_energy():
    before, gap = np.repeat([0.0, 0.3, 0.9, 1.0], 400), np.tile(np.linspace(1e-4, 4.0, 400), 4)
    law, step = bonds(before), 1e-6
    slope = (law.energy(gap + step) - law.energy(gap - step)) / (2 * step)
    np.testing.assert_allclose(slope, law.tension(gap), atol=1e-5)
    softening = -(law.tension(gap + step) - law.tension(gap - step)) / (2 * step)
    # Between two branches the slope of the tension jumps.
    assert np.mean(np.abs(softening - law.softening(gap)) < 1e-4) > 0.99


def test_a_closed_and_opened_cell_dissipates_the_difference_of_both_works():
    for fraction in (0.2, 0.7, 1.0):
        # Closing to a fraction gains its energy, and opening from there costs more.
        one, far = np.array([fraction]), np.array([10.0])
        closed = bonds(np.array([0.0])).closing.gap(one)
        gained = bonds(np.zeros(1)).energy(far) - bonds(np.zeros(1)).energy(closed)
        cost = bonds(one).energy(far) - bonds(one).energy(closed)
        np.testing.assert_allclose(cost - gained, 2.0 * fraction, rtol=1e-12)


def loop(cells, ratio, deep, grid=48):
    """Return a loop of a smooth sphere whose largest contact radius has about `cells` cells."""
    a = deep * (ADVANCING * RADIUS**2 / MODULUS) ** (1 / 3)
    side = grid * a / cells
    surface = Surface(np.zeros((grid, grid)), side, "free", Sphere(RADIUS))
    material = Material(MODULUS, (ADVANCING, ratio * ADVANCING), interaction_range=1e-9)
    depth = float(sphere_contact(a, RADIUS, MODULUS, ADVANCING).indentation)
    path = Path(indentations=[depth], unload=True, snapshots=[], max_step=0.1)
    return simulate(surface, material, path, model=MODEL)


def release_rate(run):
    """Return the energy release rate of each step from force and contact radius, J/m^2 (Johnson 1985, section 5.5)."""
    a, force = run["contact_radius"].values, run["force"].values
    with np.errstate(divide="ignore", invalid="ignore"):
        return (4 * MODULUS * a**3 / (3 * RADIUS) - force) ** 2 / (8 * np.pi * MODULUS * a**3)


@pytest.fixture(scope="module")
def sphere():
    return loop(cells=14, ratio=3, deep=2.5)


def test_a_sphere_advances_stands_and_recedes(sphere):
    run = sphere
    rate, leg, a = release_rate(run) / ADVANCING, run["leg"].values, run["contact_radius"].values
    touching = a > 0.5 * a.max()
    np.testing.assert_allclose(rate[touching & (leg == 0)], 1.0, atol=0.03)
    stands = (leg == 1) & (rate > 1.1) & (rate < 1.9)
    assert stands.sum() > 3
    np.testing.assert_allclose(a[stands], a.max(), rtol=1e-6)
    # The stiffness of a flat punch, 2 E* a.
    np.testing.assert_allclose(run["stiffness"].values[stands], 2 * MODULUS * a.max(), rtol=0.01)
    force, depth = (run[name].values[stands] for name in ("force", "indentation"))
    np.testing.assert_allclose(np.diff(force) / np.diff(depth), run["stiffness"].values[stands][1:], rtol=1e-6)
    recedes = touching & (leg == 1) & (a < 0.95 * a.max())
    np.testing.assert_allclose(rate[recedes], 3.0, rtol=0.02)


def test_pull_off_is_that_of_the_receding_value(sphere):
    run = sphere
    assert float(run["pull_off_force"]) == pytest.approx(1.5 * np.pi * 3 * ADVANCING * RADIUS, rel=0.01)
    assert float(run["pull_off_force_over_jkr"]) == pytest.approx(1, rel=0.01)


def test_the_loss_is_the_front_and_the_jumps(sphere):
    run = sphere
    area, front = float(run["largest_contact_area_fraction"]), float(run["front_dissipation"])
    assert front == pytest.approx(2 * ADVANCING * area, rel=0.01)
    assert abs(float(run["loss_unattributed"])) < 1e-3 * float(run["hysteresis_loss"])
    # The jump into contact at the advancing value, and out of contact at the receding value.
    assert float(run["loss_by_jump_in"]) > 0 and float(run["loss_by_jump_off"]) > 0
    assert not run.attrs.get("failed_checks") and not run.attrs.get("failed_loss_checks")


@pytest.mark.slow
def test_a_small_contact_pulls_off_like_a_punch():
    # With ten times the work, the front of a small contact never recedes before the tension is largest (Kendall 1971).
    run = loop(cells=14, ratio=10, deep=2.0)
    a = float(run["contact_radius"].max())
    expected = np.sqrt(8 * np.pi * MODULUS * 10 * ADVANCING * a**3) - 4 / 3 * MODULUS * a**3 / RADIUS
    assert float(run["pull_off_force"]) == pytest.approx(expected, rel=0.02)


def test_two_equal_values_are_one_value():
    assert Material(MODULUS, (ADVANCING, ADVANCING)) == Material(MODULUS, ADVANCING)
    with pytest.raises(ValueError, match=r"receding 0.02 J.*expected 0 < advancing"):
        Material(MODULUS, (ADVANCING, 0.02))
    with pytest.raises(ValueError, match=r"pair \(advancing, receding\)"):
        Material(MODULUS, (0.1, 0.2, 0.3))


@pytest.mark.parametrize("interaction_range", [pytest.param(1e-9, marks=pytest.mark.slow), 1e-6])
def test_fronts_of_a_rough_surface_dissipate_at_a_short_and_at_a_finite_range(interaction_range):
    surface = SelfAffineSpectrum(100e-6, 50e-6, 100e-6 / 6, 0.8, 0.35).realise(48, 1)
    material = Material(MODULUS, (ADVANCING, 2 * ADVANCING), interaction_range=interaction_range)
    run = simulate(surface, material, Path(reduced_pressures=[0.1], unload=True, snapshots=[]), model=MODEL)
    assert run.attrs["attraction"] == ("short range" if interaction_range < 1e-7 else "finite range")
    area, front = float(run["energetic_area_fraction"].max()), float(run["front_dissipation"])
    assert front > 0.9 * ADVANCING * area
    assert float(run["hysteresis_loss"]) > 0.99 * front
    assert not run.attrs.get("failed_checks") and not run.attrs.get("failed_loss_checks")


@pytest.mark.parametrize("number", [11, 14])
def test_random_loops_lose_what_their_receding_edges_dissipate(number):
    """All of them are run by `python -m validation.random_loops --works`; these have a map."""
    assert follow_loop(random_works(number)) == ""
