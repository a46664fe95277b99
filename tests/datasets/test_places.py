"""Surfaces with slopes of their own: a place for every run and no more, and all that is made of the dataset."""

import matplotlib.pyplot as plt
import netCDF4
import numpy as np
import own_slopes_campaign as crops
import pytest
import xarray as xr
from typer.testing import CliRunner

from icha.analysis.checks import check_campaign
from icha.analysis.common_loads import compare_campaign
from icha.analysis.measured_error import measured_errors
from icha.analysis.validity import statements_on_dataset
from icha.cli import app
from icha.datasets.campaign import run_labels, select_run
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_campaign, write_dataset
from icha.datasets.labels import (
    LABELS,
    RunLabels,
    arrange_slopes,
    labels_at,
    number_label,
    place_of,
    slopes_of,
    surfaces_and_slopes,
)
from icha.figures import against_load, at_one_load, contact_maps, errors
from icha.report.tables import failures, materials_table, studies_table


@pytest.mark.parametrize("value", [0.1, 0.1 + 0.2, 1.0, 1e-5, 12.5, 100.0])
def test_slopes_in_paths_read_back(value):
    assert float(number_label(value)) == value
    assert "/" not in number_label(value) and " " not in number_label(value)


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
    square = crops.square_tree()[crops.STUDY].to_dataset()
    assert square["rms_slope"].dims == ("rms_slope",) and square["status"].size == 3 * len(crops.runs())
    assert surfaces_and_slopes(square)[:2] == [("crop1", 0.21), ("crop1", 0.34)]


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


def test_what_is_not_there_is_named():
    tree = crops.tree()
    with pytest.raises(ValueError, match=f"expected one of {crops.STUDY}"):
        select_run(tree, ("other", "asperities", "crop1", 1, 0.5, "soft"))
    labels = RunLabels(crops.STUDY, "asperities", "crop1", 1, 0.21, "soft")
    with pytest.raises(ValueError, match=r"no rms_slope 0\.21; expected one of 0\.5"):
        select_run(tree, labels)
    with pytest.raises(ValueError, match="no surface 'other'; expected one of crop1, crop2, crop3"):
        select_run(tree, labels._replace(surface="other"))


def test_xarray_alone_selects_a_surface_and_its_slope(tmp_path):
    write_dataset(campaign_tree(crops.runs().items()), tmp_path / "a.nc")
    with xr.open_datatree(tmp_path / "a.nc") as tree:
        study = tree[crops.STUDY].to_dataset()
        run = study.sel(model="asperities", surface="crop2", seed=1, material="soft").isel(rms_slope=0)
        assert float(run["rms_slope"]) == 0.21
        own = crops.runs()[RunLabels(crops.STUDY, "asperities", "crop2", 1, 0.21, "soft")]
        np.testing.assert_array_equal(run["contact_area_fraction"].values, own["contact_area_fraction"].values)
        by_slope = study.isel(rms_slope=0).swap_dims(surface="rms_slope").sortby("rms_slope")
        assert by_slope["surface"].values.tolist() == ["crop2", "crop3", "crop1"]
        load = study["reduced_pressure"] * study["rms_slope"]
        assert load.sel(surface="crop2").isel(rms_slope=0, model=0, seed=0, step=-1).values == pytest.approx(0.21e-2)
    with netCDF4.Dataset(tmp_path / "a.nc") as file:
        group = file[crops.STUDY]
        assert "rms_slope" in group["status"].coordinates.split()
        assert "rms_slope" in group["contact_area_fraction"].coordinates.split()
        assert group["pressure_bin_edges"].dimensions[:3] == ("surface", "rms_slope", "material")


@pytest.mark.slow
def test_figures_of_either_form_show_the_same():
    study, tree, other = crops.STUDY, crops.tree(), crops.square_tree()
    figures = {
        "fig2": lambda tree, error: against_load.area_and_gap(tree, study=study),
        "fig3": lambda tree, error: at_one_load.distributions(tree, study=study),
        "fig5": lambda tree, error: against_load.multi_slope(tree, study=study),
        "fig6": lambda tree, error: contact_maps.spots_by_slope(tree, study=study),
        "fig7": lambda tree, error: against_load.stiffness(tree, study=study),
        "fig8": lambda tree, error: at_one_load.patch_sizes(tree, study=study),
        "fig10": lambda tree, error: errors.model_error(tree, error, study=study),
        "fig11": lambda tree, error: errors.distribution_error(tree, error, study=study),
    }
    for name, draw in figures.items():
        shown, known = draw(tree, crops.errors(tree)), draw(other, crops.errors(other))
        for one, two in zip(shown.axes, known.axes, strict=True):
            assert one.get_title(loc="right") == two.get_title(loc="right"), name
            lines = [[line.get_xydata() for line in axes.lines] for axes in (one, two)]
            for own, its in zip(*lines, strict=True):
                np.testing.assert_allclose(own, its, rtol=1e-12, err_msg=name)
        words = [
            [text.get_text() for legend in figure.legends for text in legend.get_texts()] for figure in (shown, known)
        ]
        assert words[0] == words[1], name
        plt.close("all")


def test_report_checks_and_validity_of_either_form_are_the_same():
    tree, other = crops.tree(), crops.square_tree()

    def tables(tree):
        studies = {crops.STUDY: tree[crops.STUDY].to_dataset()}
        return studies_table(studies), materials_table(studies), failures(studies, "runs")

    assert tables(tree) == tables(other)
    assert check_campaign(tree) == check_campaign(other)
    assert statements_on_dataset(tree) == statements_on_dataset(other)
    assert measured_errors(crops.errors(tree)) == measured_errors(crops.errors(other))


def test_commands_show_and_check_the_file(tmp_path):
    file, tree = tmp_path / "crops.nc", crops.tree()
    write_dataset(campaign_tree(crops.runs().items()), file)
    shown = CliRunner().invoke(app, ["show", str(file)])
    assert shown.exit_code == 0, shown.output
    assert "12 complete" in shown.output
    checked = CliRunner().invoke(app, ["check", str(file)])
    assert "rms_slope" not in checked.output and "dimension" not in checked.output, checked.output
    write_dataset(compare_campaign(tree), tmp_path / "compared.nc")
    write_dataset(crops.errors(tree), tmp_path / "errors.nc")
    again = xr.load_dataset(tmp_path / "errors.nc", group=crops.STUDY)
    assert again["rms_slope"].dims == tree[crops.STUDY]["rms_slope"].dims
