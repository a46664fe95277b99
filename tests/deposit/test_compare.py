"""Comparison of two folders of results: differences planted into copies of a file, one each."""

import shutil

import h5py
import netCDF4
import numpy as np
import pytest

from icha.deposit.compare import (
    DIFFERENT,
    FLOOR,
    IDENTICAL,
    TOLERANCE,
    WITHIN,
    compare_folders,
    compare_values,
    format_comparison,
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
        branch = file.createVariable("branch", "S1", ("step", "string7"))
        branch._Encoding = "utf-8"
        branch[:] = np.array(["loading"] * 5)
        group.createVariable("radius", "f8", ("spot",))[:] = np.arange(spots) + 1.0
        change(file)


@pytest.fixture
def folders(tmp_path):
    write(tmp_path / "deposit" / FILE)
    return tmp_path / "deposit", tmp_path / "rerun"


def changed(name, index, value):
    return lambda file: file[name].__setitem__(index, value)


def attribute(name, key, value):
    return lambda file: (file[name] if name else file).setncattr(key, value)


def rename(kind, old, new):
    return lambda file: getattr(file, f"rename{kind}")(old, new)


def replace_by_single(file):
    file.renameVariable("height", "old")
    file.createVariable("height", "f4", ())[...] = 2.0


PLANTED = {
    "one ulp": (changed("pressure", 3, np.nextafter(1e3, 2e3)), "/pressure", WITHIN, "[3]"),
    "1e-3": (changed("pressure", 3, 1.001e3), "/pressure", DIFFERENT, "deviation 0.001, at [3]: 1000.0"),
    "rounding at zero": (changed("pressure", 0, 1e-10), "/pressure", WITHIN, "[0]"),
    "infinite": (changed("gap", 1, -np.inf), "/gap", DIFFERENT, "deviation inf, at [1]: inf and -inf"),
    "masked": (changed("area", 3, np.ma.masked), "/area", DIFFERENT, "missing in other places: 1 of 5, first at [3]"),
    "residual": (changed("residual", 2, 5e-9), "/residual", WITHIN, "[2]"),
    "integer": (changed("count", 4, 5), "/count", DIFFERENT, "not equal: 1 of 5, first at [4]: 4 and 5"),
    "text": (changed("note", ..., "hard"), "/note", DIFFERENT, "'soft' and 'hard'"),
    "characters": (changed("branch", slice(1, 2), np.array(["unload"])), "/branch", DIFFERENT, "[1]: 'loading' and"),
    "in a group": (changed("study/radius", 2, 3.1), "/study/radius", DIFFERENT, "[2]: 3.0 and 3.1"),
    "type": (replace_by_single, "/height", DIFFERENT, "dtype: dtype('float64') and dtype('float32')"),
    "dimension": (rename("Dimension", "step", "stop"), "/pressure", DIFFERENT, "dimensions: ('step',) and ('stop',)"),
    "attribute": (attribute("pressure", "units", "kPa"), "/pressure", DIFFERENT, "attribute units: 'Pa' and 'kPa'"),
    "extra variable": (rename("Variable", "count", "number"), "/number", DIFFERENT, "only in the rerun"),
    "extra group": (rename("Group", "study", "other"), "/other/ (group)", DIFFERENT, "only in the rerun"),
}  # fmt: skip


@pytest.mark.parametrize("planted", PLANTED)
def test_a_planted_difference_is_found_and_nothing_else(planted, folders):
    deposit, rerun = folders
    change, name, verdict, detail = PLANTED[planted]
    write(rerun / FILE, change)
    comparison = compare_folders(deposit, rerun)
    found = {each.name: each for each in comparison.differences}
    assert found[name].verdict == verdict and detail in found[name].detail, found
    assert comparison.verdict == verdict
    renaming = planted in ("type", "dimension") or planted.startswith("extra")
    assert renaming or set(found) == {name}
    assert name.lstrip("/") in format_comparison(comparison) and verdict in format_comparison(comparison)


def test_the_same_content_is_identical_however_it_is_stored(folders):
    def again(file, compressed):
        file.renameVariable("pressure", "old")
        file.createVariable("pressure", "f8", ("step",), zlib=compressed)[:] = file["old"][:]

    for folder, compressed in zip(folders, (False, True), strict=True):
        write(folder / FILE, lambda file, compressed=compressed: again(file, compressed))
    assert (folders[0] / FILE).read_bytes() != (folders[1] / FILE).read_bytes()
    assert compare_folders(*folders).verdict == IDENTICAL


def test_tolerance_holds_for_each_value_by_itself():
    """A thousandth is found in a small value beside large ones, and its measure is symmetric."""
    a = 10.0 ** np.random.default_rng(1).uniform(-4, 1, 1000)
    for factor, verdict in ((1 + 0.9 * TOLERANCE, WITHIN), (1 + 1.1 * TOLERANCE, DIFFERENT)):
        for k in (int(np.argmin(a)), int(np.argmax(a))):
            b = a.copy()
            b[k] *= factor
            one, other = compare_values(a, b), compare_values(b, a)
            assert one[0] == other[0] == verdict
            assert one[2] == other[2] == pytest.approx((factor - 1) / factor, rel=1e-6)
            assert f"at [{k}]" in one[1]
    # Smaller values are measured by the largest one.
    a = np.array([1.0, 1e-9])
    assert compare_values(a, a + np.array([0, 0.9 * FLOOR * TOLERANCE]))[0] == WITHIN
    assert compare_values(a, a + np.array([0, 1.1 * FLOOR * TOLERANCE]))[0] == DIFFERENT
    assert compare_values(a, a + np.array([0, 1e-6]), noise=2e-6)[0] == WITHIN
    assert compare_values(a, a.copy()) is None


@pytest.fixture
def twice(folders):
    """The same results twice, with figures and a page."""
    deposit, rerun = folders
    for path, text in {
        "figures/a.png": "picture",
        "figures/b.pdf": "page",
        "checks.json": "[]",
        "verdict.txt": "passed",
        "README.md": "is not computed",
    }.items():
        (deposit / path).parent.mkdir(exist_ok=True)
        (deposit / path).write_text(text)
    return deposit, shutil.copytree(deposit, rerun)


@pytest.mark.parametrize(
    ("change", "path", "verdict", "of_all"),
    [
        (lambda r: (r / "README.md").unlink(), None, None, IDENTICAL),
        (lambda r: (r / "figures/a.png").write_text("PICTURE"), "figures/a.png", DIFFERENT, WITHIN),
        (lambda r: (r / "checks.json").write_text("[1]"), "checks.json", DIFFERENT, WITHIN),
        (lambda r: (r / "figures/a.png").unlink(), "figures/a.png", DIFFERENT, DIFFERENT),
        (lambda r: (r / "figures/d.png").touch(), "figures/d.png", DIFFERENT, DIFFERENT),
        (lambda r: (r / "verdict.txt").write_text("failed"), "verdict.txt", DIFFERENT, DIFFERENT),
        (lambda r: (r / FILE).write_bytes(b"no netCDF"), FILE, DIFFERENT, DIFFERENT),
        (lambda r: write(r / FILE, attribute("pressure", "missing_value", "none")), FILE, DIFFERENT, DIFFERENT),
    ],
)
def test_files_that_are_missing_extra_damaged_or_drawn_otherwise(change, path, verdict, of_all, twice):
    change(twice[1])
    comparison = compare_folders(*twice)
    assert {each.path: each.verdict for each in comparison.differences} == ({path: verdict} if path else {})
    assert comparison.verdict == of_all
    assert path is None or path in format_comparison(comparison)
    assert compare_folders(*twice, ["figures/b.pdf"]).verdict == IDENTICAL


def test_a_file_with_links_to_other_files_is_not_opened(folders, tmp_path):
    write(folders[1] / FILE)
    with h5py.File(folders[1] / FILE, "a") as file:
        file["elsewhere"] = h5py.ExternalLink(str(tmp_path / "other.nc"), "/step")
    (found,) = compare_folders(*folders).differences
    assert found.verdict == DIFFERENT and "is a link to another file" in found.detail
