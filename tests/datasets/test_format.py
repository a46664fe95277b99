"""The documented format: what the program writes keeps to it, and what is changed is found; stamps."""

import os
import re
from pathlib import Path

import numpy as np
import pytest
import small_campaign as small
import xarray as xr

from icha.analysis.checks import check_campaign
from icha.datasets.files import read_run, write_dataset
from icha.datasets.format import CAMPAIGN, RUN, SURFACE, UnknownFile, identify_file, problems_with_file
from icha.datasets.quantities import _QUANTITIES
from icha.datasets.stamp import (
    DAMAGED,
    OTHER_LICENCE,
    OTHER_PROGRAM,
    OTHER_SETTINGS,
    outdated,
    read_stamp,
    refuse_outdated,
    state_licence,
)
from icha.datasets.surface_file import write_surface
from icha.datasets.variables import campaign, model_error, run, sensitivity
from icha.datasets.variables import run as of_run
from icha.datasets.variables import surface as of_surface


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    write_dataset(small.run(), folder / "run.nc")
    write_dataset(small.tree(), folder / "campaign.nc")
    write_surface(folder / "surface.nc", small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
    return folder


def problems(kind, data):
    return "\n".join(problems_with_file(kind, data))


def test_the_vocabulary_keeps_what_is_promised():
    """Names, dimensions and units that users rely on: a change of them is one of the format."""
    tables = {RUN: of_run.RUN | of_run.OF_MODELS | of_run.CYCLE | of_run.LOOP, SURFACE: of_surface.SURFACE}
    text = Path(__file__).with_name("promised_variables.txt").read_text(encoding="utf-8")
    promised = re.findall(r"^(?:\[(.+)\]|(\w+)\((.*?)\) (.+))$", text, re.MULTILINE)
    assert len(promised) == 2 + 72 + 19
    for kind, name, dims, units in promised:
        if kind:
            table = tables[kind]
        else:
            assert (", ".join(table[name].dims), table[name].units) == (dims, units), name


def changed(run, name, **attrs):
    variable = run[name].copy()
    variable.attrs |= attrs
    return run.assign({name: variable})


@pytest.mark.parametrize(
    ("spoil", "problem"),
    [
        (lambda run: run.drop_vars("residual"), "residual is missing"),
        (lambda run: changed(run, "nominal_pressure", units="kPa"), "nominal_pressure: has the units 'kPa'"),
        (lambda run: run.assign(reduced_pressure=run["reduced_pressure"] * (1 + 1e-6)), "reduced_pressure: differs"),
        (lambda run: run.assign_attrs(hostname="here"), "attribute hostname: states by whom"),
        (lambda run: run.assign(extra=xr.Variable((), 1.0)), "extra: has no attribute units"),
        (lambda run: run.assign(rms_height=run["rms_height"] * np.nan), "rms_height: 1 of 1 values are not finite"),
    ],
)
def test_changes_of_a_run_are_found(spoil, problem):
    with xr.set_options(keep_attrs=True):
        assert problem in problems(RUN, spoil(small.run()))


def test_what_is_written_keeps_to_the_format_and_changes_are_found(files):
    for name, kind in (("run", RUN), ("surface", SURFACE), ("campaign", CAMPAIGN)):
        found, data = identify_file(files / f"{name}.nc")
        assert found == kind and problems(kind, data) == ""
    _, surface = identify_file(files / "surface.nc")
    assert "height: has the shape (31, 32)" in problems(SURFACE, surface.isel(y=slice(1, None)))
    _, tree = identify_file(files / "campaign.nc")
    study = tree["slopes"].to_dataset()
    for spoiled in (study.drop_vars("failure"), changed(study, "residual", units="m")):
        broken = xr.DataTree.from_dict({"/": tree.to_dataset(), "/slopes": spoiled})
        assert re.search("slopes: (failure is missing|residual: has the units 'm')", problems(CAMPAIGN, broken))
    # A value that is missing is found by the checks of the physics.
    pressure = study["nominal_pressure"].copy()
    pressure[0, 0, 0, 0, 0, 0] = np.nan
    broken = xr.DataTree.from_dict({"/": tree.to_dataset(), "/slopes": study.assign(nominal_pressure=pressure)})
    assert "finite" in {check.name for check in check_campaign(broken) if not check.passed}


def test_other_files_are_refused(tmp_path):
    (tmp_path / "text.nc").write_text("no netCDF")
    (tmp_path / "empty.nc").touch()
    xr.Dataset({"a": 1}).to_netcdf(tmp_path / "other.nc")
    for name, message in (
        ("text.nc", "not a readable netCDF file"),
        ("", "is a folder"),
        ("empty.nc", "the file is empty"),
        ("none.nc", "no such file"),
        ("other.nc", "not a file that ICHA writes"),
    ):
        with pytest.raises(UnknownFile, match=message):
            identify_file(tmp_path / name)


STAMP = {"id": "c/runs/é", "license": "CC0-1.0", "config_sha256": "a" * 64, "program_sha256": "b" * 64}


@pytest.fixture
def file(tmp_path):
    (_, run), *_ = small.runs()
    write_dataset(run.assign_attrs(STAMP), tmp_path / "run.nc")
    return str(tmp_path / "run.nc")


def remove_stamp(file):
    write_dataset(small.run(), file)
    assert not any(read_stamp(file).values())


def replace_by_text(file):
    Path(file).write_text("not a netCDF file")


@pytest.mark.parametrize(
    ("expected", "damage", "reason"),
    [
        ({}, None, None),
        ({"config_sha256": "0" * 64}, None, OTHER_SETTINGS),
        ({"config_sha256": "0" * 64, "program_sha256": "0" * 64}, None, OTHER_SETTINGS),
        ({"id": "other/runs/e"}, None, OTHER_SETTINGS),
        ({"license": "CC-BY-4.0"}, None, OTHER_LICENCE),
        ({"license": "CC-BY-4.0", "program_sha256": "0" * 64}, None, OTHER_SETTINGS),
        ({"program_sha256": "0" * 64}, None, OTHER_PROGRAM),
        ({}, remove_stamp, OTHER_SETTINGS),
        ({}, lambda file: os.truncate(file, 3000), DAMAGED),
        ({}, replace_by_text, DAMAGED),
    ],
)
def test_a_file_with_another_stamp_is_outdated(file, expected, damage, reason):
    if damage:
        damage(file)
    stamps = {file: STAMP | expected, f"{file}.missing": STAMP}
    assert list(outdated(stamps)) == ([(file, reason)] if reason else [])
    if reason:
        with pytest.raises(ValueError, match=f"run.nc: {reason}"):
            refuse_outdated(stamps)
    else:
        refuse_outdated(stamps)


def test_a_file_states_another_licence_with_the_same_values(file):
    before = read_run(file).load()
    state_licence(file, "CC-BY-4.0")
    refuse_outdated({file: STAMP | {"license": "CC-BY-4.0"}})
    after = read_run(file).load()
    assert after.attrs == before.attrs | {"license": "CC-BY-4.0"} and after.equals(before)


def test_units_are_those_of_the_variables_in_files():
    files = {}
    for module in (run, campaign, model_error, sensitivity):
        for table in (each for each in vars(module).values() if isinstance(each, dict)):
            files |= {name: each.units for name, each in table.items() if hasattr(each, "units")}
    shared = _QUANTITIES.keys() & files.keys()
    assert {"contact_stiffness", "hysteresis_loss", "pull_off_force", "surface_energy", "jaccard"} <= shared
    assert {name: _QUANTITIES[name].unit for name in shared} == {name: files[name] for name in shared}
