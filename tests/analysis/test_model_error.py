"""The error is nothing for a state compared with itself, and the exact number for one changed by a known amount."""

import numpy as np
import pytest
import small_campaign as small
import xarray as xr
from compared_campaign import (
    AREA_FACTORS,
    PRESSURES,
    errors,
    own_patches,
    patches,
    patches_at_finite_range,
    runs,
    tree,
    tree_of_both,
)

import icha
from icha.analysis.model_error import (
    AXES,
    SHARED,
    contact_of_spots,
    distribution_distance,
    jaccard,
    model_error,
    shared,
    state_of,
)
from icha.contact.attraction import FINITE_RANGE, NO_ATTRACTION, SHORT_RANGE
from icha.contact.model import GAP_BINS, PRESSURE_BINS
from icha.datasets.campaign import find_snapshot
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_campaign, write_dataset
from icha.datasets.labels import RunLabels


def compared_with(truths):
    """Return the errors of the study with the given boundary elements."""
    return model_error(tree_of_both(), truths)["one"].to_dataset()


def test_relative_errors_are_those_put_in():
    compared = compared_with(patches(area=1.25, separation=0.8))
    np.testing.assert_allclose(compared["area_error"].values, 1 / 1.25 - 1, rtol=1e-12)
    np.testing.assert_allclose(compared["separation_error"].values, 1 / 0.8 - 1, rtol=1e-12)
    assert compared["area_error"].dims == AXES and compared["area_error"].shape == (1, 3, 1, 2, 2)
    np.testing.assert_array_equal(compared["shared_of_icha"] * compared["shared_of_boundary_elements"], 1)
    run = runs()["one", "asperities", "rough", 2, 1.0, "hertz"]
    at = find_snapshot(run, "reduced_pressure", 1e-2)
    place = {"surface": "rough", "seed": 2, "rms_slope": 1.0, "material": "hertz", "reduced_pressure": 1e-2}
    state = compared.sel(place)
    assert float(state["contact_area_fraction"]) == float(state_of(run, at)["contact_area_fraction"])
    edges = np.diff(state["pressure_bin_edges"].values)
    area = float(state["contact_area_fraction"])
    assert float(np.sum(state["pressure_density"].values * edges)) == pytest.approx(area, rel=1e-9)


def test_the_energetic_area_is_that_of_a_finite_range():
    compared = errors()["one"].to_dataset()
    expected = 1 / (1.2 * np.array(list(AREA_FACTORS.values()))) - 1
    soft, bare = (compared.sel(material=name) for name in ("soft", "hertz"))
    for load in PRESSURES:
        found = soft["energetic_area_error"].sel(reduced_pressure=load).values.ravel()
        np.testing.assert_allclose(found, expected, rtol=1e-12)
    np.testing.assert_array_equal(bare["energetic_area_error"], bare["area_error"])
    assert set(soft["attraction"].values.ravel()) == {FINITE_RANGE}
    assert set(bare["attraction"].values.ravel()) == {NO_ATTRACTION}
    short = compared_with(patches())["attraction"].sel(material="soft")
    assert set(short.values.ravel()) == {SHORT_RANGE}


def distribution(gaps=(), pressures=(), rms_height=2e-6, unit=5e6):
    """A state whose area lies in single bins: pairs of bin and part of the nominal area."""
    gap, pressure, mean = (
        np.zeros(len(GAP_BINS) - 1),
        np.zeros(len(PRESSURE_BINS) - 1),
        np.zeros(len(PRESSURE_BINS) - 1),
    )
    for k, part in gaps:
        gap[k] = part / (np.diff(GAP_BINS)[k] * rms_height)
    for k, part, value in pressures:
        pressure[k], mean[k] = part / (np.diff(PRESSURE_BINS)[k] * unit), value
    return xr.Dataset(
        {
            "gap_density": ("gap_bin", gap),
            "gap_bin_edges": ("gap_edge", GAP_BINS * rms_height),
            "pressure_density": ("pressure_bin", pressure),
            "pressure_bin_mean": ("pressure_bin", mean),
            "pressure_bin_edges": ("pressure_edge", PRESSURE_BINS * unit),
        }
    )


def test_distances_of_shifted_peaks_are_exact():
    # All area in one bin of the gap each: what must be moved is all of it, from centre to centre.
    centre = np.sqrt(GAP_BINS[1:] * GAP_BINS[:-1]) * 2e-6
    one, other = distribution(gaps=[(50, 1.0)]), distribution(gaps=[(70, 1.0)])
    assert distribution_distance("gap", one, other) == pytest.approx(centre[70] - centre[50], rel=1e-12)
    # A tenth in contact more: it goes from the bin to gap zero.
    other = distribution(gaps=[(50, 0.9)])
    assert distribution_distance("gap", one, other) == pytest.approx(0.1 * centre[50], rel=1e-9)
    # 2 % at 3 MPa and 1 % at 6 MPa carry the same: half of the area comes from zero, half goes on by 3 MPa.
    one, other = distribution(pressures=[(200, 0.02, 3e6)]), distribution(pressures=[(230, 0.01, 6e6)])
    assert distribution_distance("pressure", one, other) == pytest.approx(0.01 * 3e6 + 0.01 * 3e6, rel=1e-9)
    assert distribution_distance("pressure", one, other) == distribution_distance("pressure", other, one)
    # Tension counts as any other pressure.
    other = distribution(pressures=[(200, 0.02, 3e6), (150, 0.01, -2e6)])
    assert distribution_distance("pressure", one, other) == pytest.approx(0.01 * 2e6, rel=1e-9)


def test_overlap_of_maps():
    one, other, empty = np.zeros((3, 4, 4), bool)
    one[0, :3], other[0, 1:] = True, True
    assert jaccard(one, other) == jaccard(other, one) == 0.5 and jaccard(empty, empty) == 1 and jaccard(one, empty) == 0
    other[1] = True
    assert shared(one, other) == pytest.approx(2 / 3) and shared(other, one) == pytest.approx(2 / 7)
    assert shared(empty, one) == 1 and shared(one, empty) == 0


def test_spots_lie_where_boundary_elements_find_contact():
    """A map that is mirrored, transposed or shifted by a few cells shares next to nothing with the other map."""
    labels = RunLabels("one", "asperities", "rough", 1, 1.0, "hertz")
    path = icha.Path(reduced_pressures=PRESSURES[:1], max_step=0.2)
    fine = small.surface(1).refined(2)
    truth = icha.simulate(fine, small.MATERIALS["hertz"], path, seed=1, model="boundary_elements")
    compared = compared_with([(labels._replace(model="boundary_elements"), truth)]).isel(dict.fromkeys(AXES, 0))
    assert float(compared["jaccard"]) > 0.5
    contact = truth["contact_map"].values[0] >= 0.5
    spots = contact_of_spots(runs()[labels], 0, len(contact))
    assert float(compared["jaccard"]) == jaccard(spots, contact)
    for other in (contact.T, contact[::-1], contact[:, ::-1], np.roll(contact, 8, 0), np.roll(contact, 8, 1)):
        assert jaccard(spots, other) < 0.3
    # Both carry the same load: less contact is at higher pressure, so the distance is at least the areas' difference
    # times the lowest pressure, and it is less than twice the mean pressure in any case.
    assert 0 < float(compared["pressure_distribution_distance"]) < 2
    assert abs(float(compared["area_error"])) < 0.3 and abs(float(compared["separation_error"])) < 0.1


def test_a_part_of_a_study(tmp_path):
    one = patches(lambda labels: labels.material == "soft" and labels.seed == 3)
    found = model_error(campaign_tree([*runs().items(), *one]), one, attrs={"license": "CC0-1.0"})
    assert list(found.children) == ["one"] and found.attrs["license"] == "CC0-1.0"
    assert found["one"]["material"].values.tolist() == ["soft"] and found["one"]["seed"].values.tolist() == [3]
    write_dataset(found, tmp_path / "a.nc")
    read = read_campaign(tmp_path / "a.nc")
    np.testing.assert_array_equal(read["one"]["jaccard"].values, found["one"]["jaccard"].values)


LABELS = RunLabels("one", "asperities", "rough", 1, 1.0, "soft")
TRUTH = LABELS._replace(model="boundary_elements")


def test_what_cannot_be_compared_is_named():
    truth = own_patches(runs()[LABELS])
    for name in SHARED:
        with pytest.raises(ValueError, match=f"{TRUTH}: {name}"):
            model_error(tree(), [(TRUTH, truth.assign({name: float(truth.get(name, 0.0)) * 1.001 or 1e-6}))])
    with pytest.raises(ValueError, match=f"{TRUTH}: adhesion_map_kind is '' for the run, 'map'"):
        model_error(tree(), [(TRUTH, truth.assign(adhesion_map_kind="map"))])
    with pytest.raises(ValueError, match=f"{TRUTH}: shape is '' for the run, 'sphere of radius 0.001 m'"):
        model_error(tree(), [(TRUTH, truth.assign(shape="sphere of radius 0.001 m"))])
    with pytest.raises(ValueError, match=f"{TRUTH}: seed is 1 for the run, 2 for the other run"):
        model_error(tree(), [(TRUTH, truth.assign(seed=2))])
    with pytest.raises(ValueError, match="no seed 9"):
        model_error(tree(), [(TRUTH._replace(seed=9), truth)])


def test_runs_that_ended_early_do_not_count(tmp_path):
    """Of three seeds one run has failed; of the other material two have, and one has no boundary elements."""
    failed = [LABELS._replace(seed=3), *(LABELS._replace(seed=k, material="hertz") for k in (1, 2))]
    nothing = {"step": slice(0, 0), "snapshot": slice(0, 0), "spot": slice(0, 0)}
    members = {
        labels: run.isel(nothing).assign_attrs(incomplete="sticky") if labels in failed else run
        for labels, run in runs().items()
    }
    unsolved = TRUTH._replace(seed=3, material="hertz")
    truths = [(labels, run) for labels, run in patches_at_finite_range() if labels != unsolved]
    found = model_error(campaign_tree([*members.items(), *truths]), truths)
    write_dataset(found, tmp_path / "e.nc")
    for study in (found["one"].to_dataset(), read_campaign(tmp_path / "e.nc")["one"].to_dataset()):
        soft, bare = (study.isel(surface=0, rms_slope=0).sel(material=name) for name in ("soft", "hertz"))
        assert soft["status"].values.tolist() == [0, 0, 1] and bare["status"].values.tolist() == [1, 1, 3]
        known = np.array([1 / 1.1, 1 / 1.2]) - 1
        np.testing.assert_allclose(soft["area_error"].values, [[known[0]] * 2, [known[1]] * 2, [np.nan] * 2])
        np.testing.assert_allclose(soft["area_error_mean"].values, known.mean())
        np.testing.assert_allclose(soft["area_error_deviation"].values, abs(known[0] - known[1]) / np.sqrt(2))
        assert np.isnan(bare["area_error"]).all() and np.isnan(bare["area_error_mean"]).all()
