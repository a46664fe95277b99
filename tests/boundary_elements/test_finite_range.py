"""Boundary elements at a range of attraction that the grid resolves."""

import numpy as np
import pytest
from scipy.optimize import minimize

import icha
from icha.boundary_elements.contact import contact_of
from icha.boundary_elements.elastic import HalfSpace
from icha.boundary_elements.laws import Cohesive
from icha.boundary_elements.minimise import Control, Problem, minimise
from icha.checks.run import check_run
from icha.contact.attraction import FINITE_RANGE, SHORT_RANGE, attraction_on, resolving_spacing
from validation.surfaces import wave

MODULUS, ENERGY, RADIUS = 1e6, 0.05, 1e-4
# Contact radius and indentation of a sphere with adhesion, in the units of Johnson, Kendall and Roberts, m.
LENGTH, UNIT = (ENERGY * RADIUS**2 / MODULUS) ** (1 / 3), (ENERGY**2 * RADIUS / MODULUS**2) ** (1 / 3)


def sphere_loop(tabor, grid, side):
    """Press a paraboloid on a square with a side in units of LENGTH, and pull it off."""
    shape = icha.Paraboloid((RADIUS, RADIUS))
    surface = icha.Surface(np.zeros((grid, grid)), side * LENGTH, "free", shape)
    material = icha.Material(MODULUS, ENERGY, UNIT / tabor)
    path = icha.Path(indentations=[0.3 * UNIT], unload=True, snapshots=[])
    return icha.simulate(surface, material, path, model="boundary_elements")


@pytest.mark.parametrize(("tabor", "grid", "side", "expected"), [(0.3, 48, 10, 1.824), (1.0, 40, 8, 1.615)])
def test_pull_off_of_a_sphere_is_between_jkr_and_dmt(tabor, grid, side, expected):
    """The values are those of the same law on finer grids, with limits of 1.5 (JKR) and 2 (DMT)."""
    run = sphere_loop(tabor, grid, side)
    assert run.attrs["attraction"] == FINITE_RANGE
    assert float(run.pull_off_force) / (np.pi * ENERGY * RADIUS) == pytest.approx(expected, rel=5e-3)
    assert not [check for check in check_run(run) if not check.passed]
    if tabor < 0.5:
        # Without a jump no energy is lost.
        assert abs(float(run.hysteresis_loss)) < 1e-3 * float(abs(run.work).max())


def test_rough_contact_has_the_energy_that_an_independent_minimiser_finds():
    grid = 48
    surface = icha.SelfAffineSpectrum(1e-4, 2e-5, 1e-4 / 6, 0.8, 0.1).realise(grid, 1)
    energy = 0.002
    tabor = (energy**2 * surface.summit_radius / MODULUS**2) ** (1 / 3) / 0.3
    material, loads = icha.Material(MODULUS, energy, tabor), [0.003, 0.03]
    contact = contact_of(surface, material)
    assert isinstance(contact.attraction, Cohesive)
    run = icha.simulate(surface, material, icha.Path(loads, snapshots=[]), model="boundary_elements")
    h, length, reach = contact.cell_heights, contact.attraction.adhesion_length, contact.attraction.reach
    for k in range(len(loads)):
        load = float(run.nominal_pressure[k]) / MODULUS

        def energy_and_gradient(gap, load=load):
            gap = gap.reshape(h.shape)
            pressure, f = contact.space.pressure(gap + h), np.clip(1 - gap / reach, 0, 1)
            energy = 0.5 * np.vdot(gap + h, pressure) - length * np.sum(f**2) + load * gap.sum()
            return energy, (pressure + load + 2 * length / reach * f).ravel()

        start = np.maximum(float(run.mean_separation[k]) / contact.spacing - h, 0).ravel()
        limits, options = [(0, None)] * h.size, {"maxiter": 5000, "ftol": 1e-16, "gtol": 1e-10, "maxcor": 50}
        found = minimize(energy_and_gradient, start, jac=True, method="L-BFGS-B", bounds=limits, options=options)
        assert float(run.mean_separation[k]) / contact.spacing == pytest.approx(found.x.mean(), rel=1e-6)


def test_full_contact_of_a_resolved_strength_opens_at_this_strength():
    """Johnson's wave: contact is complete at p*, and opens where the trough bears the strength, p*/2."""
    surface, top = wave(64, 1e-3, 1e-5), np.pi * MODULUS * 1e-5 / 1e-3
    energy = (0.2 * np.pi * 1e-2 / np.sqrt(2)) ** 2 * MODULUS * 1e-3
    material = icha.Material(MODULUS, energy, 2 * 16 * energy / (9 * np.sqrt(3) * top))
    assert material.interface_strength == pytest.approx(top / 2)
    path = icha.Path(pressures=[0.1 * top, 1.2 * top], unload=True, snapshots=[])
    run = icha.simulate(surface, material, path, model="boundary_elements")
    full = (run.leg.values == 1) & (run.contact_area_fraction.values == 1)
    assert run.nominal_pressure.values[full].min() == pytest.approx(0.5 * top, rel=1e-2)


def test_a_grid_resolves_the_range_up_to_the_resolving_spacing():
    material = icha.Material(MODULUS, ENERGY, UNIT)
    spacing = resolving_spacing(material)
    assert attraction_on(material, 0.99 * spacing) == FINITE_RANGE
    assert attraction_on(material, 1.01 * spacing) == SHORT_RANGE


def test_contact_of_ridges_leaves_room_for_the_gap():
    """The discs of new contact at all summits of a ridge would cover the whole surface."""
    x, y = np.meshgrid(np.arange(128), np.arange(128))
    length = 1e-3 / 5
    surface = icha.Surface(length / 100 * np.cos(2 * np.pi * (3 * x + 4 * y) / 128 + 0.37), 1e-3)
    top = np.pi * MODULUS / 100
    energy = (0.1 * np.pi / 100 / np.sqrt(2)) ** 2 * MODULUS * length
    material = icha.Material(MODULUS, energy, 0.05 * 16 * energy / (9 * np.sqrt(3) * top))
    run = icha.simulate(surface, material, icha.Path(pressures=[0.1 * top], snapshots=[]), model="boundary_elements")
    assert 0.2 < float(run.contact_area_fraction[-1]) < 0.35


@pytest.mark.parametrize(("work", "reach", "mean_gap", "part"), [(3, 3, 0.05, 0.03), (8, 20, 0.0145, 0.03)])
def test_gaps_of_rounding_do_not_count_as_open(work, reach, mean_gap, part):
    """Close to full contact, all gaps are in a few cells. In the start, half of the other cells have tiny gaps."""
    surface = icha.SelfAffineSpectrum(1e-4, 5e-5, 6e-4 / 32, 0.8, 1.0).realise(32, 0)
    heights = surface.heights / surface.rms_height * 2.3
    rng, law = np.random.default_rng(0), Cohesive(work, 2 * work / reach)
    deep = (heights < np.quantile(heights, part)).astype(float)
    space, control = HalfSpace.under(32), Control(mean=heights.mean() + mean_gap)
    positions = [heights + deep * mean_gap / deep.mean()]
    positions.append(positions[0] + 1e-14 * rng.random(heights.shape) * (rng.random(heights.shape) < 0.5))
    found = [minimise(Problem(space, law, heights), each, 0 * each + 1, control, 1e-8) for each in positions]
    assert found[0].load == pytest.approx(found[1].load, rel=1e-6)
    assert np.array_equal(found[0].held, found[1].held)


def test_a_reversible_loop_has_no_losses_by_kind_of_event():
    """A sphere at a Tabor parameter of 0.2 touches and separates gradually: no event loses energy."""
    surface = icha.Surface(np.zeros((32, 32)), period=60e-6, boundary="free", shape=icha.Sphere(100e-6))
    material = icha.Material(2e6, 5e-3, interaction_range=4e-7)
    run = icha.simulate(surface, material, icha.Path(forces=[3e-6], unload=True), model="boundary_elements")
    assert int(run["jump_in_count"][-1]) > 0
    scale = float(np.abs(run["work"]).max())
    for part in ("by_jump_in", "by_jump_off", "by_coalescence", "unattributed"):
        assert abs(float(run[f"loss_{part}"])) < 1e-4 * scale
