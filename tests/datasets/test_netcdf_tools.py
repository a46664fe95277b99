"""Files are for the tools of others: plain netCDF4 and plain xarray agree on them, checkers accept them."""

import re
import subprocess
import sys

import kinds_of_files as kinds
import netCDF4
import numpy as np
import pint
import pytest
from outside_validators import REPOSITORY, python_of_validators

from icha.datasets.format import CAMPAIGN, RUN, SOLUTION, SURFACE, identify_file
from icha.datasets.labels import LABELS

GROUPS = {"run.nc": "/", "campaign.nc": "/slopes"}


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


# --- two readers ----------------------------------------------------------------------------------------------


def by_netcdf4(path, group):
    """Values by plain netCDF4: masked where missing, texts as one text each."""
    with netCDF4.Dataset(path) as data:
        own = data if group == "/" else data[group]
        return {name: variable[...] for name, variable in own.variables.items()}


# Nothing of the package is there: what is read is read without it.
BY_XARRAY = """
import pickle, sys
sys.modules["icha"] = None
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
import xarray as xr
path, group, picture = sys.argv[1:]
data = xr.open_dataset(path, group=group).load()
place = {"model": 0, "surface": 0, "seed": 0, "rms_slope": 1, "material": 0}
one = data.isel({name: k for name, k in place.items() if name in data.dims})
figure, axes = plt.subplots(1, 2)
one.contact_area_fraction.plot(ax=axes[0], x="step")
one.gap_density.isel(snapshot=1).plot(ax=axes[1], x="gap_bin_centre", xscale="log")
figure.savefig(picture)
line = axes[1].lines[0].get_xydata()
pickle.dump(({name: v.values for name, v in data.variables.items()}, line, list(data.coords)), sys.stdout.buffer)
"""


def by_xarray(path, group, picture):
    """Values, the line of a plot and the names of the coordinates, by xarray in a process without the package."""
    import pickle

    command = [sys.executable, "-c", BY_XARRAY, str(path), group, str(picture)]
    return pickle.loads(subprocess.run(command, check=True, capture_output=True, cwd=path.parent).stdout)


@pytest.mark.parametrize(("file", "group"), GROUPS.items())
def test_netcdf4_and_xarray_read_the_same_and_plot_it(folder, tmp_path, file, group):
    plain = by_netcdf4(folder / file, group)
    labelled, line, coordinates = by_xarray(folder / file, group, tmp_path / "plot.png")
    assert set(plain) == set(labelled)
    for name, values in plain.items():
        other = labelled[name]
        if other.dtype.kind in "OUT":
            np.testing.assert_array_equal(values.astype(str), other.astype(str), err_msg=name)
            continue
        missing = np.ma.getmaskarray(values)
        np.testing.assert_array_equal(missing, np.isnan(other), err_msg=name)
        np.testing.assert_array_equal(np.ma.getdata(values)[~missing], other[~missing], err_msg=name)
    assert {"gap_bin_centre", "pressure_bin_centre"} <= set(coordinates)
    place = (0, 0, 0, 1, 0)[: plain["gap_density"].ndim - 2]
    shown = [plain["gap_bin_centre"][place[1:4]], plain["gap_density"][(*place, 1)]]
    if file == "campaign.nc":  # the run that failed lacks its second snapshot
        assert plain["failure"][place] == "the path ends early" and shown[1].mask.all()
    np.testing.assert_array_equal(line, np.transpose([np.ma.filled(each, np.nan) for each in shown]))
    assert (tmp_path / "plot.png").stat().st_size > 5000


def test_missing_values_and_texts_are_what_was_written(folder):
    """Read the study with a failed run by plain netCDF4."""
    plain = by_netcdf4(folder / "campaign.nc", "/slopes")
    labels = [dict(zip(plain["material"], range(2), strict=True))[name] for name in ("soft", "hertz")]
    failed, whole = ((0, 0, 0, 1, material) for material in labels)
    assert plain["step_count"][failed] == 3 and plain["status"][failed] == 1 and plain["status"][whole] == 0
    missing = np.ma.getmaskarray(plain["nominal_pressure"][failed])
    assert not missing[:3].any() and missing[3:].all()
    assert plain["branch"][failed].tolist()[:4] == ["loading"] * 3 + [""]
    assert not np.ma.getmaskarray(plain["nominal_pressure"][whole]).any()


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


def test_density_over_bounds_is_the_whole_area(folder):
    """Both distributions together are one, with the contact area as what lies in contact."""
    with netCDF4.Dataset(folder / "run.nc") as run:
        open_area, contact_area = (
            np.sum(run[f"{quantity}_density"][...] * np.diff(run[f"{quantity}_bin_bounds"][...])[:, 0], axis=1)
            for quantity in ("gap", "pressure")
        )
        expected = run["contact_area_fraction"][...][run["snapshot_step"][...]]
        np.testing.assert_allclose(contact_area, expected, rtol=0.02)
        np.testing.assert_allclose(open_area + run["overlap_fraction"][...], 1 - expected, rtol=0.02)


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
sys.exit(not validate.validate(pathlib.Path(sys.argv[2]), ["compliance-checker", "cf-units"], 1000))
"""


def test_every_kind_of_file_is_known(folder):
    found = {path.stem: identify_file(path)[0] for path in sorted(folder.glob("*.nc"))}
    assert {name for name, kind in found.items() if kind == RUN} == {"run", "run_without_snapshots", "cycle"}
    solutions = {name for name, kind in found.items() if kind == SOLUTION}
    assert solutions == {"boundary_elements", "boundary_elements_adhesive"}
    assert found["campaign"] == CAMPAIGN and found["surface"] == SURFACE
    others = {name: kind for name, kind in found.items() if kind not in (RUN, SOLUTION, CAMPAIGN, SURFACE)}
    assert set(others) == {"aggregated", "model_error", "theories", "loop"}
    assert len(set(others.values())) == len(others)


def test_checkers_accept_every_kind_of_file(folder):
    command = [python_of_validators(), "-c", _CHECK, REPOSITORY / "tests/validators", folder]
    found = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr
    remarks = [line for line in found.stdout.splitlines() if line.lstrip().startswith("remark")]
    assert "compliance-checker: passed" in found.stdout and "cf-units: passed" in found.stdout
    assert [line for line in remarks if not any(re.search(each, line) for each in _RECOMMENDED)] == []
