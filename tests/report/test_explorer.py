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
from icha.datasets.campaign import select_run
from icha.datasets.files import read_campaign
from icha.deposit.verify import CRATE
from icha.report.explorer import encode_snapshot, picture, write_explorer
from icha.support.formatting import printable


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_results(tmp_path_factory.mktemp("results"))


@pytest.fixture(scope="module")
def page(folder):
    assert write_explorer(folder, folder / "explore.html", largest=20)[1] == 1
    return folder / "explore.html"


@pytest.fixture(scope="module")
def data(page):
    return data_of(page)


def data_of(page):
    """Read the data of a page as its script does."""
    text = page.read_text(encoding="utf-8")
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])


def contact_of(data, labels):
    wanted = (labels.study, labels.surface, f"{labels.rms_slope:g}", labels.material, str(labels.seed))
    names = ("study", "surface", "rms_slope", "material", "seed")
    return next(each for each in data["contacts"] if tuple(each[name] for name in names) == wanted)


@pytest.mark.parametrize("model", ["asperities", "boundary_elements"])
def test_numbers_are_those_of_the_dataset(folder, data, model):
    tree = read_campaign(folder / "dataset/small.nc")
    for labels in (each for each in runs() if each.model == model and each != NOTHING):
        shown, run = contact_of(data, labels), select_run(tree, labels)
        (_, _, area), (_, _, gap) = shown["curves"]
        close = {"rtol": 1e-4}
        np.testing.assert_allclose(area[model], [run["reduced_pressure"], run["contact_area_fraction"]], **close)
        np.testing.assert_allclose(gap[model][1], run["reduced_separation"], **close)
        # A failed run lacks snapshots that others have.
        snapshots = [state[model] for state in shown["states"] if model in state]
        for k, snapshot in zip(np.argsort(run["snapshot_step"].values), snapshots, strict=True):
            step = int(run["snapshot_step"].values[k])
            np.testing.assert_allclose(snapshot["points"][0], np.array(area[model])[:, step])
            assert snapshot["leg"] == ("unloading" if run["leg"].values[step] % 2 else "loading")
            check_contact(snapshot, run.isel(snapshot=k), run.isel(spot=run["spot_snapshot"].values == k), model)


def check_contact(shown, run, spots, model):
    """Compare circles one by one, pressures by bin, and the integral of gaps in joined bins."""
    if model == "asperities":
        period = float(run["period"])
        expected = np.array([spots[f"spot_{name}"] for name in ("x", "y", "radius")]) * 1000 / period
        np.testing.assert_allclose(np.reshape(shown["circles"], (-1, 3)).T, expected, rtol=1e-4, atol=1e-9)
        unit = float(run["contact_modulus"]) * float(run["rms_slope"])
        at, density = shown["densities"][1]
        expected = run["pressure_density"].values * unit
        np.testing.assert_allclose(density, expected[expected > 1e-3 * expected.max()], rtol=1e-4)
        assert len(at) == len(density)
    gap, density = shown["densities"][0]
    outside = (run["gap_density"] * np.diff(run["gap_bin_edges"])).sum()
    assert np.trapezoid(density, gap) == pytest.approx(float(outside), rel=0.2)


def image_of(text):
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(text))).convert("RGBA"))[::-1]


def test_pictures_have_their_first_row_at_the_bottom(folder, data):
    for labels, run in runs().items():
        if labels.model == "boundary_elements":
            shown = [state[labels.model]["map"] for state in contact_of(data, labels)["states"]]
            for k, pixels in enumerate(map(image_of, shown)):
                np.testing.assert_allclose(pixels[..., 3] / 255, run["contact_map"][k], atol=0.003)
                assert set(map(tuple, pixels[..., :3].reshape(-1, 3))) == {(230, 0, 13)}
    heights = xr.open_dataset(folder / "surfaces/rough/seed2.nc")["height"].transpose("y", "x").values
    expected = (heights - heights.min()) / np.ptp(heights)
    np.testing.assert_allclose(
        image_of(data["topographies"]["surfaces/rough/seed2.nc"])[..., 0] / 255, expected, atol=0.003
    )
    fine = np.random.default_rng(1).random((1024, 1024))
    means = fine.reshape(512, 2, 512, 2).mean(axis=(1, 3))
    np.testing.assert_allclose(image_of(picture(fine))[..., 0] / 255, means, atol=0.003)


def test_both_models_are_at_the_same_target(data):
    contact = next(each for each in data["contacts"] if len(each["curves"][0][2]) == 2)
    for state in contact["states"]:
        assert list(state) == ["asperities", "boundary_elements"]
        (one, _), (other, _) = (snapshot["points"][0] for snapshot in state.values())
        assert one == pytest.approx(other, rel=1e-3)


def test_the_page_shows_failures_counts_runs_without_a_step_and_needs_no_network(page, data):
    text = page.read_text(encoding="utf-8")
    assert contact_of(data, FAILED)["failures"]["asperities"] == printable(REASON)
    assert not {"\u202e", "\x1b"} & set(text) and "Omitted: 1 without any step" in text
    assert NOTHING[0] == "slopes" and len(data["contacts"]) == len({each._replace(model="") for each in runs()}) - 1
    assert "default-src 'none'" in text and "://" not in text
    assert not re.search(r"<(script|img|iframe|object)[^>]* src=", text) and "@import" not in text
    # A title cannot end a script.
    assert text.count("</script>") == 2 and "Small &lt;/script&gt; campaign" in text


def test_runs_without_files_lack_their_maps_only(folder, tmp_path):
    alone = tmp_path / "results"
    for part in ("dataset", "surfaces"):
        (alone / part).parent.mkdir(exist_ok=True)
        (alone / part).symlink_to(folder / part)
    write_explorer(alone, tmp_path / "page.html", only={"study": ["one"], "seed": [1]}, largest=20)
    contacts = data_of(tmp_path / "page.html")["contacts"]
    assert {(each["study"], each["seed"]) for each in contacts} == {("one", "1")}
    for state in contacts[0]["states"]:
        snapshot = state["boundary_elements"]
        assert "map" not in snapshot and "circles" not in snapshot and snapshot["densities"]


def test_full_contact_has_no_gaps_but_a_page(tmp_path):
    run = next(run for labels, run in runs().items() if labels.model == "boundary_elements")
    full = run.assign(gap_density=run["gap_density"] * 0.0, grid=32)
    assert encode_snapshot(full, 0, tmp_path / "none.nc", ("", 0))["densities"][0] == [[], []]


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
        ([folder, "--size", 0.001], "contacts fit on a page of 0.001 MB; choose fewer with --study"),
        ([tmp_path / "missing"], "surfaces/rough/seed1.nc: no such file"),
    ):
        refused = icha(*arguments)
        assert refused.exit_code == 2 and reason in " ".join(refused.output.split()), refused.output
    assert not (tmp_path / "missing/explore.html").exists()
