"""Boundary elements on rough surfaces and waves: against Tamaas, symmetries, steps, energy, hopping fronts."""

import dataclasses

import numpy as np
import pytest

import icha
from icha import Material, Path, Surface, simulate
from icha.boundary_elements.contact import BoundaryElements
from icha.checks.run import check_run
from icha.contact.models import AREA_TOLERANCE_CELLS, REFERENCE_MODEL
from icha.path import step_accuracy
from validation.rough_contacts import (
    HARD,
    SOFT,
    by_cells_per_wave,
    by_steps,
    loop,
    rough,
    symmetries,
    towards_short_range,
    without_adhesion,
)


def test_without_adhesion_they_are_those_of_tamaas():
    """From first touch to 99 % of the area."""
    pytest.importorskip("tamaas")
    rows = list(without_adhesion(rough(96, 12), (2e-3, 0.146, 0.73, 1.05)))
    for row in rows:
        assert abs(row["separation_error"]) <= 1e-6 and row["gap_error"] <= 1e-6
        assert abs(row["area_error"]) <= 1e-4


@pytest.mark.parametrize("material", [HARD, SOFT], ids=["hard", "adhesive"])
def test_surface_shifted_reflected_or_turned_has_the_same_contact(material):
    for row in symmetries(rough(64, 8), 2.0, material):
        assert abs(row["pressure_error"]) <= 1e-5 and abs(row["area_error"]) <= 1e-5
        assert row["fraction_error"] <= (1e-3 if material is SOFT else 0)


def test_a_stop_is_the_same_in_five_and_in_fifty_steps():
    few = by_steps(rough(64, 8), 2.0, (5, 50))[-1]
    assert few["steps"] == 5
    assert abs(few["pressure_error"]) <= 1e-6 and abs(few["area_error"]) <= 1e-6 and few["fraction_error"] <= 1e-4


def test_a_load_is_met_with_the_same_area_in_one_step_and_in_several():
    """In a long step, cells may close for a moment, and must be free to open again."""
    surface = icha.SelfAffineSpectrum(1e-4, 1e-4, 1e-4 / 16, 0.8, 1.0).realise(128, 1)
    material = icha.Material(1e6, 1e-4, 1e-10)
    areas = []
    for loads in ([0.01, 0.1], np.geomspace(0.01, 0.1, 6).tolist()):
        run = icha.simulate(surface, material, icha.Path(loads, snapshots=[]), model="boundary_elements")
        areas.append(float(run.contact_area_fraction[-1]))
    assert areas[0] == pytest.approx(areas[1], rel=1e-5)


def test_loop_without_adhesion_gives_all_work_back():
    """But for the error of the integral of the pressure, whose slope jumps with every cell that closes."""
    row = loop(rough(48, 6), 1e-2, 0.2, HARD)
    assert abs(row["work"]) <= 1e-6 * row["largest_work"]
    assert abs(row["not_closed"]) <= 1e-10 * row["largest_work"]


@pytest.mark.slow
def test_loss_of_a_loop_with_adhesion_hardly_depends_on_the_step():
    coarse, fine = (loop(rough(64, 8), 1e-2, step) for step in (0.2, 0.1))
    for row in (coarse, fine):
        assert abs(row["not_closed"]) <= 1e-6 * row["largest_work"]
    assert coarse["work"] == pytest.approx(fine["work"], abs=1e-4 * fine["largest_work"])


@pytest.mark.slow
def test_losses_by_each_kind_of_event_hardly_depend_on_the_accuracy_of_the_work(monkeypatch):
    """The energies that lone patches would release are twice the losses, if the steps are long."""
    surface, material = rough(64, 8), dataclasses.replace(SOFT, surface_energy=4 * SOFT.surface_energy)
    coarse = loop(surface, 1e-2, 0.2, material)
    accuracy = dataclasses.replace(BoundaryElements.path_accuracy, work=1e-6)
    monkeypatch.setattr(BoundaryElements, "path_accuracy", accuracy)
    monkeypatch.setattr(step_accuracy, "ERROR_OVER_RELEASED", 0.01 * step_accuracy.ERROR_OVER_RELEASED)
    fine = loop(surface, 1e-2, 0.2, material)
    assert fine["steps"] > 2 * coarse["steps"] and fine["jump_in"] > 4e-4 * fine["largest_work"]
    for part in ("work", "jump_in", "jump_off", "coalescence", "unattributed"):
        assert coarse[part] == pytest.approx(fine[part], abs=1e-4 * fine["largest_work"])


def test_load_and_area_hardly_depend_on_the_grid():
    coarse, fine = by_cells_per_wave(12, (8, 16), (1.5,))
    assert coarse["reduced_pressure"] == pytest.approx(fine["reduced_pressure"], rel=0.005)
    assert coarse["area"] == pytest.approx(fine["area"], rel=0.01)


@pytest.mark.slow
def test_attraction_of_shorter_and_shorter_range_tends_to_the_limit():
    rows = towards_short_range(rough(96, 6, 16), (1.5,), ((800e-9, 1), (400e-9, 1)), 0.5)
    *finite, limit = rows
    for name in ("reduced_pressure", "energetic_area"):
        far, near = (abs(row[name] - limit[name]) for row in finite)
        assert near < far


def test_sphere_in_the_middle_between_four_cells_can_be_pulled_off():
    """Symmetric cells come to their limits together: the front must be let run when its equilibrium is lost."""
    x = np.arange(64) - 31.5
    surface = icha.Surface(-np.add.outer(x**2, x**2) * (1e-4 / 64) ** 2 / 4e-4, 1e-4)  # R = 200 um
    material = icha.Material(contact_modulus=1e6, surface_energy=1e-2, interaction_range=20e-9)
    path = icha.Path(reduced_pressures=[1e-3], unload=True, max_step=0.5)
    run = icha.simulate(surface, material, path, model="boundary_elements")
    pull_off = float(run.pull_off_pressure) * 1e-8
    assert pull_off == pytest.approx(1.5 * np.pi * 1e-2 * 200e-6, rel=0.01)
    assert float(run.loss_by_jump_off) > 0 and run.contact_area_fraction.values[-1] == 0


def test_adhesion_within_rounding_is_refused():
    surface = rough(64, 8)
    faint = dataclasses.replace(SOFT, surface_energy=1e-15, interaction_range=1e-15)
    with pytest.raises(ValueError, match="surface_energy: 1e-15 J/m\\^2 is too small"):
        icha.simulate(surface, faint, icha.Path([1e-3]), model="boundary_elements")


def test_density_of_pressures_counts_all_cells_in_contact_alike():
    """At the edge of contact, the grid does not know which part of a cell touches."""
    run = icha.simulate(rough(64, 8), HARD, icha.Path([1e-2]), model="boundary_elements")
    pressure = run.contact_pressure.values.astype(float)
    pressure = pressure[pressure > 0]
    part = float(run.contact_area_fraction[0]) * 64**2 / pressure.size
    content, _ = np.histogram(pressure / part, run.pressure_bin_edges)
    density = run.pressure_density.values[0] * np.diff(run.pressure_bin_edges)
    # Pressures in maps have single precision, so a cell may be in the next bin.
    assert np.abs(density - content * part / 64**2).sum() <= 4 * part / 64**2


def test_an_area_of_few_cells_is_met_to_two_of_them():
    """Without adhesion the area changes by whole cells, one at a time where contact is small."""
    surface = rough(64, 8)
    areas = [0.005, 0.02, 0.05]
    run = icha.simulate(surface, HARD, icha.Path(area_fractions=areas), model="boundary_elements")
    cells = np.abs(run.contact_area_fraction - areas) * surface.grid**2
    assert cells.max() <= AREA_TOLERANCE_CELLS
    assert not [check for check in check_run(run) if not check.passed]
    # Two cells are not a part of one.
    with pytest.raises(icha.ConvergenceError, match="lies inside a jump") as caught:
        icha.simulate(surface, HARD, icha.Path(area_fractions=[1e-4, 0.02]), model="boundary_elements")
    assert caught.value.dataset.step_target == [0.02]
    assert "one grid cell is 0.000244 of the nominal area, so use a finer grid" in str(caught.value)


def test_no_load_is_as_little_on_flat_surfaces_as_on_steep_ones():
    steep = icha.SelfAffineSpectrum(100e-6, 50e-6, 25e-6, 0.8, 1.0).realise(24, seed=1)
    factor = 1e-9 / steep.rms_slope
    surface = icha.Surface(steep.heights * factor, steep.period)
    material = icha.Material(25e6, 0.2 * factor**2, 2e-9 * factor)
    path = icha.Path([2e-3], turning_points=[("reduced_pressure", 0.0)], max_step=0.5)
    run = icha.simulate(surface, material, path, model="boundary_elements")
    assert not [check for check in check_run(run) if not check.passed]


PERIOD, HEIGHT, CELLS = 100e-6, 1e-6, 16


@pytest.mark.slow
def test_a_loop_whose_front_hops_takes_few_equilibria(monkeypatch):
    # No jump makes this contact, and no shorter step makes the work that is lost in hops better known.
    count, equilibrium = 0, BoundaryElements.equilibrium

    def counted(*arguments, **options):
        nonlocal count
        count += 1
        return equilibrium(*arguments, **options)

    monkeypatch.setattr(BoundaryElements, "equilibrium", counted)
    wave = np.cos(2 * np.pi * np.arange(CELLS) / CELLS)
    surface = Surface(HEIGHT * (wave[:, None] + wave), PERIOD, "periodic")
    path = Path(area_fractions=[0.2], unload=True, snapshots=[])
    run = simulate(surface, Material(1e6, 3e-3, 300e-9), path, model=REFERENCE_MODEL)
    assert count < 600
    assert not [check for check in check_run(run) if not check.passed]
