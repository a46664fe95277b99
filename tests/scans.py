"""A small scan, neither square nor symmetric in any way, and what reads and prepares it."""

from contextlib import contextmanager

import netCDF4
import numpy as np
import pytest

from icha.surfaces.measured.scan import load_scan
from icha.surfaces.measured.settings import Preparation, UnfitTopography

NM, UM = 1e-9, 1e-6
# 10 rows along y, 16 columns along x: neither square nor symmetric in any way.
ROWS, COLUMNS = 10, 16
HEIGHTS = np.round(np.random.default_rng(3).normal(size=(ROWS, COLUMNS)), 4)
SIZE = (COLUMNS * 0.25 * UM, ROWS * 0.25 * UM)


def preparation(**keys):
    return {"format": "auto", "boundary": "mirror"} | keys


def scan(path, **keys):
    return load_scan(path, Preparation(**preparation(**keys)))


@contextmanager
def refused(key, words=None):
    """Within, a file is refused because of a setting, with a message that matches the words, if any are given."""
    with pytest.raises(UnfitTopography, match=words) as raised:
        yield
    assert raised.value.key == key


def assert_read(read, unit=NM):
    """The heights of this file, the right way round, and the size of the scan."""
    np.testing.assert_allclose(read.heights, HEIGHTS * unit, rtol=1e-6, atol=1e-9 * unit)
    np.testing.assert_allclose(read.size, SIZE, rtol=1e-6)


def write_xyz(path, order=slice(None), separator=" "):
    y, x = np.mgrid[:ROWS, :COLUMNS] * 250.0
    table = np.column_stack([x.ravel(), y.ravel(), HEIGHTS.ravel()])[order]
    path.write_text("\n".join(separator.join(f"{number:g}" for number in line) for line in table) + "\n")
    return path


def write_netcdf(path, turned=False, backwards=False, unit="nm", lateral="um", kind="NETCDF4"):
    """Write a map with its axes, in one order or the other, and one more array."""
    with netCDF4.Dataset(path, "w", format=kind) as file:
        for name, count in (("y", ROWS), ("x", COLUMNS)):
            file.createDimension(name, count)
            file.createVariable(name, "f8", (name,))[:] = np.arange(count) * 0.25
            file[name].units = lateral
        stored = HEIGHTS[::-1] if backwards else HEIGHTS
        height = file.createVariable("height", "f8", ("x", "y") if turned else ("y", "x"), fill_value=-9999.0)
        height[:] = stored.T if turned else stored
        height.units = unit
        if backwards:
            file["y"][:] = np.arange(ROWS)[::-1] * 0.25
        file.createVariable("phase", "f8", ("y", "x"))[:] = 1.0
    return path


def centred(heights):
    return heights - np.mean(heights)
