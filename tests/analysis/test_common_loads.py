"""Studies are compared at common loads of the first loading; statistics over seeds against known numbers."""

import cyclic_campaign as cyclic
import numpy as np
import pytest
import small_campaign as small
import xarray as xr

from icha.analysis.common_loads import at_common_loads, compare_campaign, compare_runs, interpolate
from icha.datasets.campaign import reduced_gap
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import LABELS, RunLabels
from icha.figures.select import path_steps
from icha.uncertainty.ensembles import ensemble


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
    areas = comparison[["contact_area_fraction", "contact_area_fraction_at_load"]]
    spread = areas.max("rms_slope") / areas.min("rms_slope") - 1
    assert float(spread["contact_area_fraction"].max()) < 0.03
    # ... but at common stops, the areas are equal.
    first, second = (path_steps(run)["contact_area_fraction"].values for _, run in runs)
    np.testing.assert_allclose(first, second, rtol=1e-6)
    assert float(spread["contact_area_fraction_at_load"].min()) > 1


def test_known_numbers():
    # Student's own table: 2.776 for four degrees of freedom, 12.706 for one.
    five = ensemble([1.0, 2.0, 3.0, 4.0, 5.0])
    assert (float(five.mean), float(five.deviation), int(five.count)) == (3.0, pytest.approx(np.sqrt(2.5)), 5)
    assert float(five.confidence) == pytest.approx(2.7764451 * np.sqrt(2.5 / 5), rel=1e-7)
    two = ensemble([1.0, 3.0])
    assert float(two.confidence) == pytest.approx(12.7062047, rel=1e-7)
    # Bands hold the mean nineteen times of twenty.
    over = ensemble(np.random.default_rng(2).normal(1.0, 3.0, (4, 40000)))
    held = np.mean(np.abs(over.mean - 1.0) <= over.confidence)
    assert held == pytest.approx(0.95, abs=4 * np.sqrt(0.05 * 0.95 / 40000))
    # Members without a value do not count.
    over = ensemble([[1.0, np.nan, np.nan], [3.0, 5.0, np.nan]])
    np.testing.assert_array_equal([over.count, over.mean], [[2, 1, 0], [2.0, 5.0, np.nan]])
    assert np.isfinite(over.confidence).tolist() == np.isfinite(over.deviation).tolist() == [True, False, False]


def test_bands_of_positive_quantities_stay_above_zero_and_are_the_others_where_they_are_narrow():
    # Three members whose Student's band reaches far below zero.
    over = ensemble([1e-3, 5e-3, 2e-2])
    low, high = over.band()
    assert (low, high) == pytest.approx((over.mean - over.confidence, over.mean + over.confidence)) and low < 0
    low, high = over.band(positive=True)
    assert 0 < low < over.mean < high
    # In the logarithm it is symmetric, with the relative standard error of the mean as its unit.
    assert (
        np.log(high / over.mean) == pytest.approx(np.log(over.mean / low)) == pytest.approx(over.confidence / over.mean)
    )
    narrow = ensemble([0.999, 1.0, 1.001])
    np.testing.assert_allclose(narrow.band(positive=True), narrow.band(), rtol=1e-5)
    np.testing.assert_array_equal(ensemble([-1.0, 1.0]).band(positive=True), ensemble([-1.0, 1.0]).band())


def test_curves_of_other_stops_are_averaged_where_all_are():
    one, other = np.geomspace(1e-4, 1e-1, 9), np.geomspace(1e-3, 1.0, 7)
    at, members = at_common_loads([(one, 2 * one**0.9), (other, 4 * other**0.9)], logarithmic=True)
    over = ensemble(members)
    assert (at[0], at[-1]) == pytest.approx((1e-3, 1e-1))
    np.testing.assert_allclose(over.mean, 3 * at**0.9, rtol=1e-9)
    np.testing.assert_allclose(over.confidence, 12.7062047 * at**0.9, rtol=1e-7)
    apart, _ = at_common_loads(
        [(np.array([1e-3, 2e-3]), np.ones(2)), (np.array([1e-2, 2e-2]), np.ones(2))], logarithmic=True
    )
    assert len(apart) == 0


def test_the_comparison_has_bands_over_the_complete_seeds():
    runs = [(RunLabels("one", "asperities", "rough", seed, 1.0, "soft"), small.run(seed)) for seed in (1, 2, 3)]
    runs.append(
        (RunLabels("one", "asperities", "rough", 4, 1.0, "soft"), small.run(4).assign_attrs(incomplete="a test"))
    )
    comparison = compare_runs(campaign_tree(runs)["one"].to_dataset())
    areas = comparison["contact_area_fraction"].transpose(*LABELS, ...).values[0, 0, :3, 0, 0]
    expected = ensemble(areas)
    assert comparison["seed_count"].item() == 3
    for name in ("mean", "deviation"):
        np.testing.assert_allclose(comparison[f"area_{name}"].values[0, 0, 0, 0], getattr(expected, name), rtol=1e-12)
        assert np.all(comparison[f"separation_{name}"].values > 0)
    # A quarter of the seeds is missing, so no interval is stated.
    assert np.isnan(comparison["area_confidence"]).all()
    whole = compare_runs(campaign_tree(runs[:3])["one"].to_dataset())["area_confidence"]
    np.testing.assert_allclose(whole.values[0, 0, 0, 0], expected.confidence, rtol=1e-12)
    one = compare_runs(campaign_tree(runs[:1])["one"].to_dataset())
    assert np.isnan(one["area_confidence"].values).all() and np.isfinite(one["area_mean"].values).all()


def test_separations_of_a_free_square_are_compared_by_its_mean_gap():
    study = xr.Dataset(
        {
            "reduced_separation": (("surface", "step"), [[2.0, 1.0], [-1.0, -2.0]]),
            "mean_gap": (("surface", "step"), [[4e-6, 2e-6], [3e-6, 1e-6]]),
            "unit_height": ("surface", [2e-6, 1e-6]),
            "boundary": ("surface", ["periodic", "free"]),
        }
    )
    np.testing.assert_allclose(reduced_gap(study), [[2.0, 1.0], [3.0, 1.0]])
    np.testing.assert_allclose(reduced_gap(study.isel(surface=1)), [3.0, 1.0])


def test_a_curve_that_is_below_zero_somewhere_is_averaged_too():
    loads = np.array([1.0, 2.0, 4.0])
    curves = [(loads, np.array([3.0, 1.0, -1.0])), (loads[:2], np.array([3.0, 1.0]))]
    at, values = at_common_loads(curves, logarithmic=True)
    assert at[0] == 1 and at[-1] == pytest.approx(2) and np.isfinite(values).all()
    np.testing.assert_allclose(values[:, [0, -1]], [[3, 1], [3, 1]])
