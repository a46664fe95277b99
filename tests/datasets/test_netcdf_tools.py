"""Files of a campaign are for the tools of others: bounds, ragged arrays and units follow conventions."""

import netCDF4
import numpy as np
import pint
import pytest

from icha.datasets.format import CAMPAIGN, RUN, SURFACE, identify_file
from icha.datasets.labels import LABELS


@pytest.fixture(scope="module")
def paths(smoke):
    """The netCDF files of the campaign, which has all kinds of them, but for those of sampled cases."""
    files = sorted((smoke / "results/smoke").rglob("*.nc"))
    return [path for path in files if "publish" not in path.parts and "-case" not in str(path)]


def groups_of(data):
    yield data
    for group in data.groups.values():
        yield from groups_of(group)


def test_bounds_enclose_their_bins_and_meet(paths):
    seen = set()
    for path in paths:
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


def test_ragged_arrays_can_be_followed_by_what_they_index(smoke):
    """Every index lies on the dimension that it names, and counts what the runs count themselves."""
    with netCDF4.Dataset(smoke / "results/smoke/dataset/smoke.nc") as data:
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


def test_pint_reads_all_units(paths):
    registry, units = pint.UnitRegistry(), set()
    for path in paths:
        with netCDF4.Dataset(path) as data:
            units |= {variable.units for group in groups_of(data) for variable in group.variables.values()}
    assert {"1", "m", "Pa", "N", "m^-1", "Pa^-1", "Pa m^-1", "J m^-2", "rad m^-1", "m^4"} <= units
    for unit in units:
        registry.Unit(unit)
    assert registry.Unit("Pa m^-1").is_compatible_with("kg m**-2 s**-2")


def test_every_kind_of_file_is_known(paths):
    kinds = {}
    for path in paths:
        kinds.setdefault(identify_file(path)[0], []).append(path.name)
    assert {RUN, CAMPAIGN, SURFACE} < kinds.keys() and len(kinds) >= 7
    assert kinds[CAMPAIGN] == ["smoke.nc"]
