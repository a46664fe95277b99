"""Studies are compared at common loads of the first loading; interpolation is exact at the stops and monotone."""

import cyclic_campaign as cyclic
import numpy as np
import pytest
import small_campaign as small

from icha.analysis.common_loads import compare_campaign, compare_runs, interpolate
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_campaign, write_dataset
from icha.figures.select import path_steps


def test_comparison_is_of_the_first_loading():
    loops = {labels: run for labels, run in cyclic.runs().items() if labels.study == "loops"}
    loading = campaign_tree((labels, small.run(labels.seed, 1.0, labels.material)) for labels in loops)
    one, other = compare_campaign(cyclic.tree())["loops"], compare_campaign(loading)["loops"]
    assert one.sizes["reduced_pressure"] > 5
    for name in other.data_vars:
        np.testing.assert_array_equal(one[name].values, other[name].values, err_msg=name)


def test_interpolation_is_exact_at_the_stops_and_monotone_between():
    run = small.run()
    load, area = run["reduced_pressure"].values, run["contact_area_fraction"].values
    np.testing.assert_allclose(interpolate(load, area, load, logarithmic=True), area, rtol=1e-12)
    fine = interpolate(load, area, np.geomspace(load[0], load[-1], 200), logarithmic=True)
    assert np.all(np.diff(fine) > 0)
    np.testing.assert_allclose(
        interpolate([1e-3, 1e-2, 1e-1], [2e-3, 2e-2, 2e-1], [3e-3, 5e-2], logarithmic=True), [6e-3, 0.1], rtol=1e-12
    )
    with pytest.raises(ValueError, match="outside"):
        interpolate(load, area, [2 * load[-1]], logarithmic=True)


def test_comparison_of_slopes_without_adhesion_shows_no_spread():
    runs = [(labels, run) for labels, run in small.runs() if labels.material == "hertz"]
    comparison = compare_runs(campaign_tree(runs)["slopes"].to_dataset())
    # The stops of the slopes differ, so the curves agree to the accuracy of interpolation only ...
    assert float(comparison["slope_spread"].max()) < 0.03
    # ... but at common stops, the areas are equal.
    first, second = (path_steps(run)["contact_area_fraction"].values for _, run in runs)
    np.testing.assert_allclose(first, second, rtol=1e-6)
    assert float(comparison["slope_spread_at_load"].min()) > 1


def test_studies_without_a_common_load_are_compared_where_possible(tmp_path):
    labels, run = next((labels, run) for labels, run in small.runs() if labels.study == "slopes")
    steep = run.isel(step=run["reduced_pressure"].values > 5e-3)
    flat = small.run(rms_slope=0.2).isel(step=slice(0, steep.sizes["step"]))
    keep = {"snapshot": slice(0, 0), "spot": slice(0, 0)}
    tree = campaign_tree([(labels, steep.isel(keep)), (labels._replace(rms_slope=0.2), flat.isel(keep))])
    comparison = compare_campaign(tree)
    assert comparison["slopes"].sizes["relative_load"] == 0
    write_dataset(comparison, tmp_path / "c.nc")
    assert read_campaign(tmp_path / "c.nc")["slopes"].sizes["relative_load"] == 0
