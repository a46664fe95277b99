"""Choice of the model: runs with boundary elements in paths, files, campaigns and checks."""

import importlib

import netCDF4
import numpy as np
import pytest
import small_campaign as small
import xarray as xr

import icha
from icha.analysis.checks import check_campaign
from icha.analysis.common_loads import compare_runs
from icha.analysis.model_error import model_error
from icha.checks.run import check_run
from icha.contact.models import DEFAULT_MODEL, MODELS, REFERENCE_MODEL
from icha.datasets.campaign import run_labels, select_run
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_campaign, write_dataset
from icha.datasets.format import CAMPAIGN, RUN, identify_file, problems_with_file
from icha.datasets.labels import LABELS, RunLabels
from icha.datasets.variables.campaign import BEYOND_MODEL, COMPLETE
from icha.datasets.variables.run import FURTHER, OF_MODELS
from icha.figures.looks import MODEL_MARKERS
from icha.figures.select import select_runs
from icha.planning.costs import LAWS, RUN_SIZES
from icha.report.report import write_report

PATH = icha.Path(reduced_pressures=[1e-3, 1e-2], snapshots=[("reduced_pressure", 1e-3), ("reduced_pressure", 1e-2)])


def run(model, path=PATH, material="soft", seed=1):
    return icha.simulate(small.surface(seed), small.MATERIALS[material], path, model=model, seed=seed)


def labels(model, material="soft", seed=1):
    return RunLabels("one", model, "rough", seed, 1.0, material)


# Variables on the cells of the grid.
MAPS = {"contact_map", "contact_pressure", "gap_map", "displacement_map", "x", "y"}


@pytest.fixture(scope="module")
def runs():
    """Both models of one material, and asperities alone of the other; tests must not change them."""
    found = {labels(model): run(model) for model in MODELS}
    return found | {labels(DEFAULT_MODEL, "hertz"): run(DEFAULT_MODEL, material="hertz")}


def test_a_run_says_by_which_model_it_is(runs, tmp_path):
    asperities, patched = runs[labels(DEFAULT_MODEL)], runs[labels(REFERENCE_MODEL)]
    assert set(patched.variables) - set(asperities.variables) == set(OF_MODELS)
    assert patched["contact_map"].shape == (2, 32, 32) and patched["contact_map"].dtype == np.float32
    assert asperities.attrs["contact_model"] == DEFAULT_MODEL and patched.attrs["contact_model"] == REFERENCE_MODEL
    for name in ("title", "summary", "references"):
        assert asperities.attrs[name] != patched.attrs[name]
    assert "boundary elements" in patched.attrs["title"] and "Griffith" in patched.attrs["references"]
    write_dataset(patched, tmp_path / "run.nc")
    kind, back = identify_file(tmp_path / "run.nc")
    assert kind == RUN and problems_with_file(RUN, back) == []
    with netCDF4.Dataset(tmp_path / "run.nc") as file:
        storage = file["contact_map"]
        assert storage.chunking() == [1, 32, 32] and storage.filters()["zlib"]
    lacking = back.drop_vars(["contact_map", "front_residual"])
    assert problems_with_file(RUN, lacking) == ["front_residual is missing", "contact_map is missing"]
    assert any(
        "contact_model: 'guess'" in flaw for flaw in problems_with_file(RUN, back.assign_attrs(contact_model="guess"))
    )


def test_maps_of_gap_and_displacement_are_those_of_the_state(runs):
    patched, surface = runs[labels(REFERENCE_MODEL)], small.surface(1)
    np.testing.assert_allclose(patched["x"], np.arange(32) * surface.spacing)
    assert patched["x"].dims == ("column",) and patched["y"].dims == ("row",)
    assert {"x", "y"} <= set(patched["gap_map"].coords)
    for k, step in enumerate(patched["snapshot_step"].values):
        gap, displacement = (patched[f"{name}_map"].values[k] for name in ("gap", "displacement"))
        closed = patched["contact_map"].values[k] >= 1
        assert closed.any() and np.abs(gap[closed]).max() < 1e-7 * surface.rms_height
        assert gap.mean() == pytest.approx(float(patched["mean_gap"][step]), rel=1e-5)
        assert abs(displacement.mean()) < 1e-6 * surface.rms_height
        expected = displacement + float(patched["mean_separation"][step]) - surface.heights
        np.testing.assert_allclose(gap, expected, atol=1e-6 * surface.rms_height)


def test_a_gap_may_be_infinite_where_a_shape_has_no_surface(tmp_path):
    punch = icha.Surface(np.zeros((32, 32)), 1e-3, "free", icha.FlatPunch(2e-4))
    run = icha.simulate(punch, icha.Material(1e6, 0.0), icha.Path(forces=[1e-3]), model=REFERENCE_MODEL)
    assert np.isinf(run["gap_map"].values).any() and np.isfinite(run["displacement_map"].values).all()
    write_dataset(run, tmp_path / "run.nc")
    assert problems_with_file(RUN, identify_file(tmp_path / "run.nc")[1]) == []


def test_model_is_the_first_dimension_of_every_study(runs, tmp_path):
    assert LABELS[0] == "model"
    tree = small.tree()
    for study in tree.children.values():
        assert study["contact_area_fraction"].dims == (*LABELS, "step")
        assert study["model"].values.tolist() == [DEFAULT_MODEL]
    write_dataset(campaign_tree(runs.items(), attrs={"campaign": "both", "license": "CC0-1.0"}), tmp_path / "both.nc")
    tree = read_campaign(tmp_path / "both.nc")
    study = tree["one"].to_dataset()
    assert study["model"].values.tolist() == [DEFAULT_MODEL, REFERENCE_MODEL]
    assert study["status"].values.ravel().tolist() == [0, 0, 0, 3]
    # Maps stay in the files of the runs; what asperities do not have is missing.
    assert not {*MAPS, "row", "column"} & {*study.variables, *study.dims}
    front = study["front_residual"]
    assert (
        np.isnan(front.sel(model=DEFAULT_MODEL)).all() and front.attrs["missing"] == "in runs with the model asperities"
    )
    expected = runs[labels(REFERENCE_MODEL)]["front_residual"]
    np.testing.assert_array_equal(front.sel(model=REFERENCE_MODEL, material="soft").values.ravel(), expected)
    assert set(np.unique(study["spot_model"])) == {0, 1}
    assert [flaw for flaw in problems_with_file(CAMPAIGN, tree) if "attribute" not in flaw] == []
    assert run_labels(tree) == [labels(DEFAULT_MODEL), labels(DEFAULT_MODEL, "hertz"), labels(REFERENCE_MODEL)]
    assert "Griffith" in tree.attrs["references"] and "Violano" in tree.attrs["references"]


@pytest.mark.slow
def test_asperities_end_at_the_limit_of_their_range_beside_boundary_elements(tmp_path):
    path = icha.Path([0.05, 0.1, 0.3], unload=True, snapshots=[("reduced_pressure", 0.3)])
    whole = icha.simulate(small.surface(1), small.MATERIALS["hertz"], path, model=REFERENCE_MODEL, seed=1)
    with pytest.raises(icha.ConvergenceError) as caught:
        icha.simulate(small.surface(1), small.MATERIALS["hertz"], path, seed=1)
    ended = caught.value.dataset
    both = {labels(DEFAULT_MODEL, "hertz"): ended, labels(REFERENCE_MODEL, "hertz"): whole}
    tree = campaign_tree(both.items())
    study = tree["one"].to_dataset()
    assert study["status"].values.ravel().tolist() == [BEYOND_MODEL, COMPLETE]
    assert "outside the range of the model" in study["failure"].values.ravel()[0]
    assert select_run(tree, labels(DEFAULT_MODEL, "hertz")).attrs["beyond_model"] == ended.attrs["beyond_model"]
    assert all(check.passed for check in check_campaign(tree))
    # The first loading is a result, which figures and comparisons show.
    ((_, drawn),) = select_runs(tree, "one")
    assert drawn["reduced_pressure"].values.max() == pytest.approx(0.1)
    assert float(compare_runs(study)["reduced_pressure"].max()) == pytest.approx(0.1)
    errors = model_error(tree, runs=[(labels(REFERENCE_MODEL, "hertz"), whole)])["one"]
    known = np.isfinite(errors["contact_area_fraction"].values.ravel())
    assert known.tolist() == [True, True, False]
    write_dataset(xr.DataTree.from_dict({"/one": errors.to_dataset()}), tmp_path / "model_error.nc")
    write_report(tmp_path / "report.html", campaign=tree, figures=[], checks=check_campaign(tree))
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<b>1</b> of them ended at the limit of the model" in page and "Failures" not in page


def test_fronts_are_checked(runs):
    patched = runs[labels(REFERENCE_MODEL)]
    assert all(check.passed for check in check_run(patched))
    names = {check.name for check in check_run(patched)} - {
        check.name for check in check_run(runs[labels(DEFAULT_MODEL)])
    }
    assert names == {"front", "gap"}
    for name, value in (("front_residual", 0.5), ("gap_residual", 0.1)):
        worse = patched.assign({name: patched[name] * 0 + value})
        assert len([check for check in check_run(worse) if not check.passed]) == 1


def test_all_that_is_known_by_model_is_there_of_every_model():
    assert set(FURTHER) == set(RUN_SIZES) == set(MODELS)
    for name, model in MODELS.items():
        assert model.references and model.words in MODEL_MARKERS
        assert name in LAWS
        assert callable(importlib.import_module(model.module).contact_of)
