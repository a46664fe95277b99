"""Datasets are whole, byte-stable, free of values that are not finite, and complete."""

import cyclic_campaign as cyclic
import netCDF4
import numpy as np
import pytest
import small_campaign as small
import xarray as xr

from icha.datasets import files
from icha.datasets.campaign import select_run
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_campaign, read_dataset, read_run, write_dataset
from icha.datasets.labels import LABELS
from icha.datasets.surface_file import read_surface, write_surface


def simple(values=(1.0, 2.0)):
    return xr.Dataset({"length": ("n", np.array(values), {"units": "m", "long_name": "length"})})


@pytest.mark.parametrize("what", ["run", "tree", "surface"])
def test_the_same_values_give_the_same_bytes(tmp_path, what):
    for name in ("one.nc", "deep/two.nc"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        if what == "surface":
            write_surface(tmp_path / name, small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
        else:
            write_dataset(small.run() if what == "run" else small.tree(), tmp_path / name)
    assert (tmp_path / "one.nc").read_bytes() == (tmp_path / "deep/two.nc").read_bytes()
    if what == "run":
        xr.testing.assert_identical(read_run(tmp_path / "one.nc"), small.run())


def test_a_refused_write_names_the_variable_and_leaves_the_old_file(tmp_path):
    path, unwritable = tmp_path / "x.nc", simple()
    write_dataset(simple(), path)
    before = path.read_bytes()
    for bad in (np.nan, np.inf, -np.inf):
        with pytest.raises(ValueError, match=r"x\.nc.*'length'.*1 of 2.*n=1"):
            write_dataset(simple((1.0, bad)), path)
    with pytest.raises(ValueError, match="'bare' has no units"):
        write_dataset(xr.Dataset({"bare": ("n", [1.0])}), path)
    unwritable.attrs["object"] = {"netCDF": "has no dictionaries"}
    with pytest.raises(TypeError):
        write_dataset(unwritable, path)
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]


def test_surface_round_trip_keeps_heights_and_axes(tmp_path):
    surface = small.surface()
    write_surface(tmp_path / "s.nc", surface, name="rough", seed=1, spectrum=small.SPECTRUM)
    again = read_surface(tmp_path / "s.nc")
    # A surface removes its mean, which is zero but for rounding.
    np.testing.assert_allclose(again.heights, surface.heights, rtol=0, atol=1e-14 * surface.rms_height)
    assert again.period == surface.period
    dataset = read_dataset(tmp_path / "s.nc")
    assert dataset["height"].dims == ("y", "x")
    assert float(dataset["hurst"]) == 0.8
    np.testing.assert_allclose(float(dataset["rms_slope"]), 1.0, rtol=1e-12)


def test_every_run_can_be_taken_out_unchanged():
    tree = small.tree()
    orders = {tuple(run["snapshot_kind"].values) for labels, run in small.runs() if labels.study == "slopes"}
    assert len(orders) == 2, "the small campaign must hold both orders for this to mean anything"
    for labels, run in small.runs():
        taken = select_run(tree, labels)
        assert set(run.variables) - set(taken.variables) == set()
        # Slopes meet their snapshots in different orders; the campaign gives them one.
        order = [int(np.flatnonzero(run["snapshot_target"] == t)[0]) for t in taken["snapshot_target"]]
        for name, variable in run.data_vars.items():
            if "spot" in variable.dims or name in ("seed", "rms_slope"):
                continue
            expected = variable.isel(snapshot=order) if "snapshot" in variable.dims else variable
            np.testing.assert_array_equal(taken[name].values, expected.values, err_msg=f"{labels} {name}")
        for own, theirs in enumerate(order):
            for name in ("spot_x", "spot_radius", "spot_force"):
                np.testing.assert_array_equal(
                    taken[name].values[taken["spot_snapshot"].values == own],
                    run[name].values[run["spot_snapshot"].values == theirs],
                )


def test_a_run_with_failed_checks_keeps_its_values_and_reasons(tmp_path):
    """It has its own status; its values stay in the file, and reasons belong to one run only."""
    (first, run), (second, other) = [each for each in small.runs() if each[0].study == "slopes"][:2]
    reasons = {"failed_checks": "loss: -0.1 (a loss)", "applicability": "asperity model not applicable: a reason"}
    tree = campaign_tree([(first, run.assign_attrs(reasons)), (second, other)])
    taken, whole = select_run(tree, first), select_run(tree, second)
    assert {name: taken.attrs[name] for name in reasons} == reasons
    assert "failed_checks" not in whole.attrs and whole.attrs["applicability"] == ""
    status = np.array(tree["slopes"]["status"].attrs["flag_meanings"].split())[tree["slopes"]["status"].values]
    assert sorted(set(status.flat) - {"not_in_design"}) == ["complete", "failed_checks"]
    np.testing.assert_array_equal(taken["contact_area_fraction"].values, run["contact_area_fraction"].values)


def test_runs_may_come_as_files_in_any_order(tmp_path):
    (failed, run), *others = small.runs()
    runs = [(failed, run.assign_attrs(incomplete="lost at 3 µm")), *others]
    pairs = []
    for k, (labels, run) in enumerate(runs):
        write_dataset(run, tmp_path / f"{k}.nc")
        pairs.append((labels, tmp_path / f"{k}.nc"))
    design = [labels for labels, _ in pairs]
    for name, given in (("one.nc", pairs), ("two.nc", reversed(pairs)), ("three.nc", iter(runs))):
        write_dataset(campaign_tree(given, design=design), tmp_path / name)
        xr.testing.assert_identical(read_campaign(tmp_path / name), campaign_tree(runs))
    assert select_run(read_campaign(tmp_path / "one.nc"), failed).attrs["incomplete"] == "lost at 3 µm"
    assert len({(tmp_path / name).read_bytes() for name in ("one.nc", "two.nc", "three.nc")}) == 1


def other(pair, name):
    """A run whose values of one variable are others."""
    return pair[0], pair[1].assign({name: pair[1][name] * 1.001})


def test_runs_that_cannot_be_in_a_campaign_are_refused_by_name(tmp_path):
    slopes, single = ([pair for pair in small.runs() if pair[0].study == study] for study in ("slopes", "single"))
    labels, run = slopes[0]
    write_dataset(run, tmp_path / "run.nc")
    whole = (tmp_path / "run.nc").read_bytes()
    for name, content in (("cut.nc", whole[: len(whole) // 2]), ("text.nc", b"nonsense"), ("empty.nc", b"")):
        (tmp_path / name).write_bytes(content)
    write_dataset(simple(), tmp_path / "other.nc")
    second = labels._replace(seed=2)
    odd = run.assign(contact_modulus=run["contact_modulus"] * 2, seed=run["seed"] + 1)
    for runs, design, message in (
        ([(labels, run), (second, tmp_path / "cut.nc")], None, r"cut\.nc: not a readable"),
        ([(labels, run), (second, tmp_path / "text.nc")], None, r"text\.nc: not a readable"),
        ([(labels, run), (second, tmp_path / "empty.nc")], None, r"empty\.nc: "),
        ([(labels, tmp_path / "other.nc")], None, r"other\.nc: not a run dataset"),
        ([(labels, run), (second, odd)], None, "contact_modulus differs"),
        ([(labels, run)], [labels._replace(study="single")], r"slopes/.*/soft: this run is not in the design"),
        ([(labels, run)], [labels._replace(material="hertz")], r"slopes/.*/soft: this run is not in the design"),
        ([(labels, run), (labels, run)], None, "given twice"),
        # The materials share the gaps' bins, the seeds the pressures'.
        ([slopes[0], other(slopes[1], "gap_bin_edges")], None, "gap_bin_edges differs between runs that share"),
        ([single[0], other(single[1], "pressure_bin_edges")], None, "pressure_bin_edges differs between runs"),
    ):
        with pytest.raises(ValueError, match=message):
            campaign_tree(runs, design=design)


def test_a_run_that_ends_early_keeps_its_spots_where_others_meet_their_snapshots_in_another_order(tmp_path):
    *others, (labels, run) = [(each, run) for each, run in small.runs() if each.study == "slopes"]
    assert not np.array_equal(run["snapshot_kind"].values, others[0][1]["snapshot_kind"].values)
    short = run.isel(step=slice(0, 3), snapshot=slice(0, 1), spot=np.flatnonzero(run["spot_snapshot"] == 0))
    write_dataset(campaign_tree([*others, (labels, short)]), tmp_path / "c.nc")
    taken = select_run(read_campaign(tmp_path / "c.nc"), labels)
    assert taken.attrs["incomplete"] == "1 of 2 snapshots" and taken.sizes["step"] == 3
    for name in ("snapshot", "snapshot_kind", "spot_snapshot", "spot_radius", "nominal_pressure"):
        np.testing.assert_array_equal(taken[name].values, short[name].values)


def test_a_state_that_unloading_does_not_reach_is_no_failure(tmp_path):
    """Whether unloading reaches a tension depends on the result; leaving out such runs would bias means."""
    pairs = [(labels, run) for labels, run in small.runs() if labels.study == "slopes"]
    later = str(pairs[0][1]["snapshot_kind"].values[1])
    for k, (labels, run) in enumerate(pairs):
        kinds = [f"unloading_{kind}" if kind == later else kind for kind in run["snapshot_kind"].values.tolist()]
        pairs[k] = labels, run.assign(snapshot_kind=run["snapshot_kind"].copy(data=np.array(kinds, object)))
    (labels, run), *others = pairs
    short = run.isel(snapshot=slice(0, 1), spot=np.flatnonzero(run["spot_snapshot"] == 0))
    write_dataset(campaign_tree([(labels, short), *others]), tmp_path / "c.nc")
    tree = read_campaign(tmp_path / "c.nc")
    taken = select_run(tree, labels)
    assert "incomplete" not in taken.attrs
    # A hole in a snapshot that a run has is refused as before.
    tree["slopes"]["overlap_fraction"].values[..., 0] = np.nan
    with pytest.raises(ValueError, match="'overlap_fraction' holds"):
        write_dataset(tree, tmp_path / "holed.nc")
    for name in ("snapshot", "snapshot_kind", "spot_snapshot", "spot_radius", "nominal_pressure"):
        np.testing.assert_array_equal(taken[name].values, short[name].values)


def same(taken, run, labels):
    """That a run taken out of a campaign is what was put into it, and of the same kind."""
    assert set(taken.data_vars) == {*run.data_vars, "model", "surface", "material"}
    assert set(taken.coords) == set(run.coords)
    for name, variable in run.variables.items():
        where = f"{labels} {name}"
        assert taken[name].dims == variable.dims, where
        assert taken[name].dtype.kind in ("iu" if variable.dtype.kind in "iu" else variable.dtype.kind + "OU"), where
        np.testing.assert_array_equal(taken[name].values, variable.values, err_msg=where)


@pytest.mark.parametrize("kept", ["in memory", "from its file", "left in its file"])
def test_runs_of_different_lengths_are_taken_out_unchanged(tmp_path, monkeypatch, kept):
    tree = cyclic.tree()
    if kept != "in memory":
        write_dataset(campaign_tree(cyclic.runs().items()), tmp_path / "c.nc")
        monkeypatch.setattr(files, "LEFT_IN_FILE", 0 if kept == "left in its file" else 2**30)
        tree = read_campaign(tmp_path / "c.nc")
        assert tree["loops"].variables["work"]._in_memory == (kept == "from its file")
    lengths = set()
    for labels, run in cyclic.runs().items():
        # The slope is known by its label, which the surface has but for rounding.
        same(select_run(tree, labels).drop_vars("rms_slope"), run.drop_vars("rms_slope"), labels)
        lengths.add((labels.study, run.sizes["step"], run.sizes.get("event")))
    assert len(lengths) == 5, "the runs must differ for this to mean anything"


def test_padding_is_missing_and_nothing_else_is(tmp_path):
    for name in ("one.nc", "two.nc"):
        write_dataset(cyclic.tree() if name == "one.nc" else read_campaign(tmp_path / "one.nc"), tmp_path / name)
    assert (tmp_path / "one.nc").read_bytes() == (tmp_path / "two.nc").read_bytes()
    study = read_campaign(tmp_path / "one.nc")["loops"].to_dataset()
    count = study["step_count"]
    assert count.dtype.kind == "i" and count.dims == LABELS
    assert int(count.max()) == study.sizes["step"] > int(count.min())
    beyond = (study["step"] >= count).transpose(*LABELS, "step")
    for name, variable in study.variables.items():
        if variable.dtype.kind != "f":
            continue
        lacking = np.isnan(variable.values)
        np.testing.assert_array_equal(lacking, beyond.values if "step" in variable.dims else False, err_msg=name)
    np.testing.assert_array_equal(study["branch"] == "", beyond)
    assert "branch" in study.coords and set(study.indexes) == {*LABELS, "step", "snapshot"}
    with netCDF4.Dataset(tmp_path / "one.nc") as file:
        group = file["loops"]
        assert group["spot_count"].dtype == group["leg"].dtype == np.int32
        assert "_FillValue" not in group["step_count"].ncattrs() and "_FillValue" not in group["event_step"].ncattrs()
        assert group["event_kind"].dtype == np.int8
    assert study["control"].item() == "separation"


def test_a_hole_before_the_padding_is_refused(tmp_path):
    labels = next(labels for labels in cyclic.runs() if labels.material == "hertz")
    runs = {key: run for key, run in cyclic.runs().items() if key.study == "loops"}
    holed = runs[labels].copy(deep=True)
    holed["work"][-1] = np.nan
    with pytest.raises(ValueError, match="'work' holds 1 of"):
        write_dataset(campaign_tree((runs | {labels: holed}).items()), tmp_path / "c.nc")
    tree = cyclic.tree().copy(deep=True)
    tree["loops"]["work"].values[..., -1] = np.inf
    with pytest.raises(ValueError, match="'work' holds"):
        write_dataset(tree, tmp_path / "c.nc")


def test_a_run_that_broke_off_on_its_way_back_has_no_pull_off(tmp_path):
    runs = {labels: run for labels, run in cyclic.runs().items() if labels.study == "loops"}
    broken = next(iter(runs))
    lost = [name for name in runs[broken].data_vars if name.startswith(("loss_", "hysteresis_", "pull_off_"))]
    short = runs[broken].isel(step=slice(0, 6)).drop_vars(lost).assign_attrs(incomplete="the path ends there")
    # Whichever comes first: what the others have is what the study has.
    for order in (runs | {broken: short}, {broken: short} | runs):
        order = order | {broken: short}
        write_dataset(campaign_tree(order.items()), tmp_path / "c.nc")
        tree = read_campaign(tmp_path / "c.nc")
        assert [int(n) for n in np.unique(tree["loops"]["status"], return_counts=True)[1]] == [3, 1]
        taken = select_run(tree, broken)
        assert taken.attrs["incomplete"] == "the path ends there"
        assert set(lost).isdisjoint(taken.variables)
        np.testing.assert_array_equal(taken["work"].values, short["work"].values)
        whole = list(runs)[1]
        same(select_run(tree, whole).drop_vars("rms_slope"), runs[whole].drop_vars("rms_slope"), whole)
