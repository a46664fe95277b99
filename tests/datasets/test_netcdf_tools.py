"""Files are for the tools of others: bounds, ragged arrays and units follow conventions, and checkers accept them."""

import re
import subprocess

import kinds_of_files as kinds
import netCDF4
import numpy as np
import pint
import pytest
from outside_validators import REPOSITORY, python_of_validators

from icha.datasets.format import CAMPAIGN, RUN, SURFACE, identify_file
from icha.datasets.labels import LABELS


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kinds")
    kinds.write_all(folder)
    return folder


def groups_of(data):
    yield data
    for group in data.groups.values():
        yield from groups_of(group)


def every_variable(folder):
    """Every variable of every file, with where it is."""
    for path in sorted(folder.glob("*.nc")):
        with netCDF4.Dataset(path) as data:
            for group in groups_of(data):
                for name, variable in group.variables.items():
                    yield f"{path.name}:{group.path.rstrip('/')}/{name}", variable


# --- conventions ------------------------------------------------------------------------------------------------


def test_bounds_enclose_their_bins_and_meet(folder):
    seen = set()
    for path in sorted(folder.glob("*.nc")):
        with netCDF4.Dataset(path) as data:
            for group in groups_of(data):
                for name, variable in group.variables.items():
                    if "bounds" not in variable.ncattrs():
                        continue
                    seen.add(name)
                    bounds = group.variables[variable.bounds]
                    assert bounds.dimensions == (*variable.dimensions, "bound"), (path.name, name)
                    assert (bounds.units, bounds.long_name) == (variable.units, variable.long_name)
                    low, high = np.moveaxis(np.ma.filled(bounds[...], np.nan), -1, 0)
                    middle = np.ma.filled(variable[...], np.nan)
                    known = ~np.isnan(middle)
                    assert ((low < middle) & (middle < high))[known].all(), (path.name, name)
                    np.testing.assert_array_equal(low[..., 1:], high[..., :-1])
                    if (edges := name.replace("_centre", "_edges")) in group.variables and edges != name:
                        whole = np.concatenate([low, high[..., -1:]], axis=-1)
                        np.testing.assert_array_equal(whole, np.ma.filled(group.variables[edges][...], np.nan))
    assert seen == {"gap_bin_centre", "pressure_bin_centre", "psd_wavevector"}


def test_ragged_arrays_can_be_followed_by_what_they_index(folder):
    """Every index lies on the dimension that it names, and counts what the runs count themselves."""
    with netCDF4.Dataset(folder / "campaign.nc") as data:
        for group in data.groups.values():
            indices = {name: each for name, each in group.variables.items() if "instance_dimension" in each.ncattrs()}
            expected = {f"spot_{label}" for label in (*LABELS, "snapshot")}
            if "event" in group.dimensions:
                expected |= {f"event_{label}" for label in (*LABELS, "step")}
            assert set(indices) == expected
            for variable in indices.values():
                size = group.dimensions[variable.instance_dimension].size
                assert variable.dtype.kind == "i" and np.all((variable[...] >= 0) & (variable[...] < size))
            counted = np.zeros(group["snapshot_step"].shape, int)
            own = (*LABELS, "snapshot")
            np.add.at(counted, tuple(group[f"spot_{label}"][...] for label in own), 1)
            steps = group["snapshot_step"][...]
            for place in np.argwhere(~np.ma.getmaskarray(steps)):
                *labels, _ = place
                assert counted[tuple(place)] == group["spot_count"][(*labels, steps[tuple(place)])]


def test_pint_reads_all_units(folder):
    registry = pint.UnitRegistry()
    units = {variable.units for _, variable in every_variable(folder)}
    assert {"1", "m", "Pa", "N", "m^-1", "Pa^-1", "Pa m^-1", "J m^-2", "rad m^-1", "m^4"} <= units
    for unit in units:
        registry.Unit(unit)
    assert registry.Unit("Pa m^-1").is_compatible_with("kg m**-2 s**-2")


def test_every_file_says_what_it_is(folder):
    wanted = {"title", "summary", "keywords", "Conventions", "source", "history", "processing_level"}
    for path in sorted(folder.glob("*.nc")):
        with netCDF4.Dataset(path) as data:
            for group in groups_of(data):
                assert wanted <= set(group.ncattrs()), (path.name, group.path)
                assert group.Conventions.startswith("CF-1.11")
                text = " ".join(str(group.getncattr(name)) for name in group.ncattrs())
                assert not re.search(r"\d\d:\d\d|/home/|/tmp/|/root/", text), (path.name, group.path)


# Recommendations of the checker that files do not follow: every variable has units and long_name, also bounds;
# bins that differ from run to run stand along further dimensions, where it takes an interval for a polygon with too few
# corners; and bins of runs that are missing are missing.
_RECOMMENDED = (
    r"Bounds variable .* have the following matching attributes \[('long_name'|'units'|, )+\]",
    r"Boundary variables .* should not have the attributes: '\[('_FillValue'|'units'|, )+\]'",
    r"Dimension \w+_bin_bounds of boundary variable .* must have at least \d elements to form a simplex",
)
_CHECK = """
import pathlib, sys, warnings
warnings.simplefilter("ignore")
sys.path.insert(0, sys.argv[1])
import validate
sys.exit(not validate.validate(pathlib.Path(sys.argv[2]), ["compliance-checker"], 1000))
"""


def test_every_kind_of_file_is_known(folder):
    found = {path.stem: identify_file(path)[0] for path in sorted(folder.glob("*.nc"))}
    runs = {"run", "run_without_snapshots", "cycle", "boundary_elements", "boundary_elements_adhesive"}
    assert {name for name, kind in found.items() if kind == RUN} == runs
    assert found["campaign"] == CAMPAIGN and found["surface"] == SURFACE
    others = {name: kind for name, kind in found.items() if kind not in (RUN, CAMPAIGN, SURFACE)}
    assert set(others) == {"aggregated", "model_error", "theories"}
    assert len(set(others.values())) == len(others)


def test_checkers_accept_every_kind_of_file(folder):
    command = [python_of_validators(), "-c", _CHECK, REPOSITORY / "tests/validators", folder]
    found = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr
    remarks = [line for line in found.stdout.splitlines() if line.lstrip().startswith("remark")]
    assert "compliance-checker: passed" in found.stdout
    assert [line for line in remarks if not any(re.search(each, line) for each in _RECOMMENDED)] == []
