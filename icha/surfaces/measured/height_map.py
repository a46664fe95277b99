"""Height maps from files, for surfaces of `kind: file`."""

from pathlib import Path

import numpy as np

from icha.support.hdf5 import refuse_traps
from icha.support.input_files import bounded_memory, flaw_of_path
from icha.support.rules import LENGTH
from icha.surfaces.heights import flaw_of_heights
from icha.surfaces.measured.array_files import whole_npy, whole_variable

_ALLOWED = "allowed: a square array of at least 8 x 8 finite heights (.npy, or .nc with a variable `height`)"


def read_height_map(path: str | Path, metres_per_unit: float) -> np.ndarray:
    """Read the heights of a file, (n, n) in m, first axis y.

    Parameters
    ----------
    path : `.npy`, or netCDF with a variable `height`.
    metres_per_unit : the unit of the heights in the file.

    Raises
    ------
    ValueError
        If the file cannot be read or its heights are not a square array of finite numbers.
    """
    path = Path(path)
    if flaw := flaw_of_path(path):
        raise ValueError(f"{flaw}; {_ALLOWED}")
    try:
        with bounded_memory():
            refuse_traps(path)
            heights = _heights(path)
    except Exception as error:  # whatever the libraries raise for files that are damaged or of another kind
        raise ValueError(f"cannot be read ({error}); {_ALLOWED}") from None
    if heights.dtype.kind not in "iuf":
        raise ValueError(f"holds {heights.dtype}, not real numbers; {_ALLOWED}")
    if flaw := flaw_of_heights(heights):
        raise ValueError(f"holds {flaw}; {_ALLOWED}")
    heights = heights.astype(float) * metres_per_unit
    if not LENGTH.holds(float(np.ptp(heights))):
        raise ValueError(f"holds heights that span {np.ptp(heights):g} m; {_ALLOWED}, and another unit")
    return heights


def _heights(path: Path) -> np.ndarray:
    if path.suffix == ".npy":
        return whole_npy(path)
    if path.suffix == ".nc":
        import netCDF4

        with netCDF4.Dataset(path) as data:
            return whole_variable(data["height"])
    raise ValueError(f"unknown kind of file {path.suffix!r}")
