"""A failed run does not stop its campaign: its file states the reason, the verdict lists it, figures show the rest."""

from unittest.mock import Mock

import numpy as np
import pytest
import small_campaign as small

from icha.analysis.checks import check_campaign, read_checks
from icha.datasets.campaign import select_run
from icha.datasets.files import read_campaign, read_dataset, read_run
from icha.datasets.format import RUN, problems_with_file
from icha.datasets.labels import RunLabels
from icha.datasets.results import FIGURE_ENDINGS
from icha.datasets.surface_file import write_surface
from icha.figures.against_load import area_and_gap as figure
from icha.figures.registry import draw_figure
from icha.figures.select import NothingToDraw
from icha.surfaces.surface import Surface
from icha.tasks.run import compute_run
from icha.tasks.theories import make_theories

STAMP = {"id": "small/runs/a", "config_sha256": "0", "program_sha256": "1", "license": "CC0-1.0"}
ATTRIBUTES = {"campaign": "small", "study": "sticky"} | STAMP
PATH = {"reduced_pressures": [1e-3], "snapshots": [("reduced_pressure", 1e-3)]}
BOTH_WAYS = PATH | {"unload": True, "max_step": 0.5}
# The surface energy is ten times the energy that presses the summits flat.
STICKY = {"contact_modulus": 1e6, "surface_energy": 48.0, "interaction_range": 8e-6}
BARE = {"contact_modulus": 25e6, "surface_energy": 0.0, "interaction_range": 2.071e-9}


@pytest.fixture(autouse=True)
def scripts(request, monkeypatch):
    monkeypatch.syspath_prepend(str(request.config.rootpath / "workflow/scripts"))


def ridges():
    """A surface without summits."""
    heights = np.cos(2 * np.pi * np.arange(32) / 32)[:, None] * np.ones(32)
    return Surface(1e-6 * heights, 100e-6).scaled_to_rms_slope(1.0)


def pitted():
    """A rough surface with one pit, sixty rms heights deep."""
    heights = np.array(small.SPECTRUM.realise(grid=64, seed=1).heights)
    heights[5, 7] -= 160 * np.std(heights)
    return Surface(heights, 100e-6).scaled_to_rms_slope(1.0)


@pytest.fixture
def sweep(tmp_path):
    """Return a function that computes a run as a batch does; it returns the file and the progress lines."""

    def run(name, material, path=PATH, surface=None, model="asperities"):
        said, topography, output = [], tmp_path / f"{name}-surface.nc", tmp_path / f"{name}.nc"
        write_surface(topography, small.surface() if surface is None else surface, name="rough", seed=1)
        settings = {"material": material, "path": path, "attributes": ATTRIBUTES, "model": model}
        compute_run(topography, output, rms_slope=1.0, seed=1, progress=said.append, **settings)
        return output, said

    return run


@pytest.fixture
def dataset(tmp_path):
    """Return a function that analyses run files, by material or by surface/material; checks are in `checks.json`."""
    from analyse import analyse

    def make(files, model="asperities"):
        names = [name.rpartition("/") for name in files]
        labels = [RunLabels("sticky", model, surface or "rough", 1, 1.0, name) for surface, _, name in names]
        outputs = {"dataset": "c.nc", "table": "c.csv", "comparison": "comparison.nc", "checks": "checks.json"}
        analyse(
            dict(zip(map(str, files.values()), labels, strict=True)),
            {name: tmp_path / file for name, file in outputs.items()},
            stamps=[STAMP] * len(labels),
            compared=[],
            varied={},
            samples={},
            attributes={"campaign": "small"},
            described={"title": "Sticky", "config_sha256": "1"},
        )
        return tmp_path / "c.nc", labels

    return make


def test_the_file_of_a_run_without_stops_states_the_reason(sweep):
    file, said = sweep("sticky", STICKY)
    run = read_run(file)
    assert run.sizes["step"] == run.sizes["snapshot"] == run.sizes["spot"] == 0
    assert "after 0 of 1 stops" in run.attrs["beyond_model"]
    assert said[-1] == f"Ended by physics: {run.attrs['beyond_model']}"
    assert float(run["surface_energy"]) == 48.0 and run.attrs["config_sha256"] == "0"
    assert sweep("again", STICKY)[0].read_bytes() == file.read_bytes()


def test_the_verdict_lists_the_failed_run_and_the_others_are_used(sweep, dataset, tmp_path):
    from judge_results import judge_results

    # The failed run comes first; the variables of the study are those of the other run.
    # The snapshot is far above the surface.
    far = BOTH_WAYS | {"snapshots": [("mean_separation", 1.0)]}
    files = {"glue": sweep("glue", STICKY, far)[0], "soft": sweep("soft", BARE, BOTH_WAYS)[0]}
    file, labels = dataset(files)
    broken = read_run(files["glue"])
    reason = broken.attrs["incomplete"]
    tree = read_campaign(file)
    study = tree["sticky"].to_dataset().isel(model=0, surface=0, seed=0, rms_slope=0)
    assert study["status"].values.tolist() == [1, 0] and study["failure"].values.tolist() == [reason, ""]
    assert int(study["step_count"][0]) == broken.sizes["step"] < study.sizes["step"]
    whole, soft = read_run(files["soft"]), select_run(tree, labels[1])
    for name in ("nominal_pressure", "gap_density", "spot_force", "jump_in_count"):
        np.testing.assert_array_equal(soft[name].values, whole[name].values)
    glue = select_run(tree, labels[0])
    assert glue.attrs["incomplete"] == reason
    assert glue.sizes["snapshot"] == glue.sizes["spot"] == 0
    np.testing.assert_array_equal(glue["nominal_pressure"].values, broken["nominal_pressure"].values)

    failed = [check for check in read_checks(tmp_path / "checks.json") if not check.passed]
    assert [(check.subject, check.description) for check in failed] == [("sticky/rough/seed1/slope1/glue", reason)]
    with pytest.raises(ValueError) as verdict:
        judge_results(tmp_path / "checks.json", tmp_path / "verdict.txt", known={})
    first, line = str(verdict.value).splitlines()
    assert first.startswith("1 of ") and line == f"sticky/rough/seed1/slope1/glue: the run failed: {reason}"
    assert not (tmp_path / "verdict.txt").exists()
    known = {"sticky/rough/seed1/slope1/glue": "sticky"}
    judge_results(tmp_path / "checks.json", tmp_path / "verdict.txt", known=known)
    first, line = (tmp_path / "verdict.txt").read_text().splitlines()
    assert first.endswith("known failures:") and line == "sticky/rough/seed1/slope1/glue: sticky"


def test_a_campaign_of_runs_without_stops_has_a_dataset_and_an_empty_figure(sweep, dataset, tmp_path):
    file, _ = dataset({name: sweep(name, STICKY)[0] for name in ("one", "two")})
    tree = read_campaign(file)
    assert tree["sticky"].sizes["step"] == 0
    assert all(check.passed for check in check_campaign(tree))
    assert tree["sticky"]["status"].values.ravel().tolist() == [5, 5]
    with pytest.raises(NothingToDraw):
        figure(tree, study="sticky")
    files = [tmp_path / f"fig2.{ending}" for ending in FIGURE_ENDINGS]
    draw_figure("fig2_area_and_gap", *files, inputs={"campaign": str(file)}, arguments={"study": "sticky"})
    assert all(file.stat().st_size > 50 for file in files) and "Nothing to draw: " in files[2].read_text()


def test_a_surface_that_a_model_cannot_compute_affects_no_other_run(sweep, dataset):
    path, model = BOTH_WAYS, "asperities"
    odd, said = sweep("ridges", BARE, path, ridges(), model)
    # A deep pit does not cause an error.
    pit, _ = sweep("pit", BARE, path, pitted(), model)
    run = read_run(odd)
    assert run.attrs["incomplete"] == (
        "nothing was computed: heights: the surface has no summit with negative-definite curvature"
    )
    assert said == [f"Failed: {run.attrs['incomplete']}"]
    assert run.sizes["step"] == 0 and int(run["asperity_count"]) == 0
    assert not problems_with_file(RUN, run.assign_attrs(config_sha256=64 * "0"))
    again, _ = sweep("again", BARE, path, ridges(), model)
    assert again.read_bytes() == odd.read_bytes()
    # Boundary elements need no summits; a uniform ridge is in contact along its whole length.
    whole = read_run(sweep("cells", BARE, PATH, ridges(), "boundary_elements")[0])
    touched = whole["contact_map"].values[0] > 0
    assert "incomplete" not in whole.attrs and int(whole["asperity_count"]) == 0
    assert touched.any() and np.all(touched.all(axis=1) == touched.any(axis=1))
    file, labels = dataset({"ridges/bare": odd, "pitted/bare": pit}, model)
    tree = read_campaign(file)
    assert tree["sticky"]["status"].values.ravel().tolist() == [1, 0]
    failed = [check for check in check_campaign(tree) if not check.passed]
    assert [(check.name, check.description) for check in failed] == [("completed", run.attrs["incomplete"])]
    np.testing.assert_array_equal(
        select_run(tree, labels[1])["nominal_pressure"].values, read_run(pit)["nominal_pressure"].values
    )


@pytest.mark.parametrize("error", [ZeroDivisionError("division by zero"), np.linalg.LinAlgError("singular matrix")])
def test_any_error_of_the_computation_is_a_failed_run(sweep, monkeypatch, error):
    monkeypatch.setattr("icha.simulation.record.follow", Mock(side_effect=error))
    file, said = sweep("odd", BARE)
    run = read_run(file)
    assert str(error) in run.attrs["incomplete"] and run.sizes["step"] == 0
    # The log has the traceback of unexpected errors.
    assert any("Traceback" in line for line in said) == (not isinstance(error, ValueError))
    monkeypatch.undo()
    run = read_run(sweep("far", BARE, PATH | {"snapshots": [("relative_load", 1e-30)]})[0])
    assert run.sizes["step"] == 0 and run.attrs["incomplete"].startswith("nothing was computed: path: ")


def test_values_that_are_not_finite_end_a_run_and_keep_the_steps_before(sweep, dataset, monkeypatch):
    from icha.equilibrium.interacting_asperities import AsperityObservables

    of_step, count = AsperityObservables.of_step, iter(range(9))
    monkeypatch.setattr(
        AsperityObservables, "of_step", lambda *own: of_step(*own) | {"residual": np.nan if next(count) else 0.0}
    )
    file, _ = sweep("odd", BARE, {"reduced_pressures": [1e-3, 3e-3, 1e-2]})
    run = read_run(file)
    assert run.sizes["step"] == 1
    assert run.attrs["incomplete"] == "the path ends with values of residual that are not finite"
    assert dataset({"odd": file})[0].exists()


@pytest.mark.parametrize(
    "error", [MemoryError("no room"), OSError(28, "No space left on device"), RuntimeError("can't start new thread")]
)
def test_errors_of_the_machine_write_no_result(sweep, tmp_path, monkeypatch, error):
    monkeypatch.setattr("icha.simulation.record.follow", Mock(side_effect=error))
    with pytest.raises(type(error)):
        sweep("wrong", BARE)
    assert not (tmp_path / "wrong.nc").exists()


def test_theories_that_do_not_apply_to_a_surface_are_omitted(tmp_path, capsys):
    # The moments of a single cap on a free square are impossible for an isotropic Gaussian surface.
    x = np.linspace(-1, 1, 32)
    cap = Surface(-1e-6 * (x[:, None] ** 2 + x**2), 100e-6, "free").scaled_to_rms_slope(1.0)
    write_surface(tmp_path / "cap.nc", cap, name="cap", seed=1)
    make_theories(
        tmp_path / "cap.nc", tmp_path / "theories.nc", settings={"kind": "measured"}, adhesive=[], attributes={}
    )
    found = read_dataset(tmp_path / "theories.nc")
    assert "persson_area_fraction" in found and not [name for name in found if name.startswith("greenwood")]
    assert "Theories of separate summits do not apply" in capsys.readouterr().out
