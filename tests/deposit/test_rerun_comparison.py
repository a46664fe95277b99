"""Comparison of two folders of results: differences planted into copies of a file, one each."""

import json
import shutil

import h5py
import netCDF4
import numpy as np
import pytest

from icha.deposit.rerun_comparison import (
    DIFFERENT,
    EXTRA,
    FLOOR,
    IDENTICAL,
    MISSING,
    NOISE,
    TOLERANCE,
    WITHIN,
    compare_folders,
    compare_values,
    lines,
    table,
    write_json,
)

FILE = "runs/load/rough/seed1/slope1/soft.nc"


def write(path, change=lambda file: None, spots=4):
    """A file with everything that files here have: groups, ragged and scalar variables, text, masks, attributes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with netCDF4.Dataset(path, "w") as file:
        file.title = "A file"
        file.createDimension("step", 5)
        file.createDimension("string7", 7)
        group = file.createGroup("study")
        group.createDimension("spot", spots)
        pressure = file.createVariable("pressure", "f8", ("step",))
        pressure.units = "Pa"
        pressure.factor = np.float64(2.5)
        pressure[:] = [0.0, 1.0, 10.0, 1e3, 1e4]
        area = file.createVariable("area", "f8", ("step",), fill_value=-1.0)
        area[:] = np.ma.masked_less([-1.0, 1.0, 2.0, 3.0, 4.0], 0)
        gap = file.createVariable("gap", "f8", ("step",))
        gap[:] = [np.nan, np.inf, 1.0, 2.0, 3.0]
        file.createVariable("residual", "f8", ("step",))[:] = [1e-12, 2e-12, 0.0, 3e-13, 1e-11]
        file.createVariable("never", "f8", ("step",))  # filled with netCDF's own mark
        file.createVariable("count", "i4", ("step",))[:] = [0, 1, 2, 3, 4]
        file.createVariable("height", "f8", ())[...] = 2.0
        file.createVariable("note", str, ())[...] = "soft"
        words = np.array([b"loading"] * 5).view("S1").reshape(5, 7)
        file.createVariable("branch", "S1", ("step", "string7"))[:] = words
        group.createVariable("radius", "f8", ("spot",))[:] = np.arange(spots) + 1.0
        change(file)


@pytest.fixture
def folders(tmp_path):
    write(tmp_path / "deposit" / FILE)
    return tmp_path / "deposit", tmp_path / "rerun"


def changed(name, index, value):
    def change(file):
        file[name][index] = value

    return change


def renamed(kind, old, new):
    def change(file):
        getattr(file, f"rename{kind}")(old, new)

    return change


def attribute(name, key, value):
    def change(file):
        (file[name] if name else file).setncattr(key, value)

    return change


def of_type(kind):
    def change(file):
        file.renameVariable("height", "old")
        file.createVariable("height", kind, ())[...] = 2.0

    return change


PLANTED = {
    "one ulp": (changed("pressure", 3, np.nextafter(1e3, 2e3)), "/pressure", WITHIN, "[3]"),
    "1e-7": (changed("pressure", 3, 1e3 * (1 + 1e-7)), "/pressure", WITHIN, "[3]"),
    "1e-3": (changed("pressure", 3, 1.001e3), "/pressure", DIFFERENT, "deviation 0.001, at [3]: 1000.0"),
    "sign": (changed("pressure", 4, -1e4), "/pressure", DIFFERENT, "deviation 2, at [4]: 10000.0 and -10000.0"),
    "sign of zero": (changed("pressure", 0, -0.0), "/pressure", WITHIN, "signs of zero"),
    "rounding at zero": (changed("pressure", 0, 1e-10), "/pressure", WITHIN, "[0]"),
    "more than rounding at zero": (changed("pressure", 0, 1e-3), "/pressure", DIFFERENT, "[0]"),
    "NaN": (changed("pressure", 2, np.nan), "/pressure", DIFFERENT, "missing in other places: 1 of 5, first at [2]"),
    "NaN elsewhere": (changed("gap", slice(0, 3), [1.0, np.inf, np.nan]), "/gap", DIFFERENT, "2 of 5, first at [0]"),
    "infinite": (changed("gap", 1, -np.inf), "/gap", DIFFERENT, "deviation inf, at [1]: inf and -inf"),
    "finite": (changed("gap", 1, 1.0), "/gap", DIFFERENT, "at [1]: inf and 1.0"),
    "beside what is infinite": (changed("gap", 2, 1 + 1e-9), "/gap", WITHIN, "[2]"),
    "masked": (changed("area", 3, np.ma.masked), "/area", DIFFERENT, "missing in other places: 1 of 5, first at [3]"),
    "beside what is masked": (changed("area", 3, 3.0 + 1e-8), "/area", WITHIN, "[3]"),
    "filled": (changed("never", 3, 1.0), "/never", DIFFERENT, "missing in other places"),
    "residual": (changed("residual", 2, 5e-9), "/residual", WITHIN, "[2]"),
    "large residual": (changed("residual", 2, 5e-8), "/residual", DIFFERENT, "[2]: 0.0 and 5e-08"),
    "integer": (changed("count", 4, 5), "/count", DIFFERENT, "not equal: 1 of 5, first at [4]: 4 and 5"),
    "scalar": (changed("height", ..., 2.5), "/height", DIFFERENT, "2.0 and 2.5"),
    "text": (changed("note", ..., "hard"), "/note", DIFFERENT, "'soft' and 'hard'"),
    "characters": (changed("branch", (1, slice(0, 2)), [b"u", b"n"]), "/branch", DIFFERENT, "'loading' and 'unading'"),
    "in a group": (changed("study/radius", 2, 3.1), "/study/radius", DIFFERENT, "[2]: 3.0 and 3.1"),
    "type": (of_type("f4"), "/height", DIFFERENT, "type: 'float64' and 'float32'"),
    "dimension": (renamed("Dimension", "step", "stop"), "/pressure", DIFFERENT, "dimensions: ('step',) and ('stop',)"),
    "attribute": (attribute("pressure", "units", "kPa"), "/pressure", DIFFERENT, "attribute units: not equal"),
    "number of an attribute": (attribute("pressure", "factor", np.float64(2.5 + 1e-12)), "/pressure", WITHIN, "factor"),
    "type of an attribute": (attribute("pressure", "factor", "2.5"), "/pressure", DIFFERENT, "attribute factor"),
    "more attributes": (attribute("pressure", "comment", "x"), "/pressure", DIFFERENT, "attribute comment: extra"),
    "attribute of the file": (attribute("", "title", "Another"), "/ (attributes)", DIFFERENT, "attribute title"),
    "missing variable": (renamed("Variable", "count", "number"), "/count", MISSING, "the rerun has none"),
    "extra variable": (renamed("Variable", "count", "number"), "/number", EXTRA, "the deposit has none"),
    "missing group": (renamed("Group", "study", "other"), "/study (group)", MISSING, "the rerun has none"),
    "extra group": (renamed("Group", "study", "other"), "/other (group)", EXTRA, "the deposit has none"),
}  # fmt: skip


@pytest.mark.parametrize("planted", PLANTED)
def test_a_planted_difference_is_found_and_nothing_else(planted, folders):
    deposit, rerun = folders
    change, name, verdict, detail = PLANTED[planted]
    write(rerun / FILE, change)
    comparison = compare_folders(deposit, rerun)
    (file,) = comparison.files
    found = {item.name: item for item in file.items if item.verdict != IDENTICAL}
    assert found[name].verdict == verdict and detail in found[name].detail, found
    assert comparison.verdict == file.verdict == (WITHIN if verdict == WITHIN else DIFFERENT)
    renaming = planted in ("type", "dimension") or planted.startswith(("missing", "extra"))
    assert renaming or set(found) == {name}
    assert name.lstrip("/") in table(comparison) and verdict in table(comparison)


def test_the_same_content_is_identical_however_it_is_stored(folders):
    deposit, rerun = folders
    write(rerun / FILE)
    assert compare_folders(deposit, rerun).files[0].items == ()  # not even opened

    def reordered(file):
        file.renameVariable("pressure", "old")
        file.createVariable("pressure", "f8", ("step",), zlib=True)[:] = file["old"][:]
        file["pressure"].factor = np.float64(2.5)
        file["pressure"].units = "Pa"

    write(deposit / FILE, lambda file: file.renameVariable("pressure", "old") or copy_of_old(file))
    write(rerun / FILE, reordered)
    (file,) = compare_folders(deposit, rerun).files
    assert file.verdict == IDENTICAL and file.items and "storage" in file.detail


def copy_of_old(file):
    file.createVariable("pressure", "f8", ("step",))[:] = file["old"][:]
    file["pressure"].units = "Pa"
    file["pressure"].factor = np.float64(2.5)


def test_ragged_variables_of_other_lengths_are_different(folders):
    deposit, rerun = folders
    write(rerun / FILE, spots=6)
    (file,) = compare_folders(deposit, rerun).files
    found = {item.name: item.detail for item in file.items if item.verdict != IDENTICAL}
    assert found == {"/study/spot (dimension)": "size: 4 and 6", "/study/radius": "shape: (4,) and (6,)"}


def test_tolerance_holds_for_each_value_by_itself():
    """A thousandth is found in a small value beside large ones, and its measure is symmetric."""
    generator = np.random.default_rng(1)
    a = 10.0 ** generator.uniform(-4, 1, 1000)
    for factor, verdict in ((1 + 0.9 * TOLERANCE, WITHIN), (1 + 1.1 * TOLERANCE, DIFFERENT)):
        for k in (int(np.argmin(a)), int(np.argmax(a))):
            b = a.copy()
            b[k] *= factor
            one, other = compare_values(a, b), compare_values(b, a)
            assert one.verdict == other.verdict == verdict
            assert one.deviation == other.deviation == pytest.approx((factor - 1) / factor, rel=1e-6)
            assert f"at [{k}]" in one.detail
    # The scale of what is smaller than that is the largest value's.
    a = np.array([1.0, 1e-9])
    assert compare_values(a, a + np.array([0, 0.9 * FLOOR * TOLERANCE])).verdict == WITHIN
    assert compare_values(a, a + np.array([0, 1.1 * FLOOR * TOLERANCE])).verdict == DIFFERENT
    assert compare_values(a, a + np.array([0, 1e-6]), noise=2e-6).verdict == WITHIN


def test_files_that_are_missing_extra_damaged_or_drawn_otherwise(folders):
    deposit, rerun = folders
    (deposit / "figures").mkdir()
    for name in ("a.png", "b.png", "c.pdf"):
        (deposit / "figures" / name).write_bytes(b"picture")
    (deposit / "verdict.txt").write_text("passed\n")
    (deposit / "README.md").write_text("is not made by a rerun")
    shutil.copytree(deposit, rerun)
    (rerun / "README.md").unlink()
    assert compare_folders(deposit, rerun).verdict == IDENTICAL
    # Pictures that only look different are remarks; that they are there is not.
    (rerun / "figures/a.png").write_bytes(b"PICTURE")
    comparison = compare_folders(deposit, rerun)
    assert comparison.verdict == WITHIN and [file.path for file in comparison.remarks] == ["figures/a.png"]
    assert "figures/a.png: different" in table(comparison) and "look different" in table(comparison)
    (rerun / "figures/b.png").unlink()
    assert compare_folders(deposit, rerun).verdict == DIFFERENT
    shutil.copyfile(deposit / "figures/b.png", rerun / "figures/b.png")
    (rerun / "figures/d.png").write_bytes(b"picture")
    comparison = compare_folders(deposit, rerun)
    assert comparison.verdict == DIFFERENT and "figures/d.png: extra" in table(comparison)
    assert compare_folders(deposit, rerun, [FILE]).verdict == IDENTICAL
    (rerun / "figures/d.png").unlink()
    (rerun / "verdict.txt").write_text("failed\n")
    assert compare_folders(deposit, rerun).verdict == DIFFERENT
    shutil.copyfile(deposit / "verdict.txt", rerun / "verdict.txt")
    (rerun / FILE).write_bytes((rerun / FILE).read_bytes()[:-1000])
    (found,) = [file for file in compare_folders(deposit, rerun).files if file.path == FILE]
    assert found.verdict == DIFFERENT and "the rerun's cannot be opened" in found.detail
    # A file that can be opened, and of whose values some cannot be read.
    for folder in (deposit, rerun):
        with netCDF4.Dataset(folder / FILE, "w") as file:
            file.createDimension("step", 1000)
            file.createVariable("pressure", "f8", ("step",), zlib=True, fletcher32=True)[:] = np.sqrt(np.arange(1000))
    whole = (rerun / FILE).read_bytes()
    spoilt = bytearray(whole)
    spoilt[-2000:-1900] = bytes(100)
    (rerun / FILE).write_bytes(spoilt)
    (found,) = [file for file in compare_folders(deposit, rerun).files if file.path == FILE]
    assert found.verdict == DIFFERENT and "cannot be compared: RuntimeError" in found.detail


def test_checks_have_to_be_passed_alike(tmp_path):
    check = {"name": "residual", "subject": "a/b", "value": 1e-12, "limit": NOISE["residual"], "passed": True}

    def verdict(**changes):
        for folder, content in (("deposit", check), ("rerun", check | changes)):
            (tmp_path / folder).mkdir(exist_ok=True)
            (tmp_path / folder / "checks.json").write_text(json.dumps([content]))
        return compare_folders(tmp_path / "deposit", tmp_path / "rerun").verdict

    assert verdict() == IDENTICAL
    assert verdict(value=5e-9) == WITHIN
    assert verdict(value=5e-8) == DIFFERENT
    assert verdict(passed=False) == DIFFERENT
    assert verdict(limit=1.0) == DIFFERENT
    assert verdict(name="another") == DIFFERENT


CHECK = {"name": "residual", "subject": "a/b", "value": 1e-12, "limit": 1e-8, "passed": True}


@pytest.mark.parametrize(
    "content",
    [
        json.dumps([{key: value for key, value in CHECK.items() if key != "value"}]),
        json.dumps([CHECK | {"value": "q"}]),
        json.dumps([CHECK | {"value": [1, 2, 3]}]),
        json.dumps([CHECK | {"name": 3}]),
        json.dumps([CHECK | {"name": "\ud800"}]),
        json.dumps([1, 2, 3]),
        100_000 * "[",
        "\xff",
    ],
)
def test_checks_that_are_none_are_different_and_end_nothing(content, tmp_path):
    for folder, text in (("deposit", content), ("rerun", json.dumps([CHECK]))):
        write(tmp_path / folder / FILE)
        (tmp_path / folder / "checks.json").write_text(text, encoding="latin-1")
    comparison = compare_folders(tmp_path / "deposit", tmp_path / "rerun")
    assert [file.verdict for file in comparison.files] == [DIFFERENT, IDENTICAL]
    table(comparison).encode()
    write_json(comparison, tmp_path / "out.json")
    assert json.loads((tmp_path / "out.json").read_text())["files"][0]["verdict"] == DIFFERENT


def test_attributes_that_are_of_no_use_are_different_and_end_nothing(folders):
    deposit, rerun = folders
    write(deposit / FILE, lambda file: file["pressure"].setncattr("missing_value", "none"))
    write(rerun / FILE)
    (found,) = compare_folders(deposit, rerun).files
    assert found.verdict == DIFFERENT


@pytest.mark.parametrize("link", [FILE, "runs", "runs/load/rough", "checks.json"])
def test_links_to_the_deposit_s_own_results_are_not_the_same_results(link, folders):
    """Whoever runs the program of a stranger is left with what that has made, which may be links."""
    deposit, rerun = folders
    (deposit / "checks.json").write_text("[]")
    shutil.copytree(deposit, rerun, dirs_exist_ok=True)
    assert compare_folders(deposit, rerun).verdict == IDENTICAL
    shutil.rmtree(rerun / link) if (rerun / link).is_dir() else (rerun / link).unlink()
    (rerun / link).symlink_to(deposit / link)
    assert compare_folders(deposit, rerun).verdict == DIFFERENT
    assert compare_folders(deposit, rerun, [FILE, "checks.json"]).verdict == DIFFERENT


def test_the_same_difference_in_many_files_is_one_line(tmp_path):
    for k in range(1, 4):
        path = f"runs/load/rough/seed{k}/slope1/soft.nc"
        write(tmp_path / "deposit" / path)
        write(tmp_path / "rerun" / path, changed("pressure", 3, 1e3 * (1 + k * 1e-8)))
    write(tmp_path / "rerun" / path, changed("pressure", 3, 2e3))
    comparison = compare_folders(tmp_path / "deposit", tmp_path / "rerun")
    # Those that are different stand first.
    different, within = lines(comparison)
    assert (different.item.verdict, different.count, different.worst) == (DIFFERENT, 1, path)
    assert (within.item.verdict, within.count) == (WITHIN, 2) and "seed2" in within.worst
    head, row, *_ = table(comparison).splitlines()
    assert head.split() == ["files", "within", "tolerance", "different"] and row.split() == ["runs", "3", "2", "1"]
    write_json(comparison, tmp_path / "out.json")
    written = json.loads((tmp_path / "out.json").read_text())
    assert written["verdict"] == DIFFERENT and len(written["files"]) == 3
    assert written["files"][2]["path"] == path and written["files"][2]["verdict"] == DIFFERENT
    values = {each["name"]: each for each in written["files"][2]["variables"]}
    assert values["/pressure"]["deviation"] == 0.5 and values["/area"]["verdict"] == IDENTICAL


def test_values_that_a_deposit_has_elsewhere_are_not_read(folders, tmp_path):
    deposit, rerun = folders
    write(rerun / FILE)
    (tmp_path / "secret").write_bytes(np.arange(5.0).tobytes())
    with h5py.File(deposit / FILE, "a") as file:
        del file["gap"]
        file.create_dataset("gap", (5,), "f8", external=[(str(tmp_path / "secret"), 0, 40)])
    (found,) = compare_folders(deposit, rerun).files
    assert found.verdict == DIFFERENT and "'gap' has its data elsewhere" in found.detail and not found.items
    assert "4.0" not in table(compare_folders(deposit, rerun))
