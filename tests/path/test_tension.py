"""Loads of zero and tension as targets, and turning points that physics does not allow."""

import numpy as np
import pytest

import icha
from icha.references import indentation

RADIUS, MODULUS, ENERGY = 1e-3, 2.7e6, 0.05
PULL_OFF = 1.5 * np.pi * ENERGY * RADIUS
MATERIAL = icha.Material(contact_modulus=MODULUS, surface_energy=ENERGY, interaction_range=2e-9)


def sphere():
    return icha.Surface(np.zeros((48, 48)), period=300e-6, boundary="free", shape=icha.Sphere(RADIUS))


def simulate(**path):
    return icha.simulate(sphere(), MATERIAL, icha.Path(**path), model="boundary_elements")


def test_a_sphere_at_zero_load_and_in_tension_has_the_radius_and_indentation_of_jkr():
    """The first force is inside the jump into contact, which ends at -8/9 of the pull-off force."""
    forces = [-0.9 * PULL_OFF, -0.1e-3, 0.0, 0.2e-3]
    run = simulate(forces=forces)
    assert "failed_checks" not in run.attrs and run["step_target"].values.tolist() == forces
    np.testing.assert_allclose(run["force"], forces, rtol=2e-6, atol=1e-9)
    radius = indentation.sphere_radius_at_force(np.array(forces), RADIUS, MODULUS, ENERGY)
    expected = indentation.sphere_contact(radius, RADIUS, MODULUS, ENERGY).indentation
    # The grid has four cells per (Δγ R²/E*)^(1/3).
    np.testing.assert_allclose(run["contact_radius"], radius, rtol=1e-2)
    np.testing.assert_allclose(run["indentation"], expected, atol=4e-2 * np.cbrt(ENERGY**2 * RADIUS / MODULUS**2))


def test_unloading_meets_the_same_tensions_again():
    forces = [-0.9 * PULL_OFF, 0.0, 0.2e-3]
    run = simulate(forces=forces, unload=True)
    assert "failed_checks" not in run.attrs
    met = [k for k, kind in enumerate(run["step_kind"].values) if kind == "force"]
    assert run["step_target"].values[met].tolist() == [*forces, *forces[-2::-1]]
    radius = run["contact_radius"].values[met]
    np.testing.assert_allclose(
        radius[3:], radius[1::-1], rtol=1e-5, err_msg="the branch is the same in both directions"
    )


@pytest.mark.parametrize("model", [pytest.param("asperities", marks=pytest.mark.slow), "boundary_elements"])
def test_tensions_on_a_rough_surface_lie_where_the_load_of_the_first_loading_rises_to_them(model):
    spectrum = icha.SelfAffineSpectrum(
        period=100e-6, rolloff_wavelength=50e-6, short_wavelength=25e-6, hurst=0.8, rms_slope=0.3
    )
    surface, soft = spectrum.realise(grid=32, seed=1), icha.Material(1e6, 0.02, interaction_range=2e-9)
    loading = icha.simulate(surface, soft, icha.Path([2e-3], turning_points=[("reduced_pressure", 0.0)]), model=model)
    loading = loading.isel(step=loading["leg"].values == 0)
    pressure, area = loading["reduced_pressure"].values, loading["contact_area_fraction"].values
    targets = [0.5 * pressure.min(), 0.0, 2e-3]
    run = icha.simulate(surface, soft, icha.Path(targets), model=model)
    np.testing.assert_allclose(run["reduced_pressure"], targets, atol=1e-8)
    for k, target in enumerate(targets[:2]):
        after = next(j for j in range(2, len(area)) if area[j - 1] and pressure[j - 1] < target <= pressure[j])
        assert area[after - 1] <= run["contact_area_fraction"][k] <= area[after]


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ({"forces": [2e-4], "turning_points": [("force", -3e-4)]}, "before the turning point force = -300 µN; the lar"),
        ({"forces": [-3e-4, 2e-4]}, "does not reach the tension force = -300 µN; the largest tension is 2.* `unload"),
    ],
    ids=["turning point", "target"],
)
def test_tension_beyond_pull_off_ends_a_path_by_physics_in_units_of_an_indenter(path, reason):
    with pytest.raises(icha.ConvergenceError, match=f"at an indentation of .*{reason}") as caught:
        simulate(**path)
    ended = caught.value.dataset
    assert "beyond_model" in ended.attrs and "incomplete" not in ended.attrs
    assert float(ended["force"][ended["step_target"].values == 2e-4][0]) == pytest.approx(2e-4, rel=2e-6)


def test_without_adhesion_no_contact_has_a_load_of_zero_or_less():
    bare = icha.Material(MODULUS, 0.0)
    for forces in ([-1e-4], [0.0, 1e-4]):
        with pytest.raises(ValueError, match="not a load of a contact without adhesion"):
            icha.simulate(sphere(), bare, icha.Path(forces=forces))
    turns = icha.Path(forces=[1e-4], turning_points=[("force", -1e-5)])
    with pytest.raises(ValueError, match="path: force = -10 µN is not a load"):
        icha.simulate(sphere(), bare, turns)


def test_loading_reaches_a_contact_inside_the_jump_only_before_pull_off():
    """Beyond the largest tension of the branch after the jump, the surfaces would be pulled off."""
    smallest = float(indentation.sphere_pull_off(RADIUS, MODULUS, ENERGY).contact_radius)
    for radius, reached in ((0.9 * smallest, False), (1.08 * smallest, True)):
        if reached:
            run = simulate(contact_radii=[radius], unload=True)
            assert float(run["pull_off_force"]) == pytest.approx(PULL_OFF, rel=1e-2)
        else:
            with pytest.raises(icha.ConvergenceError, match="does not reach back to the target before pull-off"):
                simulate(contact_radii=[radius], unload=True)
