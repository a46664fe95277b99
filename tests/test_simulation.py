"""Loading sweeps as a whole: identities, symmetries, scaling, refinement, bytes, and reported failures."""

import os
import pickle
import subprocess
import sys
import warnings
from contextlib import suppress

import numpy as np
import pytest
import xarray as xr
from digests import digest

from icha import ConvergenceError, IchaWarning, Material, Path, SelfAffineSpectrum, Sphere, Stripes, Surface, simulate
from icha.asperity.stickiness import stickiness
from icha.datasets.campaign import select_run
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.format import RUN, problems_with_file
from icha.datasets.labels import RunLabels
from icha.report.tables import materials_table
from icha.surfaces.moments import spectral_moments

PERIOD, MODULUS, ENERGY, RANGE = 100e-6, 25e6, 0.05, 2.071e-9
ADHESIVE, BARE = Material(MODULUS, ENERGY, RANGE), Material(MODULUS, 0.0, RANGE)
PRESSURES = [1e-3, 5e-3, 2e-2]


def rough(grid=64, seed=1, ratio=16, period=PERIOD, slope=1.0):
    return SelfAffineSpectrum(period, 0.2 * period, period / ratio, 0.8, rms_slope=slope).realise(grid, seed)


def run_of(surface, material, pressures=PRESSURES, **options):
    return simulate(surface, material, Path(reduced_pressures=pressures, **options))


@pytest.fixture(scope="module", params=[ENERGY, 0.0], ids=["adhesive", "bare"])
def run(request):
    material = Material(MODULUS, request.param, RANGE)
    return run_of(rough(), material, snapshots=[("reduced_pressure", 5e-3), ("area_fraction", 0.06)])


@pytest.mark.parametrize("model", ["asperities", "boundary_elements"])
def test_a_pit_deeper_than_the_bins_ends_no_run(model):
    """A pit of 40 rms heights, as lost points and holes of measured surfaces are."""
    heights = np.array(rough(grid=64, ratio=8).heights)
    heights[10, 20] -= 64 * 1.5 * np.std(heights)
    surface = Surface(heights, PERIOD)
    assert -surface.heights.min() > 40 * surface.rms_height
    run = simulate(surface, BARE, Path([3e-3]), model=model)
    content = run.gap_density.values[0] * np.diff(run.gap_bin_edges)
    whole = content.sum() + float(run.contact_area_fraction[-1]) + float(run.overlap_fraction[0])
    assert whole == pytest.approx(1, abs=1e-12)
    # One node is in the last bin.
    assert content[-1] == pytest.approx(1 / 64**2, rel=1e-9)
    assert not list(problems_with_file(RUN, run))


@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_runs_on_layers_and_maps_say_so(boundary):
    surface = Surface(rough(grid=32, ratio=8).heights, PERIOD, boundary)
    map_of_two = Stripes(0.01, 0.02, PERIOD / 4)
    materials = {
        "half": BARE,
        "film": Material(MODULUS, 0.0, thickness=1e-5, poisson_ratio=0.4),
        "striped": Material(MODULUS, map_of_two),
    }
    labels = {name: RunLabels("one", "boundary_elements", "rough", 1, surface.rms_slope, name) for name in materials}
    runs = {
        labels[name]: simulate(surface, each, Path([1e-2]), model="boundary_elements", seed=1)
        for name, each in materials.items()
    }
    tree = campaign_tree(runs.items())
    for found in (runs, {each: select_run(tree, each) for each in runs}):
        layers = [each for each, run in found.items() if {"layer_thickness", "layer_poisson_ratio"} & set(run)]
        assert layers == [labels["film"]]
        film = found[labels["film"]]
        assert (film["layer_thickness"], film["layer_poisson_ratio"]) == (1e-5, 0.4)
        assert film["layer_thickness"].attrs["units"] == "m" and film["layer_poisson_ratio"].attrs["long_name"]
        assert found[labels["striped"]]["adhesion_map_kind"] == "stripes"
    table = materials_table({"one": tree["one"].to_dataset()})
    bodies = {row[0]: row[-2:] for row in table.rows}
    assert bodies == {"half": ("–", "–"), "film": ("10 µm", "0.4"), "striped": ("–", "–")}
    for each, run in runs.items():
        assert not problems_with_file(RUN, run)
        assert ("elastic layer on a rigid base" in run.attrs["summary"]) == (each.material == "film")
        assert ("elastic half-space" in run.attrs["summary"]) == (each.material != "film")


def test_spots_follow_the_jkr_law_and_checks_pass(run):
    assert "failed_checks" not in run.attrs
    assert run.sizes["spot"] <= int(run.spot_members.sum()) <= run.sizes["snapshot"] * int(run.asperity_count)
    assert np.all((run.spot_x >= 0) & (run.spot_x < PERIOD) & (run.spot_y >= 0) & (run.spot_y < PERIOD))
    a, R, gamma = run.spot_radius, run.spot_curvature_radius, float(run.surface_energy)
    force = 4 * MODULUS * a**3 / (3 * R) - np.sqrt(8 * np.pi * MODULUS * gamma * a**3)
    np.testing.assert_allclose(run.spot_force, force, rtol=1e-12)


def test_statistics_in_the_dataset_are_those_of_the_surface(run):
    surface = rough()
    heights = surface.heights
    assert float(run.rms_height) == pytest.approx(np.std(heights), rel=1e-12)
    assert float(run.rms_slope) == pytest.approx(1, rel=1e-12)
    mu = np.cbrt((float(run.surface_energy) / MODULUS) ** 2 / float(run.rms_curvature)) / RANGE
    assert float(run.tabor_parameter) == pytest.approx(mu, rel=1e-12)
    np.testing.assert_allclose(run.reduced_separation, run.mean_separation / np.std(heights), rtol=1e-12)
    assert float(run.spectral_moment_0) == pytest.approx(np.var(heights), rel=1e-12)
    assert float(run.spectral_moment_2) == pytest.approx(0.5, rel=1e-12)
    assert float(run.spectral_moment_4) == pytest.approx(float(run.rms_curvature) ** 2, rel=1e-12)
    alpha = float(run.spectral_moment_0 * run.spectral_moment_4) / 0.25
    assert float(run.nayak_parameter) == pytest.approx(alpha, rel=1e-12)
    material = Material(MODULUS, float(run.surface_energy), RANGE)
    assert float(run.stickiness) == stickiness(spectral_moments(surface), material)
    assert (float(run.stickiness) > 0) == (float(run.surface_energy) > 0)


def test_refining_the_grid_of_one_spectrum():
    pressures = [1e-3, 3e-3, 1e-2, 3e-2]
    areas = {grid: run_of(rough(grid), ADHESIVE, pressures).contact_area_fraction.values for grid in (64, 128, 256)}
    # From 4 to 8 and from 8 to 16 cells per shortest wavelength.
    np.testing.assert_allclose(areas[64], areas[128], rtol=0.02)
    np.testing.assert_allclose(areas[128], areas[256], rtol=0.002)


SCRIPT = """
import icha
from digests import digest
from test_simulation import ADHESIVE, rough
for model in ("asperities", "boundary_elements"):
    print(digest(icha.simulate(rough(), ADHESIVE, icha.Path([1e-3, 1e-2]), model=model)))
"""


@pytest.mark.slow
def test_runs_have_the_same_bytes_in_other_processes_with_one_and_two_threads():
    found = set()
    for threads in ("1", "2"):
        environment = os.environ | {f"{name}_NUM_THREADS": threads for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR")}
        command = [sys.executable, "-c", SCRIPT]
        found.add(subprocess.check_output(command, cwd=os.path.dirname(__file__), env=environment))
    assert len(found) == 1


def test_a_surface_that_pulls_itself_together_is_reported_with_what_was_computed():
    # So sticky that the area runs away before the load is reached.
    surface = rough(slope=0.2)
    stops = [0.01, 0.05]
    with pytest.raises(ConvergenceError) as caught:
        simulate(
            surface,
            Material(0.24e6, 0.05, RANGE),
            Path(reduced_pressures=stops, snapshots=[("mean_separation", 3.2 * surface.rms_height)]),
        )
    data = caught.value.dataset
    assert isinstance(data, xr.Dataset)
    assert 1 <= data.sizes["step"] < 3
    assert data.sizes["snapshot"] == 1
    assert str(data.step_kind[0].item()) == "mean_separation"
    assert float(data.mean_separation[0]) == pytest.approx(3.2 * surface.rms_height, rel=1e-9)
    assert np.all(data.converged == 1)
    assert np.all(data.residual <= 1e-8)
    # It crosses process borders whole.
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)
    assert digest(again.dataset) == digest(data)


def test_a_snapshot_that_is_not_finite_ends_a_cycle_with_what_was_reached(monkeypatch):
    from icha.equilibrium.interacting_asperities import AsperityObservables

    monkeypatch.setattr(AsperityObservables, "of_snapshot", lambda self, state: {"gap_density": np.array([np.nan])})
    with pytest.raises(ConvergenceError, match="with values of gap_density that are not finite") as caught:
        simulate(rough(), BARE, Path([1e-3], unload=True))
    reached = caught.value.dataset
    assert float(reached.reduced_pressure[-1]) == pytest.approx(1e-3) and reached.sizes["snapshot"] == 0
    assert int(reached.jump_in_count[-1]) == np.count_nonzero(reached.event_kind == 0) > 0


def test_arguments_with_a_wrong_unit_and_models_that_are_not_applicable_give_a_warning():
    with pytest.warns(IchaWarning, match="asperity model not applicable: mean gap of 0.2 rms heights"):
        simulate(rough(), Material(1e6, 0.0), Path(mean_separations=[0.2 * rough().rms_height]))
    fine = rough(32, ratio=8, slope=0.3)
    with pytest.warns(IchaWarning, match=r"rms_slope: 3e\+08 is unusual; expected 1e-4 to 5 .* SI units") as raised:
        Surface(fine.heights * 1e9, PERIOD)
    with pytest.warns(IchaWarning, match="period: 100 m is unusual"):
        Surface(fine.heights * 1e6, PERIOD * 1e6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Surface(fine.heights, PERIOD)
        Surface(np.zeros((32, 32)), 1e-3, "free", Sphere(1e-2))
    assert [each.filename for each in raised] == [__file__]
    for material, name in (
        (Material(25, 0.0), "contact_modulus: 25 Pa"),
        (Material(25e6, 50.0, 2e-9), "surface_energy: 50 J/m"),
        (Material(25e6, 0.05, 2.0), "interaction_range: 2 m"),
    ):
        # So much energy of adhesion leaves no equilibrium.
        with pytest.warns(IchaWarning, match=f"{name}.* is unusual") as raised, suppress(ConvergenceError):
            simulate(fine, material, Path([1e-3]))
        assert raised[0].filename == __file__
    lens = Surface(np.zeros((32, 32)), 1e-3, "free", Sphere(50.0))
    with pytest.warns(IchaWarning, match="radius: 50 m is unusual"):
        simulate(lens, BARE, Path(contact_radii=[2e-4]), model="boundary_elements")


@pytest.mark.parametrize("model", [pytest.param("asperities", marks=pytest.mark.slow), "boundary_elements"])
def test_snapshots_at_states_of_the_last_unloading(model):
    surface = SelfAffineSpectrum(PERIOD, 0.4 * PERIOD, 0.25 * PERIOD, 0.8, rms_slope=0.3).realise(32, 1)
    material = Material(1e6, 2e-3)
    states = [("reduced_pressure", 1e-3), ("area_fraction", 0.01), ("pressure", -5.0)]
    saved = [("reduced_pressure", 1e-2), *((f"unloading_{kind}", value) for kind, value in states)]
    path = Path([1e-3, 1e-2], unload=True, snapshots=[*saved, ("unloading_force", -1.0)])
    with pytest.warns(IchaWarning, match="unloading_force = -1 N: no snapshot, because unloading does not reach"):
        run = simulate(surface, material, path, model=model)
    found = list(zip(run["snapshot_kind"].values, run["snapshot_target"].values, strict=True))
    assert found[0] == saved[0] and sorted(found[1:-1]) == sorted(saved[1:]) and found[-1] == ("pull_off", 0)
    at = run.isel(step=run["snapshot_step"].values.astype(int))
    assert at["branch"].values.tolist() == ["loading"] + 4 * ["unloading"]
    names = {
        "reduced_pressure": "reduced_pressure",
        "area_fraction": "contact_area_fraction",
        "pressure": "nominal_pressure",
    }
    for kind, value in states:
        k = found.index((f"unloading_{kind}", value))
        assert float(at[names[kind]][k]) == pytest.approx(value, rel=1e-5)
        pressures = run["pressure_density"][k] * np.diff(run["pressure_bin_edges"]) * run["pressure_bin_mean"][k]
        assert float(pressures.sum()) == pytest.approx(float(at["nominal_pressure"][k]), rel=1e-3, abs=1e-3)
    assert problems_with_file(RUN, run) == []
    with pytest.raises(ValueError, match=r"snapshots\[0\]: 0.01 is a state of unloading; expected `unload: true`"):
        Path([1e-2], snapshots=[("unloading_area_fraction", 0.01)])


def test_a_run_ends_where_the_contact_of_a_shape_reaches_the_edge_of_its_square():
    surface = Surface(np.zeros((32, 32)), 32e-6, "free", Sphere(1e-3))
    path = Path(indentations=[2e-8, 3e-7])
    with pytest.raises(ConvergenceError, match="reaches the edge of the square") as error:
        simulate(surface, Material(1e6, 0.0, 1e-9), path, model="boundary_elements")
    assert error.value.dataset.attrs["beyond_model"] and error.value.dataset.sizes["step"] == 1
