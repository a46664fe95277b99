"""Full contact as a state: its closed form, how contact gets there under load, and where it opens again."""

import numpy as np
import pytest

import icha
from icha.boundary_elements.contact import contact_of
from icha.checks.run import RESIDUAL_LIMIT, check_run
from icha.contact.model import PRESSURE, Control
from validation.closed_forms import Sinusoid
from validation.random_loops import follow_loop, random_loop
from validation.rough_contacts import HARD, rough
from validation.surfaces import wave

AMPLITUDE = 0.02


def sinusoid(alpha, reach, grid=64):
    """Contact of a wave of wavelength 1 and its closed form, with Johnson's alpha and the range over the amplitude."""
    material = icha.Material(1.0, (alpha * np.pi * AMPLITUDE) ** 2 / 2, reach * AMPLITUDE)
    return contact_of(wave(grid, 1.0, AMPLITUDE), material), Sinusoid(material, AMPLITUDE, 1.0)


def test_full_contact_is_closed_form():
    contact, exact = sinusoid(0.3, 0.05)
    state = contact.full_contact(1.5 * exact.full_contact_pressure)
    assert contact.pressure(state) == pytest.approx(1.5 * exact.full_contact_pressure)
    assert contact.area_fraction(state) == 1 and contact.stiffness(state) == np.inf
    assert np.abs(contact.gap(state)).max() < 1e-12 * AMPLITUDE
    elastic = exact.full_contact_pressure * AMPLITUDE / 4
    energy = exact.material.surface_energy
    assert contact.stored_energy(state) == pytest.approx(elastic - energy, abs=2e-4 * elastic)


def test_johnson_s_wave_from_first_touch_to_full_contact_and_out():
    contact, exact = sinusoid(0.3, 0.05)
    unit = exact.full_contact_pressure
    state = contact.equilibrium(contact.untouched(), 0.6 * AMPLITUDE)
    for load in (0.2, 0.3):
        state = contact.equilibrium(state, state.separation, Control(PRESSURE, load * unit))
        psi = np.pi / 2 * contact.area_fraction(state)
        assert exact.pressure(psi) == pytest.approx(load * unit, abs=0.01 * unit)
    # The curve of the closed form has its maximum at a lower load than this one.
    state = contact.equilibrium(state, state.separation, Control(PRESSURE, 0.6 * unit))
    assert contact.is_full(state) and contact.pressure(state) == pytest.approx(0.6 * unit)
    # Full contact bears tension up to the strength of the interface at the trough, where the wave tears with p*.
    opening = unit - exact.material.theoretical_strength
    assert contact.opening_pressure == pytest.approx(opening, abs=1e-4 * unit)
    state = contact.equilibrium(state, 0.0, Control(PRESSURE, 0.999 * opening))
    assert contact.is_full(state)
    state = contact.equilibrium(state, 0.01 * AMPLITUDE)
    assert contact.is_full(state) and contact.pressure(state) == pytest.approx(opening, abs=1e-4 * unit)
    for separation in (0.01, 0.1, 0.4, 0.8):
        state = contact.equilibrium(state, separation * AMPLITUDE)
        assert 0 < contact.area_fraction(state) < 1
    assert contact.pressure(state) == pytest.approx(
        float(exact.pressure(np.pi / 2 * contact.area_fraction(state))), abs=0.01 * unit
    )


@pytest.mark.slow
def test_without_adhesion_contact_closes_at_the_largest_tension_of_full_contact():
    surface = rough(48, 6)
    contact = contact_of(surface, HARD)
    closing = contact.opening_pressure / contact.pressure_unit
    path = icha.Path([0.1, 0.99 * closing, 1.01 * closing], unload=True, snapshots=[])
    run = icha.simulate(surface, HARD, path, model="boundary_elements")
    area = run.contact_area_fraction.values[run.step_kind.values == "reduced_pressure"]
    assert area[1] < 1 == area[2]
    # Cells without pressure may count as contact in one direction only, so unloading divides other steps.
    assert abs(float(run.hysteresis_loss)) <= 1e-6 * float(abs(run.work).max())
    assert not [check for check in check_run(run) if not check.passed]


def test_sticky_surface_closes_and_opens_at_the_strength_of_its_interface():
    surface = rough(48, 6)
    material = icha.Material(25e6, 0.15, 500e-9)
    contact = contact_of(surface, material)
    path = icha.Path([0.1, 2.5], unload=True, snapshots=[])
    run = icha.simulate(surface, material, path, model="boundary_elements")
    full = run.contact_area_fraction.values == 1
    assert full.any() and run.contact_area_fraction.values[-1] == 0
    lowest = float(run.nominal_pressure.values[full].min())
    assert lowest == pytest.approx(max(contact.opening_pressure, lowest), abs=1e-6 * contact.pressure_unit)
    assert not [check for check in check_run(run) if not check.passed]


def test_targets_beyond_asperities_are_for_boundary_elements_only():
    surface = rough(48, 6)
    with pytest.raises(ValueError, match=r"path: reduced_pressure: .*where the asperity model holds"):
        icha.simulate(surface, HARD, icha.Path([0.2]))
    with pytest.raises(icha.ConvergenceError, match=r"before reduced_pressure = 0\.2, which is outside") as caught:
        icha.simulate(surface, HARD, icha.Path([0.05, 0.1, 0.2], unload=True))
    reached = caught.value.dataset
    assert reached.attrs["beyond_model"] and "incomplete" not in reached.attrs
    assert float(reached.reduced_pressure[-1]) == pytest.approx(0.1)
    run = icha.simulate(surface, HARD, icha.Path([0.2]), model="boundary_elements")
    assert float(run.reduced_pressure[0]) == pytest.approx(0.2)


def test_full_contact_opens_at_the_strength_of_its_flaw():
    at = np.arange(32) / 32 * 2 * np.pi
    wave = icha.Surface(1e-6 * np.add.outer(0 * at, np.cos(at)), 1e-5)
    material = icha.Material(1e6, 0.2, 1e-8, flaw_radius=1e-6)
    run = icha.simulate(wave, material, icha.Path([0.01, 1.0], unload=True), model="boundary_elements")
    flaw = np.sqrt(np.pi * 1e6 * 0.2 / (2 * 1e-6))
    assert float(run.interface_strength) == pytest.approx(flaw) and flaw < float(run.theoretical_strength)
    opening = float(run.complete_contact_pressure) - flaw
    full = run.contact_area_fraction.values == 1
    assert float(run.nominal_pressure.values[full].min()) == pytest.approx(opening, rel=1e-6)


@pytest.mark.parametrize("number", [1, 5])
def test_random_loops_end(number):
    """All of them are run by `python -m validation.random_loops`."""
    assert follow_loop(random_loop(number, grid=48)) == ""


def test_the_residual_is_small_where_the_critical_opening_exceeds_the_rms_height():
    """A sticky Gaussian pit: errors of displacements are relative to the smaller of both heights."""
    x = (np.arange(32) - 16) / 32
    heights = -1e-6 * np.exp(-(x[:, None] ** 2 + x**2) / 2 / 0.08**2)
    surface, material = icha.Surface(heights, 100e-6), icha.Material(1e6, 0.8, 1e-8)
    contact = contact_of(surface, material)
    assert contact.attraction.reach * contact.spacing > 5 * surface.rms_height
    path = icha.Path(mean_separations=[0.2 * surface.rms_height])
    run = icha.simulate(surface, material, path, model="boundary_elements")
    assert "failed_checks" not in run.attrs and float(run["residual"].max()) < RESIDUAL_LIMIT
