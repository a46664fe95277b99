"""Surfaces with slopes of their own: a place for every run and no more, and all that is made of the dataset."""

import numpy as np
import own_slopes_campaign as crops
import xarray as xr
from typer.testing import CliRunner

from icha.analysis.common_loads import compare_campaign
from icha.cli import app
from icha.datasets.campaign import run_labels, select_run
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_campaign, write_dataset
from icha.datasets.labels import LABELS, arrange_slopes, labels_at, place_of, slopes_of, surfaces_and_slopes
from icha.figures import against_load, at_one_load, contact_maps
from icha.figures import errors as figures_of_errors


def test_slopes_are_common_unless_that_takes_more_cells():
    assert arrange_slopes([("a", 0.5), ("a", 0.2), ("b", 0.2), ("b", 0.5)]).tolist() == [0.2, 0.5]
    assert arrange_slopes([("a", 0.5), ("a", 0.2), ("b", 0.2)]).tolist() == [0.2, 0.5]
    np.testing.assert_array_equal(
        arrange_slopes([("b", 0.5), ("a", 0.3), ("a", 0.2)]), np.array([[0.5, np.nan], [0.2, 0.3]])
    )


def test_every_cell_holds_a_run_and_has_its_slope():
    study = crops.tree()[crops.STUDY].to_dataset()
    assert study["status"].size == len(crops.runs()) and not study["status"].values.any()
    assert study["rms_slope"].dims == ("surface", "rms_slope")
    assert study["rms_slope"].values[:, 0].tolist() == list(crops.SLOPES.values())
    assert slopes_of(study) == sorted(crops.SLOPES.values())
    assert surfaces_and_slopes(study) == list(crops.SLOPES.items())


def test_surfaces_may_have_different_numbers_of_slopes(tmp_path):
    runs = dict(crops.many(3))
    first = next(iter(runs))
    runs[first._replace(rms_slope=0.9)] = runs[first].assign(rms_slope=runs[first]["rms_slope"] * 0 + 0.9)
    write_dataset(campaign_tree(runs.items()), tmp_path / "a.nc")
    tree = read_campaign(tmp_path / "a.nc")
    study = tree[crops.STUDY].to_dataset()
    np.testing.assert_allclose(study["rms_slope"].values, [[0.1, 0.9], [0.101, np.nan], [0.102, np.nan]])
    assert sorted(run_labels(tree)) == sorted(runs)
    for labels, run in runs.items():
        place = place_of(study, dict(zip(LABELS, labels[1:], strict=True)))
        assert labels_at(study, list(place.values()), LABELS) == list(labels[1:])
        found = select_run(tree, labels)
        assert float(found["rms_slope"]) == labels.rms_slope
        np.testing.assert_array_equal(found["spot_radius"].values, run["spot_radius"].values)


def test_figures_show_the_runs_of_each_slope():
    """Of three surfaces and two materials, each with a curve and its targets."""
    for draw in (against_load.area_and_gap, against_load.multi_slope, against_load.stiffness):
        axes = draw(crops.tree(), study=crops.STUDY).axes[0]
        assert len([line for line in axes.lines if len(line.get_xdata())]) == 2 * 3 * 2
    for draw in (at_one_load.distributions, contact_maps.spots_by_slope, at_one_load.patch_sizes):
        assert draw(crops.tree(), study=crops.STUDY).axes


def test_results_and_commands_know_the_slopes(tmp_path):
    file, tree = tmp_path / "crops.nc", crops.tree()
    write_dataset(campaign_tree(crops.runs().items()), file)
    shown = CliRunner().invoke(app, ["show", str(file)])
    assert shown.exit_code == 0 and "12 complete" in shown.output, shown.output
    checked = CliRunner().invoke(app, ["check", str(file)])
    assert "rms_slope" not in checked.output and "dimension" not in checked.output, checked.output
    write_dataset(compare_campaign(tree), tmp_path / "compared.nc")
    errors = crops.errors()
    write_dataset(errors, tmp_path / "errors.nc")
    again = xr.load_dataset(tmp_path / "errors.nc", group=crops.STUDY)
    assert again["rms_slope"].dims == tree[crops.STUDY]["rms_slope"].dims
    for draw in (figures_of_errors.model_error, figures_of_errors.distribution_error):
        assert draw(tree, errors, study=crops.STUDY).axes
