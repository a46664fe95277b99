"""Values of runs with an indenter: exact JKR loops, hulls and edges of exact figures, and what runs record."""

import math

import numpy as np
import pytest
import xarray as xr

import icha
from icha.boundary_elements.observables import hull_area
from icha.equilibrium.distributions import edge_share
from icha.figures.indenters import has_radius
from icha.references import indentation as closed
from icha.references.indenter_runs import apparent_work_of_adhesion, first_approach, loop_values, reason_without_fit
from icha.surfaces.shapes import Cone, Sphere

SIDE, MODULUS, RADIUS, ENERGY = 64e-6, 1e6, 1e-3, 0.05
SMOOTH = icha.Surface(np.zeros((64, 64)), SIDE, "free", Sphere(RADIUS))


def rows_of(states, leg, front=0.0):
    radius = np.asarray(states.contact_radius)
    columns = states.force, states.indentation, radius
    return [
        dict(force=f, indentation=d, contact_radius=a, leg=leg, dissipated_by_front=front)
        for f, d, a in zip(*columns, strict=True)
    ]


def test_loop_of_two_jkr_spheres_returns_their_works_of_adhesion():
    unit = float(closed.sphere_pull_off(RADIUS, MODULUS, ENERGY).contact_radius)
    into = closed.sphere_contact(unit * np.linspace(1.5, 4, 40), RADIUS, MODULUS, 0.6 * ENERGY)
    out = closed.sphere_contact(unit * np.linspace(4, 0.9, 400), RADIUS, MODULUS, ENERGY)
    rows = [
        *rows_of(into, 0),
        *rows_of(out, 1),
        {"force": 0.0, "indentation": 1.0, "contact_radius": 0.0, "leg": 1, "dissipated_by_front": 0.0},
    ]
    pull_off = -float(np.min(out.force))
    loop = {"pull_off_pressure": pull_off / SIDE**2, "hysteresis_loss": 0.003, "largest_contact_area_fraction": 0.2}
    values = loop_values(rows, loop, SMOOTH, icha.Material(MODULUS, ENERGY, 1e-9))
    assert values["pull_off_force"] == pytest.approx(pull_off)
    assert values["pull_off_force_over_jkr"] == pytest.approx(1.0, abs=1e-4)
    assert values["work_of_adhesion_approach"] == pytest.approx(0.6 * ENERGY, rel=1e-5)
    assert values["work_of_adhesion_retraction"] == pytest.approx(ENERGY, rel=1e-5)
    assert values["loss_over_contact"] == pytest.approx(0.003 / (0.2 * ENERGY))


def test_states_where_the_edge_stands_are_not_of_the_receding_work():
    unit = float(closed.sphere_pull_off(RADIUS, MODULUS, ENERGY).contact_radius)
    into = closed.sphere_contact(unit * np.linspace(1.5, 4, 40), RADIUS, MODULUS, 0.3 * ENERGY)
    # A punch between both works, then JKR with the receding one.
    stands = [
        closed.sphere_contact(np.array([4 * unit]), RADIUS, MODULUS, part * ENERGY) for part in np.linspace(0.3, 1, 20)
    ]
    out = closed.sphere_contact(unit * np.linspace(3.99, 0.9, 400), RADIUS, MODULUS, ENERGY)
    rows = [*rows_of(into, 0), *(rows_of(each, 1)[0] for each in stands), *rows_of(out, 1, 1e-3)]
    loop = {"pull_off_pressure": 1.0, "hysteresis_loss": 0.003, "largest_contact_area_fraction": 0.2}
    material = icha.Material(MODULUS, (0.3 * ENERGY, ENERGY), 1e-9)
    values = loop_values(rows, loop, SMOOTH, material)
    assert values["work_of_adhesion_approach"] == pytest.approx(0.3 * ENERGY, rel=1e-5)
    assert values["work_of_adhesion_retraction"] == pytest.approx(ENERGY, rel=1e-5)


def test_values_that_are_not_defined_are_left_out():
    loop = {"pull_off_pressure": 1.0, "hysteresis_loss": 0.0, "largest_contact_area_fraction": 0.1}
    rows = [{"force": -1.0, "indentation": 0.0, "contact_radius": 1e-6, "leg": 1, "dissipated_by_front": 0.0}]
    bare, sticky = icha.Material(MODULUS, 0.0, 1e-9), icha.Material(MODULUS, ENERGY, 1e-9)
    assert loop_values(rows, loop, SMOOTH, bare).keys() == {"pull_off_force"}
    assert "work_of_adhesion_retraction" not in loop_values(rows, loop, SMOOTH, sticky)
    cone = icha.Surface(np.zeros((64, 64)), SIDE, "free", Cone(math.radians(80)))
    values = loop_values(rows, loop, cone, sticky)
    assert values.keys() == {"pull_off_force", "loss_over_contact", "pull_off_force_over_theory"}
    # Maugis & Barquins: 54 w^2 tan^3(half angle)/(pi E*).
    known = 54 * ENERGY**2 * math.tan(math.radians(80)) ** 3 / (math.pi * MODULUS)
    assert values["pull_off_force_over_theory"] == pytest.approx(SIDE**2 / known)
    layer = icha.Material(MODULUS, ENERGY, 1e-9, thickness=1e-5)
    assert loop_values(rows, loop, SMOOTH, layer).keys() == {"pull_off_force", "loss_over_contact"}


def loop_of_sphere(states, interaction_range=1e-9):
    """Return the values of a loop that passes some states in loading and backwards in unloading."""
    rows = rows_of(states, 0)
    rows += [row | {"leg": 1} for row in reversed(rows)] + [
        rows_of(closed.sphere_contact(np.zeros(1), RADIUS, MODULUS), 1)[0] | {"indentation": 9.0}
    ]
    loop = {"pull_off_pressure": 1.0, "hysteresis_loss": 0.0, "largest_contact_area_fraction": 0.1}
    return loop_values(rows, loop, SMOOTH, icha.Material(MODULUS, ENERGY, interaction_range))


def test_jkr_is_fitted_to_spheres_with_a_tabor_parameter_of_three_or_more():
    unit = float(closed.sphere_pull_off(RADIUS, MODULUS, ENERGY).contact_radius)
    states = closed.sphere_contact(unit * np.linspace(1.1, 4, 40), RADIUS, MODULUS, ENERGY)
    reach = (RADIUS * (ENERGY / MODULUS) ** 2) ** (1 / 3)
    names = {"work_of_adhesion_approach", "work_of_adhesion_retraction"}
    assert names <= loop_of_sphere(states, interaction_range=reach / 3.01).keys()
    below = loop_of_sphere(states, interaction_range=reach / 2.9)
    assert not names & below.keys() and "pull_off_force_over_jkr" in below
    # A contact smaller than by Hertz has no fit.
    states = closed.sphere_contact(np.linspace(2e-6, 9e-6, 40), RADIUS, MODULUS)
    values = loop_of_sphere(states._replace(force=states.force + 0.3 * states.force.max()))
    assert not names & values.keys() and "pull_off_force_over_jkr" in values


def test_states_that_go_back_to_a_target_inside_a_jump_are_not_loading():
    """The branch beyond the pull-off force, which the path visits on the way to small contact radii, is not fitted."""
    unit = float(closed.sphere_pull_off(RADIUS, MODULUS, ENERGY).contact_radius)
    back, on = (
        rows_of(closed.sphere_contact(unit * np.linspace(*ends), RADIUS, MODULUS, ENERGY), 0)
        for ends in ((1.5, 0.7, 9), (0.8, 3.0, 30))
    )
    states = first_approach(back + on)
    assert states[0] == back[0] and all(row["contact_radius"] >= back[0]["contact_radius"] for row in states)
    material = icha.Material(MODULUS, ENERGY, 1e-9)
    assert apparent_work_of_adhesion(states, RADIUS, material) == pytest.approx(ENERGY, rel=1e-6)


@pytest.mark.parametrize(("reach", "count", "reason"), [(2.0, 9, "Tabor parameter 2 below 3"), (9, 2, "fewer than 3")])
def test_a_run_states_why_it_has_no_fit(reach, count, reason):
    states = closed.sphere_contact(np.linspace(9e-6, 1.2e-5, count), RADIUS, MODULUS, ENERGY)
    columns = {name: ("step", values) for name, values in states._asdict().items()} | {"leg": ("step", [0] * count)}
    columns["dissipated_by_front"] = "step", np.zeros(count)
    tabor = {"interaction_range": (RADIUS * (ENERGY / MODULUS) ** 2) ** (1 / 3) / reach}
    known = {"shape_radius": RADIUS, "contact_modulus": MODULUS, "surface_energy": ENERGY} | tabor
    run = xr.Dataset(columns | known | {"pull_off_force_over_jkr": 1.0})
    assert reason in reason_without_fit(run, "approach")
    assert not reason_without_fit(run.assign(work_of_adhesion_approach=ENERGY), "approach")


def test_hull_of_cells():
    grid = 20
    square = np.zeros((grid, grid), bool)
    square[3:8, 4:14] = True
    square[4:7, 5:13] = False  # a hole does not change the hull
    assert hull_area(np.flatnonzero(square), grid) == pytest.approx(50)
    assert hull_area(np.array([2, 17 * grid + 2]), grid) == pytest.approx(18)
    triangle = np.tril(np.ones((grid, grid), bool))
    assert hull_area(np.flatnonzero(triangle), grid) == pytest.approx(grid**2 / 2 + grid - 0.5)
    assert hull_area(np.zeros(0, int), grid) == 0


def test_share_of_discs_at_the_edges_of_a_square():
    """Cells of side 1 around nodes 0 to 9: the outermost cells end at 0.5 and 8.5."""
    assert edge_share(10.0, 10, np.array([[4.5, 4.5]]), np.array([4.0])) == pytest.approx(0, abs=1e-12)
    assert edge_share(10.0, 10, np.array([[0.5, 4.5]]), np.array([2.0])) == pytest.approx(0.5)
    assert edge_share(10.0, 10, np.array([[0.5, 8.5], [4.5, 4.5]]), np.array([1.0, 1.0])) == pytest.approx(0.375)
    assert edge_share(10.0, 10, np.zeros((0, 2)), np.zeros(0)) == 0


def test_run_of_a_smooth_sphere_has_the_values_of_jkr():
    energy = (4e-6) ** 3 * MODULUS / RADIUS**2  # four cells for (dgamma R^2/E*)^(1/3)
    material = icha.Material(MODULUS, energy, 1e-12)
    run = icha.simulate(SMOOTH, material, icha.Path(contact_radii=[9e-6], unload=True), model="boundary_elements")
    assert "failed_checks" not in run.attrs and run.attrs["applicability"] == ""
    assert str(run["shape"].values) == "sphere of radius 0.001 m" and run["shape_radius"] == RADIUS
    assert "layer_thickness" not in run and has_radius(run)
    assert not has_radius(run.assign(layer_thickness=1e-5)), "figures draw no curves of Hertz and JKR"
    # Boundary elements with few cells are accurate to a few per cent.
    accuracy = 0.03
    assert float(run["pull_off_force_over_jkr"]) == pytest.approx(1, abs=accuracy)
    assert float(run["work_of_adhesion_approach"]) == pytest.approx(energy, rel=2 * accuracy)
    assert float(run["work_of_adhesion_retraction"]) == pytest.approx(energy, rel=2 * accuracy)
    np.testing.assert_allclose(run["force"], run["nominal_pressure"] * SIDE**2)
    np.testing.assert_array_equal(run["indentation"], -run["mean_separation"])
    assert np.all(run["edge_contact"] == 0)
    touching = run["contact_radius"].values > 0
    excess = (run["hull_radius"] - run["contact_radius"]).values[touching] / SMOOTH.spacing
    assert np.all(run["hull_radius"].values[~touching] == 0)
    assert 0 < excess.min() and excess.max() < 1


def test_contact_at_the_edges_of_a_scan_is_said():
    x = np.linspace(-1, 1, 32)
    waves = 1e-7 * np.cos(np.arange(32) * np.pi / 4)
    bowl = icha.Surface(1e-6 * x**2 + waves + waves[:, None], 32e-6, "free")
    run = icha.simulate(
        bowl, icha.Material(MODULUS, 0.0, 1e-9), icha.Path(area_fractions=[0.02]), model="boundary_elements"
    )
    assert float(run["edge_contact"].max()) > 0.5
    assert "in the outermost cells of the square" in run.attrs["applicability"]


def test_asperities_refuse_shapes():
    with pytest.raises(ValueError, match=r"shape: the asperity model is only for nominally flat surfaces"):
        icha.simulate(SMOOTH, icha.Material(MODULUS, 0.0, 1e-9), icha.Path(forces=[1e-6]))
