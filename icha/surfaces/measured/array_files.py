"""Read heights from NumPy, MATLAB, netCDF and HDF5 files, and from formats that SurfaceTopography supports."""

import contextlib
import io
import math
import re
import struct
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from icha.support.input_files import require_room
from icha.surfaces.measured.settings import (
    DOWNWARDS,
    LINE_SCAN,
    OFF_GRID,
    FileContent,
    Preparation,
    UnfitTopography,
    metres_of,
    refuse_downwards,
    unused_factors,
)

# Memory for reading an array: this number of copies of the array, with 8 bytes per number.
_COPIES = 3
# Formats without a signature: any file of a certain length fits, so the file name must have the ending of the format.
_WITHOUT_SIGNATURE = ("hgt", "nms")
# Formats that do not identify an instrument. SurfaceTopography reads any text with numbers as `asc` or `xyz`, and then
# drops fields that are not numbers.
_OF_ANY_TEXT = ("asc", "xyz", "matrix")
_UNKNOWN = (
    "cannot be read as instrument: the file is damaged, or its format is not known here; expected another `format`, or "
    "an export of the heights as text"
)


def read_npy(file, settings: Preparation) -> FileContent:
    """Read heights from a NumPy file, which contains one array without name and unit."""
    # A mapped array cannot be larger than its file. NumPy warns of an overflow before it refuses the array.
    with np.errstate(over="ignore"):
        array = np.lib.format.open_memmap(file.path, mode="r")
    _require_room(array)
    return FileContent(np.array(array))


def read_npz(file, settings: Preparation) -> FileContent:
    """Read heights from a NumPy archive: the array `settings.data`, else the only map."""
    arrays = {}
    with np.load(file.path) as archive:
        require_room(_COPIES * sum(member.file_size for member in archive.zip.infolist()))
        for name in archive.files:
            with contextlib.suppress(ValueError):  # objects of Python, which are not read
                arrays[name] = archive[name]
    return _choose_array(arrays, settings)


def read_matlab(file, settings: Preparation) -> FileContent:
    """Read heights from a MATLAB file: `settings.data`, such as `Z` or `scan/Z` in a struct, else the only map.

    Files of MATLAB 7.3 or later are HDF5 files.
    """
    import h5py
    import scipy.io

    if h5py.is_hdf5(file.path):
        return read_hdf5(file, settings)

    arrays = {}

    def add(name, value):
        if getattr(value, "dtype", np.dtype(object)).names and value.size == 1:
            for field in value.dtype.names:
                add(f"{name}/{field}", value[field].item())
        elif isinstance(value, np.ndarray):
            arrays[name] = value

    # SciPy reads logical values as integers.
    names = [name for name, _, kind in scipy.io.whosmat(file.path) if kind != "logical"]
    for name, value in scipy.io.loadmat(file.path, variable_names=names).items():
        add(name, value)
    return _choose_array(arrays, settings)


def _choose_array(arrays: Mapping[str, np.ndarray], settings) -> FileContent:
    """Return the content of a file with several arrays: the array `settings.data`, or the only map of real numbers."""
    real = {name: array for name, array in arrays.items() if array.dtype.kind in "iuf"}
    name, data = _choose_map({name: array.shape for name, array in real.items()}, settings, "real array")
    return FileContent(real[name].reshape(real[name].shape[-2:]), data=data)


def _choose_map(shapes: Mapping[str, tuple[int, ...]], settings, what: str, usual=()) -> tuple[str, str]:
    """Return the name of the array to read, and the name to report ("" if the file has only one map)."""
    maps = sorted(find_maps(shapes))
    asked = (settings.data or "").strip("/")
    if asked in shapes and not _is_map(shapes[asked]):
        raise UnfitTopography(
            f"has {len(shapes[asked])} dimensions; expected two, as in {', '.join(maps) or f'no {what} of this file'}",
            "data",
        )
    name = asked if asked in shapes else _choose_name(asked or None, maps, usual, what)
    return name, name if len(maps) > 1 else ""


def _choose_name(asked: str | None, names: Sequence[str], usual: Sequence[str], what: str) -> str:
    """Choose a variable, dataset or channel (`what`) by name: `asked`, else a usual name, else the only name.

    Raises UnfitTopography if the file does not contain `asked`, or if the choice is not clear.
    """
    for name in [asked] if asked is not None else [*usual, *(names if len(names) == 1 else ())]:
        if name in names:
            return name
    given = f"is not a {what} of the file" if asked else f"is missing, and the file has {len(names) or 'no'} {what}s"
    expected = f"one of: {', '.join(names)}" if names else f"a file with a {what} of two dimensions"
    raise UnfitTopography(f"{given}; expected {expected}", "data")


def _read_variable(variable) -> np.ndarray:
    """Read a netCDF variable as floats, nan where numbers are missing."""
    _require_room(variable)
    return np.ma.filled(variable[...].astype(float), np.nan)


def _require_room(declared):
    """Raise `TooLarge` if the declared shape of an array needs too much memory; the array is not read."""
    require_room(_COPIES * 8 * math.prod(declared.shape))


def read_netcdf(source, settings: Preparation) -> FileContent:
    """Read a netCDF variable, unit and size: `settings.data`, else `height`, `heights` or `z`, else the only map."""
    import netCDF4

    with netCDF4.Dataset(source.path) as file:
        shapes = {name: each.shape for name, each in file.variables.items() if _is_real(each)}
        name, data = _choose_map(shapes, settings, "variable", ("height", "heights", "z"))
        chosen = file[name]
        heights = _read_variable(chosen).reshape(chosen.shape[-2:])
        dimensions, sides = chosen.dimensions[-2:], []
        for axis, dimension in enumerate(dimensions):
            side, decreases = _side(file.variables.get(dimension), heights.shape[axis])
            sides.append(side)
            heights = np.flip(heights, axis) if decreases else heights
        unit, remark = _unit_of(chosen.__dict__), _unused_factors(chosen.__dict__, settings)
    axes = "".join(dimensions).lower()
    size = tuple(sides[::-1]) if all(sides) else None
    return FileContent(heights, unit, size, None, axes[0] if axes in ("xy", "yx") else "", "", remark, data)


def _is_real(variable) -> bool:
    """Return whether a netCDF variable contains real numbers, and not text or compound values."""
    return getattr(variable.dtype, "kind", "O") in "iuf"


def _side(coordinate, count):
    """Return the length of a side, m (None if unknown), and whether the coordinate along this side decreases."""
    if coordinate is None or coordinate.ndim != 1 or not _is_real(coordinate):
        return None, False
    unit, values = _unit_of(coordinate.__dict__), _read_variable(coordinate)
    if unit is not None and "length" in coordinate.__dict__:
        return float(coordinate.length) * unit, False
    if count < 2 or not np.isfinite(values).any():
        return None, False
    step = (values[-1] - values[0]) / (count - 1)
    if not np.max(np.abs(values - values[0] - step * np.arange(count))) <= OFF_GRID * abs(step) > 0:
        raise UnfitTopography(f"has coordinates {coordinate.name} with unequal steps; expected equal steps")
    return (count * abs(step) * unit if unit is not None else None), step < 0


def read_hdf5(source, settings: Preparation) -> FileContent:
    """Read heights and unit from an HDF5 dataset: `settings.data`, else the only map.

    HDF5 files from MATLAB (7.3 or later) contain the transpose of each array, because MATLAB stores arrays by column.
    """
    import h5py

    with h5py.File(source.path) as file:
        shapes = {}

        def add(name, node):
            # MATLAB marks text and logical values, and keeps the content of cell arrays in groups such as `#refs#`.
            if isinstance(node, h5py.Dataset) and node.dtype.kind in "iuf" and not name.startswith("#"):
                if node.attrs.get("MATLAB_class") not in (b"char", b"logical"):
                    shapes[name] = node.shape

        file.visititems(add)
        name, data = _choose_map(shapes, settings, "real dataset")
        chosen = file[name]
        _require_room(chosen)
        heights = _unpack(chosen).reshape(chosen.shape[-2:])
        if source.path.suffix.lower() == ".mat" or "MATLAB_class" in chosen.attrs:
            heights = heights.T
        unit, remark = _unit_of(chosen.attrs), _unused_factors({**chosen.parent.attrs, **chosen.attrs}, settings)
    return FileContent(heights, unit, remark=remark, data=data)


def _unpack(dataset):
    """Read a dataset with the netCDF attributes for scale, offset and fill value; missing numbers become nan."""
    stored, attributes = dataset[...], dataset.attrs
    fills = [each for name in ("_FillValue", "missing_value") for each in np.ravel(attributes.get(name, []))]
    # HDF5 uses 0 as the default fill value. Therefore zeros count as heights, not as missing numbers.
    fills += [dataset.fillvalue] if dataset.fillvalue else []
    scale, offset = (float(np.ravel(attributes.get(*each))[0]) for each in (("scale_factor", 1.0), ("add_offset", 0.0)))
    if not fills and (scale, offset) == (1.0, 0.0):
        return stored
    missing = np.isin(stored, np.array(fills, dtype=float).astype(stored.dtype))
    return np.where(missing, np.nan, stored * scale + offset)


def guess_format(path: Path) -> str:
    """Guess the format of a file by its content and the ending of its name; return "text" for other files.

    Zygo files are HDF5 files too, and so are MATLAB files since version 7.3.
    """
    import h5py

    suffix = Path(path.name.lower().removesuffix(".gz")).suffix
    if h5py.is_hdf5(path):
        with h5py.File(path) as file:
            if "_NCProperties" in file.attrs or suffix in (".nc", ".nc4"):
                return "netcdf"
            if "MetaData" in file:
                return "instrument"
            return "matlab" if suffix == ".mat" else "hdf5"
    with path.open("rb") as file:
        start = file.read(20)
    by_start = {b"\x93NUMPY": "npy", b"CDF": "netcdf", b"MATLAB 5.0 MAT-file": "matlab"}
    found = next((name for signature, name in by_start.items() if start.startswith(signature)), None)
    by_suffix = {".nc": "netcdf", ".nc4": "netcdf", ".h5": "hdf5", ".hdf5": "hdf5", ".mat": "matlab"}
    return found or by_suffix.get(suffix) or (suffix[1:] if suffix in (".npy", ".npz", ".xyz") else "text")


def _is_map(shape):
    """Return whether an array has two dimensions; further leading dimensions of length 1 are allowed."""
    return len(shape) >= 2 and all(count == 1 for count in shape[:-2])


def find_maps(shapes: Mapping[Any, tuple[int, ...]]) -> list:
    """Return the names of the arrays that can be maps of heights.

    MATLAB also stores vectors and single numbers as two-dimensional arrays. Such arrays count only if the file has no
    other two-dimensional arrays.
    """
    maps = [name for name, shape in shapes.items() if _is_map(shape)]
    return [name for name in maps if min(shapes[name][-2:]) > 2] or maps


def _unit_of(attributes):
    """Return the unit of length (m) in the attributes of a variable; None if the attributes have no unit of length."""
    text = attributes.get("units", attributes.get("unit"))
    if isinstance(text, bytes):
        text = text.decode("utf-8", "replace")
    return None if text is None else metres_of(text)


def _unused_factors(attributes, settings):
    """Return the attributes that may be factors of the heights; those of netCDF have been applied.

    Raise UnfitTopography if the numbers increase downwards.
    """
    entries = {name: str(value).strip("[]") for name, value in attributes.items() if name != "scale_factor"}
    directions = ((name, entries[name]) for name in ("positive", "standard_name", "long_name") if name in entries)
    refuse_downwards((f"{name}: {value}" for name, value in directions if DOWNWARDS.search(value)), settings)
    return unused_factors(entries.items(), settings)


def open_instrument(path: Path):
    """Open a file with SurfaceTopography; return None if SurfaceTopography does not support the format."""
    from SurfaceTopography import open_topography
    from SurfaceTopography.Exceptions import CannotDetectFileFormat

    try:
        return open_topography(_plain_x3p(path) or _plain_sur(path) or str(path))
    except CannotDetectFileFormat:
        return None


def _plain_x3p(path: Path) -> io.BytesIO | None:
    """Return an x3p file as SurfaceTopography requires it; None for other files.

    Some programs put all entries of the archive into a folder, or write the revision of the standard with a dash.
    """
    if not zipfile.is_zipfile(path):
        return None
    with zipfile.ZipFile(path) as archive:
        entries = {entry.filename.replace("\\", "/"): entry for entry in archive.infolist()}
        main = min((name for name in entries if Path(name).name == "main.xml"), key=len, default=None)
        if main is None or b"ISO5436_2" not in (content := archive.read(entries[main])):
            return None
        require_room(_COPIES * sum(entry.file_size for entry in entries.values()))
        plain = io.BytesIO()
        with zipfile.ZipFile(plain, "w") as copy:
            for name, entry in entries.items():
                if name != main:
                    copy.writestr(name.removeprefix(main.removesuffix("main.xml")), archive.read(entry))
            copy.writestr("main.xml", re.sub(rb"(<Revision>)[^<]*", rb"\1ISO5436 - 2000", content))
    plain.seek(0)
    return plain


def _plain_sur(path: Path) -> io.BytesIO | None:
    """Return a compressed file of Digital Surf as an uncompressed one, as in RosettaSciIO; None for other files."""
    with path.open("rb") as file:
        head = file.read(512)
        if not head.startswith(b"DSCOMPRESSED") or len(head) < 512:
            return None
        comments = file.read(sum(struct.unpack("<2H", head[334:338])))
        (count,) = struct.unpack("<I", file.read(4))
        lengths = list(struct.iter_unpack("<2I", file.read(8 * count)))
        require_room(_COPIES * sum(length for length, _ in lengths))
        plain = io.BytesIO(b"DIGITAL SURF" + head[12:] + comments)
        plain.seek(0, io.SEEK_END)
        for length, compressed in lengths:
            plain.write(zlib.decompressobj().decompress(file.read(compressed), length))
    plain.seek(0)
    return plain


def is_instrument_text(file) -> bool:
    """Return whether SurfaceTopography recognises the instrument that wrote a text file."""
    try:
        return file.instrument is not None and file.instrument.format() not in _OF_ANY_TEXT + _WITHOUT_SIGNATURE
    except Exception:  # the file has a known format but is damaged; the reader refuses it later
        return True


def read_instrument(file, settings: Preparation) -> FileContent:
    """Read heights, unit and size from the file of an instrument with SurfaceTopography."""
    opened = file.instrument
    if opened is not None and opened.format() in ("mat", "npz"):
        return (read_matlab if opened.format() == "mat" else read_npz)(file, settings)
    if opened is None or (
        opened.format() in _WITHOUT_SIGNATURE and file.path.suffix.lower()[1:] not in opened.file_extensions()
    ):
        raise UnfitTopography(_UNKNOWN)
    if opened.format() in _OF_ANY_TEXT:
        raise UnfitTopography(
            "is instrument, but the file is a text of numbers without the signature of one; expected matrix or xyz, "
            "with `size` and `height_unit`",
            "format",
        )
    channel, data = _choose_channel(opened, settings)
    sized = channel.physical_sizes is not None
    topography = channel.topography(**({} if sized else {"physical_sizes": (1.0, 1.0)}))
    heights = np.ma.filled(np.ma.asarray(topography.heights()).astype(float), np.nan).T
    unit = None if topography.unit is None else metres_of(topography.unit)
    sides: Any = tuple(float(side) for side in topography.physical_sizes) if sized else None
    lateral, size = settings.lateral_unit or unit, None
    if sized and lateral is not None:
        size, sides = tuple(side * lateral for side in sides), None
    return FileContent(heights, unit, size, sides, "y", opened.name(), data=data)


def _choose_channel(opened, settings):
    """Return the channel `settings.data` or the default channel, and the channel's name ("" if only one map)."""
    channels = opened.channels
    names = [channel.name for channel in channels]
    maps = find_maps({k: tuple(channel.nb_grid_pts) for k, channel in enumerate(channels)})
    if settings.data is not None:
        channel = channels[names.index(_choose_name(settings.data, names, (), "channel"))]
    else:
        channel = opened.default_channel
    if channel.dim != 2:
        areal = [each.name for each in channels if each.dim == 2]
        if not areal:
            raise UnfitTopography(LINE_SCAN.format(max(channel.nb_grid_pts)))
        raise UnfitTopography(f"is a line scan; expected a topography: {', '.join(areal)}", "data")
    return channel, channel.name if len(maps) > 1 else ""
