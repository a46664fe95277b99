"""All figures can be drawn; the table beside each has the numbers of the runs, with their labels."""

import io

import compared_campaign as compared
import numpy as np
import pandas as pd
import small_campaign as small
from xarray import DataTree

import icha
from icha.configuration.figures import Figures
from icha.datasets.campaign import find_snapshot
from icha.datasets.files import write_dataset
from icha.datasets.results import figure_number
from icha.datasets.table import as_csv
from icha.figures import against_load, at_one_load, contact_maps, errors
from icha.figures.drawn import table_of
from icha.figures.registry import draw_figure, drawing_function
from icha.figures.select import path_steps
from icha.references.theories import reference_dataset
from icha.surfaces.moments import spectral_moments


def table(figure):
    return pd.read_csv(io.StringIO(as_csv(table_of(figure))))


def test_means_over_seeds_have_their_range_and_single_runs_their_labels():
    data = table(against_load.area_and_gap(small.tree(), study="single"))
    ratios = data[data.panel == "a"]
    assert set(ratios.curve) == {"asperities"} and set(ratios.material) == {"soft"} and "seed" not in data
    stops = [path_steps(small.run(seed)) for seed in (1, 2)]
    each = [run["contact_area_fraction"].values / run["reduced_pressure"].values for run in stops]
    np.testing.assert_allclose(ratios.x, small.PRESSURES, rtol=1e-6)
    np.testing.assert_allclose(ratios.y, np.mean(each, axis=0), rtol=1e-4)
    np.testing.assert_allclose([ratios.low, ratios.high], [np.min(each, axis=0), np.max(each, axis=0)], rtol=1e-4)
    assert set(ratios.seeds) == {2} and set(ratios.x_quantity) == {"reduced pressure F/(E*h'rmsA0)"}
    assert set(data[data.panel == "b"].y_quantity) == {"mean separation ū/h_rms"}
    # Single runs have their seed, slope and model.
    data = table(against_load.area_and_gap(small.tree(), study="slopes"))
    run = path_steps(small.run(rms_slope=0.2, material="hertz"))
    shown = data[(data.panel == "b") & (data.rms_slope == 0.2) & (data.material == "hertz")]
    np.testing.assert_allclose(shown.y, run["reduced_separation"].values, rtol=1e-9)
    assert set(shown.seed) == {1} and set(shown.model) == {"asperities"}
    data = table(at_one_load.patch_sizes(compared.tree_of_both(), study="one"))
    names = {("asperities", "asperities"), ("boundary elements", "boundary_elements")}
    assert set(zip(data.curve, data.model, strict=True)) == names


def test_points_that_are_drawn_apart_have_their_load():
    error = compared.errors()
    data = table(errors.model_error(compared.tree(), error, study="one"))
    loads = error["one"]["reduced_pressure"].values
    assert np.isclose(data.x.values[:, None], loads, rtol=1e-12).any(axis=1).all()
    areas = data[data.panel == "a"]
    means = 100 * error["one"]["area_error"].mean("seed").values.ravel()
    assert np.isclose(areas.y.values[:, None], means, rtol=1e-8).any(axis=1).all()


def test_theories_of_several_materials_can_be_told_apart():
    moments = spectral_moments(small.surface())
    adhesive = {(1.0, "soft"): small.MATERIALS["soft"], (1.0, "hertz"): icha.Material(25e6, 0.02, 2e-9)}
    references = reference_dataset(small.SPECTRUM, moments, adhesive)
    data = table(against_load.area_and_gap(compared.tree(), references, study="one"))
    theory = data[(data.curve == "Fuller & Tabor") & (data.panel == "b")]
    assert set(theory.material) == {"soft", "hertz"} and theory.model.isna().all()
    for _, line in theory.groupby("material"):
        assert line.x.is_monotonic_increasing or line.x.is_monotonic_decreasing


def test_spots_are_listed_once():
    run = small.run(rms_slope=0.2)
    count = int((run["spot_snapshot"] == find_snapshot(run, "relative_load")).sum())
    data = table(contact_maps.spots_by_slope(small.tree(), study="slopes", material="soft"))
    shown = data[(data.panel == "a") & (data.rms_slope == 0.2)]
    assert len(shown) == count and shown.radius.gt(0).all() and shown.x_quantity.str.fullmatch("x .µm.").all()


def test_figures_are_in_the_order_of_their_numbers_and_can_be_drawn():
    names = list(Figures.model_fields)
    numbers = [figure_number(name) for name in names]
    assert numbers == sorted(set(numbers)) and len(numbers) == 21
    for name in names:
        assert callable(drawing_function(name))


def test_a_figure_without_data_has_an_empty_table(tmp_path):
    files = [tmp_path / name for name in ("a.png", "a.pdf", "a.txt", "a.csv")]
    study = small.tree()["slopes"].to_dataset()
    write_dataset(DataTree.from_dict({"/none": study.assign(step_count=0 * study["step_count"])}), tmp_path / "none.nc")
    inputs = {"campaign": str(tmp_path / "none.nc")}
    draw_figure("fig2_area_and_gap", *files, inputs=inputs, arguments={"study": "none"})
    assert pd.read_csv(files[3]).empty and "curve" in pd.read_csv(files[3])
