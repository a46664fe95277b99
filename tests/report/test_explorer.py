"""The page for exploring: it shows the numbers that xarray reads; its size is limited; wrong calls are refused."""

import base64
import io
import json
import re

import numpy as np
import pytest
import xarray as xr
from explorer_results import FAILED, NOTHING, REASON, runs, write_results
from PIL import Image
from typer.testing import CliRunner

from icha.cli import app
from icha.deposit.verify import CRATE
from icha.report.explorer import encode_map, encode_run, encode_topography, find_partners, write_explorer


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_results(tmp_path_factory.mktemp("results"))


@pytest.fixture(scope="module")
def page(folder):
    written = write_explorer(folder, folder / "explore.html", largest=20)
    assert written.size == (folder / "explore.html").stat().st_size
    return folder / "explore.html"


@pytest.fixture(scope="module")
def data(page):
    return data_of(page)


def data_of(page):
    """Read the data of a page as its script does."""
    text = page.read_text(encoding="utf-8")
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])


def numbers(text, dtype="<f4"):
    return np.frombuffer(base64.b64decode(text), dtype)


def contact_of(data, labels):
    names = ("study", "surface", "rms_slope", "material", "seed")
    wanted = {name: getattr(labels, name) for name in names}
    return next(each for each in data["contacts"] if {name: each[name] for name in names} == wanted)


def plain(folder, labels):
    """Read a run of the campaign dataset, with its steps and spots, with xarray only."""
    study = xr.open_datatree(folder / "dataset/small.nc")[labels.study].to_dataset()
    names = ("model", "surface", "seed", "rms_slope", "material")
    run = study.sel({name: getattr(labels, name) for name in names})
    own = np.ones(study.sizes["spot"], bool)
    for name in names:
        own &= study[name].values[study[f"spot_{name}"].values] == getattr(labels, name)
    return run.isel(step=slice(0, int(run["step_count"])), spot=own)


@pytest.mark.parametrize("model", ["asperities", "boundary_elements"])
def test_numbers_are_those_of_the_dataset(folder, data, model):
    for labels in (each for each in runs() if each.model == model and each != NOTHING):
        shown, run = contact_of(data, labels)["runs"][model], plain(folder, labels)
        for name, variable in (("pressure", "reduced_pressure"), ("area", "contact_area_fraction")):
            np.testing.assert_array_equal(numbers(shown[name]), run[variable].values.astype("f4"))
        np.testing.assert_array_equal(numbers(shown["gap"]), run["reduced_separation"].values.astype("f4"))
        assert shown["spots"] == run["spot_count"].values.tolist() and shown["leg"] == run["leg"].values.tolist()
        # A failed run lacks snapshots that others have.
        kept = np.flatnonzero(np.isfinite(run["snapshot_step"].values))
        assert [each["step"] for each in shown["snapshots"]] == run["snapshot_step"].values[kept].tolist()
        for k, snapshot in zip(kept, shown["snapshots"], strict=True):
            check_snapshot(snapshot, run.isel(snapshot=k), run.isel(spot=run["spot_snapshot"].values == k), model)


def check_snapshot(shown, run, spots, model):
    """Compare circles one by one, pressures by bin, and integrals of curves of joined bins."""
    if model == "asperities":
        for own, name in zip(shown["circles"], ("spot_x", "spot_y", "spot_radius"), strict=True):
            np.testing.assert_array_equal(numbers(own), spots[name].values.astype("f4"))
        unit = float(run["contact_modulus"]) * float(run["rms_slope"])
        at, density = map(numbers, shown["pressure"])
        expected = run["pressure_density"].values * unit
        np.testing.assert_allclose(at, (run["pressure_bin_centre"].values / unit)[expected > 1e-3 * expected.max()])
        np.testing.assert_allclose(density, expected[expected > 1e-3 * expected.max()], rtol=1e-6)
    areas = np.pi * spots["spot_radius"].values ** 2
    size, larger = map(numbers, shown["larger"])
    cell = float(run["period"]) ** 2
    assert larger[0] == pytest.approx((areas > 0).sum() / cell) and larger[-1] == pytest.approx(1 / cell)
    assert size[-1] == pytest.approx(areas.max())
    gap, density = map(numbers, shown["gap"])
    height = float(run["rms_height"])
    outside = (run["gap_density"] * np.diff(run["gap_bin_edges"])).sum()
    assert np.trapezoid(density, gap) == pytest.approx(float(outside), rel=0.2)
    assert gap[-1] * height < run["gap_bin_edges"].max()


def test_heights_are_those_of_the_surface(folder, data):
    shown = data["topographies"]["surfaces/rough/seed2.nc"]
    surface = xr.open_dataset(folder / "surfaces/rough/seed2.nc")
    expected = (surface["height"] / surface["rms_height"]).transpose("y", "x").values
    levels = numbers(shown["levels"], "u1").reshape(shown["cells"], shown["cells"])
    heights = shown["low"] + (shown["high"] - shown["low"]) / 255 * levels
    np.testing.assert_allclose(heights, expected, atol=(shown["high"] - shown["low"]) / 500)


def test_large_topographies_are_means_over_blocks():
    fine = np.random.default_rng(1).normal(size=(512, 512))
    shown = encode_topography(xr.Dataset({"height": (("y", "x"), fine), "rms_height": 2.0}))
    means = fine.reshape(256, 2, 256, 2).mean(axis=(1, 3)) / 2
    assert (shown["grid"], shown["cells"]) == (512, 256)
    assert (shown["low"], shown["high"]) == (pytest.approx(means.min()), pytest.approx(means.max()))


def test_maps_are_those_of_the_runs_with_their_first_row_at_the_bottom(data):
    for labels, run in runs().items():
        if labels.model == "boundary_elements":
            snapshots = contact_of(data, labels)["runs"]["boundary_elements"]["snapshots"]
            for k, snapshot in enumerate(snapshots):
                image = Image.open(io.BytesIO(base64.b64decode(snapshot["map"]))).convert("RGBA")
                pixels = np.asarray(image)
                np.testing.assert_allclose(pixels[::-1, :, 3] / 255, run["contact_map"][k], atol=0.003)
                assert set(map(tuple, pixels[..., :3].reshape(-1, 3))) == {(230, 0, 13)}
    half = np.asarray(Image.open(io.BytesIO(base64.b64decode(encode_map(np.full((4, 4), 0.5))))).convert("RGBA"))
    assert (half[..., 3] == 128).all()


def test_both_models_are_at_the_same_stop(data):
    contact = next(each for each in data["contacts"] if len(each["runs"]) == 2)
    assert list(contact["runs"]) == ["asperities", "boundary_elements"]
    own, other = contact["runs"].values()
    assert [other["stops"][k] for k in other["partners"]] == own["stops"]
    assert own["stops"][0] == "reduced_pressure 0.003"


def test_between_stops_the_other_model_is_at_the_nearest_separation():
    def path(kinds, targets, legs, separations):
        columns = {"step_kind": kinds, "step_target": targets, "leg": legs, "mean_separation": separations}
        return xr.Dataset({name: ("step", np.array(values)) for name, values in columns.items()})

    one = path(["load", "path", "load", "path", "path"], [1, 4.0, 2, 3.5, 9], [0, 0, 0, 1, 2], [5, 4, 3, 3.5, 9])
    other = path(["path", "load", "path", "path"], [4.4, 1, 2.0, 3.6], [0, 0, 1, 1], [4.4, 3.7, 2, 3.6])
    assert find_partners(one, other) == [1, 1, -1, 3, -1]


def test_failures_are_shown_and_runs_without_a_stop_are_counted(folder, page, data):
    assert contact_of(data, FAILED)["runs"]["asperities"]["failure"] == REASON
    assert NOTHING[0] == "slopes" and len(data["contacts"]) == len({each._replace(model="") for each in runs()}) - 1
    assert "Omitted: 1 contact whose runs reached no target" in page.read_text(encoding="utf-8")


def test_the_page_needs_no_other_files_and_no_network(page):
    text = page.read_text(encoding="utf-8")
    own = text[: text.index("<script>")] + text[text.index('<script type="application/json"') :]
    assert "default-src 'none'" in own and not re.search(r"https?://(?!www\.w3\.org/2000/svg)", own)
    assert not re.search(r"<(script|img|iframe|object)[^>]* src=", own) and "@import" not in own
    # A title cannot end a script.
    assert text.count("</script>") == 3 and "Small &lt;/script&gt; campaign" in text


def test_the_size_of_a_page_is_limited(folder, page, data, tmp_path):
    library = page.stat().st_size - len(json.dumps(data))
    largest = (library + 0.6 * len(json.dumps(data))) / 1e6
    written = write_explorer(folder, tmp_path / "less.html", largest=largest)
    assert 0 < written.size <= largest * 1e6 and 0 < written.left_out
    assert written.shown + written.left_out + written.without_steps == len(data["contacts"]) + 1
    shown = [(each["study"], each["material"], each["seed"]) for each in data_of(tmp_path / "less.html")["contacts"]]
    # The first seed of each contact precedes the others.
    assert {("one", "soft", 1), ("one", "hertz", 1), ("loops", "soft", 1)} <= set(shown)
    assert [seed for *_, seed in shown] == sorted(seed for *_, seed in shown)
    assert f"Omitted: {written.left_out} contacts" in (tmp_path / "less.html").read_text(encoding="utf-8")
    with pytest.raises(ValueError, match="not even one contact"):
        write_explorer(folder, tmp_path / "none.html", largest=1)
    assert not (tmp_path / "none.html").exists()


def test_runs_without_files_lack_their_maps_only(folder, tmp_path):
    alone = tmp_path / "results"
    for part in ("dataset", "surfaces"):
        (alone / part).parent.mkdir(exist_ok=True)
        (alone / part).symlink_to(folder / part)
    write_explorer(alone, tmp_path / "page.html", only={"study": ["one"], "seed": [1]}, largest=20)
    contacts = data_of(tmp_path / "page.html")["contacts"]
    assert {(each["study"], each["seed"]) for each in contacts} == {("one", 1)}
    for snapshot in contacts[0]["runs"]["boundary_elements"]["snapshots"]:
        assert "map" not in snapshot and "circles" not in snapshot and snapshot["gap"]


def test_full_contact_has_no_gaps_but_a_page():
    run = next(run for labels, run in runs().items() if labels.model == "boundary_elements")
    shown = encode_run(run.assign(gap_density=run["gap_density"] * 0.0, grid=32), None)
    assert [snapshot["gap"] for snapshot in shown["snapshots"]] == [["", ""]] * run.sizes["snapshot"]


def test_the_command_writes_the_page_and_refuses_wrong_calls(folder, tmp_path):
    def icha(*arguments):
        return CliRunner().invoke(app, ["explore", *map(str, arguments)])

    done = icha(folder, "--study", "loops", "--output", tmp_path / "own.html")
    assert done.exit_code == 0 and {each["study"] for each in data_of(tmp_path / "own.html")["contacts"]} == {"loops"}
    write_explorer(folder, tmp_path / "again.html", only={"study": ["loops"]}, largest=20)
    assert (tmp_path / "again.html").read_bytes() == (tmp_path / "own.html").read_bytes()
    for name in ("empty", "deposit", "missing/dataset"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "deposit" / CRATE).write_text("")
    (tmp_path / "missing/dataset/small.nc").symlink_to(folder / "dataset/small.nc")
    for arguments, reason in (
        ([tmp_path / "nowhere"], "nowhere has no campaign dataset"),
        ([tmp_path / "empty"], "empty has no campaign dataset"),
        ([tmp_path / "deposit"], "deposit is a deposit"),
        ([folder, "--study", "other"], "study other is not in this campaign; expected slopes, single, one, loops"),
        ([folder, "--size", 1], "not even one contact fits on a page of 1 MB"),
        ([tmp_path / "missing"], "surfaces/rough/seed1.nc: no such file"),
    ):
        refused = icha(*arguments)
        assert refused.exit_code == 2 and reason in " ".join(refused.output.split()), refused.output
    assert not (tmp_path / "missing/explore.html").exists()
