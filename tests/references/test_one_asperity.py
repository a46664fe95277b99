"""One asperity by the model and by boundary elements: what the dataset holds.

That the two agree is tested in test_finite_range.py, at a Tabor parameter large enough for it.
"""

import numpy as np
import pytest
from half_space import jkr_force

import icha
from icha.asperity.cohesive_zone import MAX_STRENGTH_NUMBER
from icha.asperity.material import Material
from icha.datasets.files import read_dataset, write_dataset
from icha.references.finite_range import contact_state, perimeter_correction, states_at_mean_separations
from validation.one_asperity import hertz_asperity, one_asperity, resolving_grid
from validation.surfaces import paraboloid

PERIOD = 10.0


def at(tabor_parameter, **settings):
    return one_asperity(tabor_parameter, **{"approaches": [3.0, 1.5], "period": PERIOD} | settings)


@pytest.fixture(scope="module")
def long_ranges():
    """Ranges of attraction too long for the model's law, the longer first."""
    return [at(1.25), at(2.0)]


@pytest.fixture(scope="module")
def hertzian():
    return hertz_asperity(grid=128, period=PERIOD)


def test_the_grid_is_the_coarsest_of_its_kind_that_resolves_the_range(long_ranges):
    """The strength number falls as the root of the spacing; numbers of factors 2, 3 and 5 lie close."""
    for one in long_ranges:
        assert 0.95 * MAX_STRENGTH_NUMBER < one.strength_number < MAX_STRENGTH_NUMBER
        assert one.strength_number == pytest.approx(float(one.tabor_parameter * np.sqrt(PERIOD / one.grid)))
    assert resolving_grid(Material(1.0, 1.0, 1 / 4), 12.0) == 800  # at 768 it is one half


def test_spots_obey_the_law_at_given_approach_and_at_given_load(long_ranges, hertzian):
    """Force and area belong together, and at given load the force is the boundary elements'."""
    for one in (*long_ranges, hertzian):
        radius = np.sqrt(one.area_icha / np.pi)
        np.testing.assert_allclose(jkr_force(radius, 1, 1, one.surface_energy), one.force_icha, rtol=1e-6)
        radius = np.sqrt(one.area_icha_at_load / np.pi)
        np.testing.assert_allclose(jkr_force(radius, 1, 1, one.surface_energy), one.given_load, rtol=1e-6)


def test_a_run_comes_to_the_same_states(long_ranges, hertzian):
    """Pressed on to a given mean separation with adhesion, to a given load as well without."""
    one = long_ranges[0]
    surface = paraboloid(int(one.grid), PERIOD)
    path = icha.Path(mean_separations=[float(surface.heights.max() - one.approach[0])])
    run = icha.simulate(surface, Material(1.0, 1.0, 1 / 1.25), path).isel(step=-1)
    assert run.contact_area_fraction * PERIOD**2 == pytest.approx(float(one.area_icha[0]), rel=1e-6)
    assert run.nominal_pressure * PERIOD**2 == pytest.approx(float(one.force_icha[0]), rel=1e-6)
    surface, material = paraboloid(128, PERIOD), Material(1.0, 0.0, 1.0)
    separation = float(surface.heights.max() - hertzian.approach[0])
    load = float(hertzian.given_load[0]) / PERIOD**2 / surface.rms_slope
    at_gap, at_load = (
        icha.simulate(surface, material, path).isel(step=-1)
        for path in (icha.Path(mean_separations=[separation]), icha.Path([load]))
    )
    assert at_gap.contact_area_fraction * PERIOD**2 == pytest.approx(float(hertzian.area_icha[0]), rel=1e-6)
    assert at_load.contact_area_fraction * PERIOD**2 == pytest.approx(float(hertzian.area_icha_at_load[0]), rel=1e-6)
    assert at_load.mean_separation == pytest.approx(
        surface.heights.max() - float(hertzian.approach_icha_at_load[0]), rel=1e-6
    )


def test_errors_are_those_of_the_stored_values(long_ranges):
    for one in long_ranges:
        unit = np.maximum(np.abs(one.force_boundary_elements), 1.5 * np.pi)
        np.testing.assert_allclose(one.force_error * unit, one.force_icha - one.force_boundary_elements, atol=1e-12)
        np.testing.assert_allclose((1 + one.energetic_area_error) * one.energetic_area, one.area_icha)
        np.testing.assert_allclose((1 + one.zero_gap_area_error) * one.zero_gap_area, one.area_icha)
        np.testing.assert_allclose(
            (1 + one.energetic_area_error_at_load.values) * one.energetic_area.values[:2], one.area_icha_at_load
        )
        np.testing.assert_allclose(
            (1 + one.zero_gap_area_error_at_load.values) * one.zero_gap_area.values[:2], one.area_icha_at_load
        )
        np.testing.assert_allclose(one.approach_icha_at_load - one.approach_error_at_load, [3.0, 1.5])
        np.testing.assert_array_equal(one.given_load, one.force_boundary_elements[:2])
        assert one.pull_off_error == pytest.approx(1 + float(one.force_boundary_elements.min()) / (1.5 * np.pi))


def test_boundary_elements_are_what_they_are_by_themselves(long_ranges, hertzian):
    one = long_ranges[0]
    surface, material = paraboloid(int(one.grid), PERIOD), Material(1.0, 1.0, 1 / 1.25)
    (state,) = states_at_mean_separations(surface, material, [surface.heights.max() - 1.5], tolerance=1e-8)
    assert one.force_boundary_elements[1] == pytest.approx(state.nominal_pressure * PERIOD**2, abs=1e-3)
    area = np.exp(-state.gap / material.interaction_range).mean() * PERIOD**2
    assert one.energetic_area[1] == pytest.approx(area, rel=1e-4)
    surface = paraboloid(128, PERIOD)
    state = contact_state(surface, Material(1.0, 0.0, 1.0), 4 / 3 / PERIOD**2 / surface.rms_slope)
    assert hertzian.zero_gap_area[0] == pytest.approx(perimeter_correction(state.contact)[0] * PERIOD**2)
    assert hertzian.approach[0] == pytest.approx(surface.heights.max() - state.mean_separation, rel=1e-5)


def test_tension_is_largest_where_the_model_has_it(long_ranges):
    """On either side of the approach of pull-off boundary elements pull less."""
    one = long_ranges[0]
    surface, material = paraboloid(int(one.grid), PERIOD), Material(1.0, 1.0, 1 / 1.25)
    approaches = float(one.approach[-1]) + np.array([0.3, 0.0, -0.3])
    states = states_at_mean_separations(surface, material, surface.heights.max() - approaches, tolerance=1e-6)
    above, there, below = (-state.nominal_pressure * PERIOD**2 for state in states)
    assert there > above and there > below
    assert there == pytest.approx(float(one.pull_off_force_boundary_elements), rel=1e-4)


@pytest.mark.parametrize("name", ["zero_gap_area_error", "energetic_area_error", "force_error", "pull_off_error"])
def test_errors_shrink_as_the_range_does(long_ranges, name):
    longer, shorter = (np.abs(one[name].values).max() for one in long_ranges)
    assert shorter < 0.9 * longer


def test_files_hold_every_value(long_ranges, hertzian, tmp_path):
    for one in (long_ranges[0], hertzian):
        write_dataset(one, tmp_path / "one.nc")
        assert read_dataset(tmp_path / "one.nc").identical(one)
        assert all({"units", "long_name"} <= set(variable.attrs) for variable in one.variables.values())
        assert {"title", "summary", "Conventions", "source", "references"} <= set(one.attrs)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"tabor_parameter": 0.0}, "tabor_parameter"),
        ({"approaches": []}, "approaches"),
        ({"approaches": [1.0, 2.0]}, "approaches"),
        ({"approaches": [1.0, -0.5]}, "approaches"),  # below pull-off
        ({"approaches": [float("nan")]}, "approaches"),
        ({"approaches": [20.0]}, "mean_separations"),  # the mean planes would have passed each other
        ({"period": -1.0}, "period"),
        ({"grid": 64}, "interaction_range"),
        ({"grid": 1.5}, "grid"),
        ({"tolerance": 0.0}, "tolerance"),
    ],
)
def test_wrong_arguments_are_named(wrong, name):
    arguments = {"tabor_parameter": 2.0, "period": PERIOD} | wrong
    with pytest.raises(ValueError, match=f"^{name}: "):
        one_asperity(arguments.pop("tabor_parameter"), **arguments)


def test_contact_radii_are_positive_and_fall():
    for radii in ([], [0.5, 1.0], [1.0, 0.0]):
        with pytest.raises(ValueError, match=r"^contact_radii: "):
            hertz_asperity(contact_radii=radii)
