"""Works of adhesion that differ from place to place."""

import numpy as np
import pytest

from icha import Material, Patches, Path, SelfAffineSpectrum, Stripes, Surface, simulate
from icha.boundary_elements.contact import contact_of
from icha.surfaces.shapes import Sphere
from validation.indenter_contacts import pinned_front

MODULUS, RADIUS, ENERGY, SIDE = 2e6, 1e-3, 0.03, 4e-4
GRID = 48
LENS = Surface(np.zeros((GRID, GRID)), SIDE, "free", Sphere(RADIUS))
PULL = Path(indentations=[3e-6], unload=True, snapshots=[])


def loop(energy, surface=LENS):
    run = simulate(surface, Material(MODULUS, energy, 1e-9), PULL, model="boundary_elements")
    assert not run.attrs.get("failed_checks") and not run.attrs.get("failed_loss_checks")
    return run


def test_stripes_have_their_widths_and_their_mean():
    field = Stripes(0.01, 0.05, 25e-6).on_nodes(32, 1e-4, periodic=True)
    np.testing.assert_array_equal(field[:8], 0.01)
    np.testing.assert_array_equal(field[8:16], 0.05)
    assert field.mean() == pytest.approx(Stripes(0.01, 0.05, 25e-6).mean)
    np.testing.assert_array_equal(Stripes(0.01, 0.05, 25e-6, "y").on_nodes(32, 1e-4, periodic=True), field.T)


def test_patches_have_mean_deviation_and_correlation():
    side, length = 1e-3, 2e-5
    fields = [Patches(0.03, 0.01, length, seed).on_nodes(256, side, periodic=True) for seed in range(4)]
    np.testing.assert_allclose([field.mean() for field in fields], 0.03, rtol=1e-12)
    np.testing.assert_allclose(np.mean([field.std() for field in fields]), 0.01, rtol=0.05)
    logs = [np.log(field) - np.log(field).mean() for field in fields]
    cells = round(length / side * 256)
    at_length = np.mean([np.mean(log * np.roll(log, cells, 0)) / np.mean(log**2) for log in logs])
    assert at_length == pytest.approx(np.exp(-((cells * side / 256 / length) ** 2)), abs=0.05)
    assert min(field.min() for field in fields) > 0


def test_a_uniform_map_is_one_work_of_adhesion():
    one, by_map = loop(ENERGY), loop(np.full((GRID, GRID), ENERGY))
    np.testing.assert_allclose(by_map["nominal_pressure"], one["nominal_pressure"], rtol=1e-7, atol=1e-9)
    assert by_map.attrs["adhesion_map"].startswith("NodeValues")


@pytest.mark.slow
def test_stripes_along_x_and_along_y_are_the_same_contact():
    x, y = (loop(Stripes(0.02, 0.04, SIDE / 16, along)) for along in ("x", "y"))
    np.testing.assert_allclose(x["hysteresis_loss"], y["hysteresis_loss"], rtol=1e-6)
    assert float(x["surface_energy"]) == pytest.approx(0.03)


@pytest.mark.slow
def test_contrast_adds_hysteresis_and_direction_adds_to_both():
    losses = [float(loop(energy)["hysteresis_loss"]) for energy in (ENERGY, Stripes(0.018, 0.042, SIDE / 16))]
    assert losses[1] > 1.01 * losses[0]
    run = loop((Patches(ENERGY, 0.005, 4e-5, 1), 3 * ENERGY))
    assert float(run["front_dissipation"]) > 1.9 * ENERGY * float(run["largest_contact_area_fraction"])


@pytest.mark.parametrize(("waves", "width"), [(3, 0), (2, 3.0)])
def test_the_front_moves_as_by_the_first_order_of_a_crack_front(waves, width):
    row = pinned_front(24, waves, width)
    assert abs(row["error"]) < 0.03 and abs(row["shift"]) > 0.25


def test_the_energy_of_a_state_is_right_to_its_slope():
    """Between two states without a jump, the work done is the change of the stored energy."""
    surface = SelfAffineSpectrum(1e-4, 5e-5, 1e-4 / 6, 0.8, 0.2).realise(48, 1)
    contact = contact_of(surface, Material(MODULUS, Patches(0.01, 0.004, 1e-5, 3), 1e-9))
    state = contact.equilibrium(contact.untouched(), 0.6 * surface.rms_height)
    states = [contact.equilibrium(state, (0.6 - 1e-4 * step) * surface.rms_height) for step in (0, 1)]
    work = np.mean([contact.pressure(each) for each in states]) * 1e-4 * surface.rms_height
    stored = contact.stored_energy(states[1]) - contact.stored_energy(states[0])
    assert stored == pytest.approx(work, rel=1e-3)


@pytest.mark.parametrize(
    ("energy", "message"),
    [
        (lambda: Stripes(0.05, 0.01, 1e-5), "expected 0 < low < high"),
        (lambda: np.zeros((GRID, GRID)), r"2304 of 2304 values of the map, the first \[0, 0\] = 0 J/m\^2"),
        (lambda: np.ones((GRID, 3)), r"the shape \(48, 3\); expected \(n, n\)"),
        (lambda: np.ones((3, 3)), r"expected \(48, 48\), a value for each node of the surface"),
        (lambda: Patches(0.03, 0.01, 1e-6), "correlation_length: 1e-06 m; expected two grid cells"),
    ],
)
def test_maps_that_do_not_fit_are_refused(energy, message):
    with pytest.raises(ValueError, match=message):
        contact_of(LENS, Material(MODULUS, energy(), 1e-9))
    surface = SelfAffineSpectrum(1e-4, 5e-5, 1e-5, 0.8, 0.2).realise(64, 1)
    with pytest.raises(ValueError, match=r"width: 3e-05 m does not divide the period 0.0001 m"):
        contact_of(surface, Material(MODULUS, Stripes(0.01, 0.02, 3e-5), 1e-9))
