"""Readers of text files with a row of heights per line or with x y z per line; choice between the two."""

import re

import numpy as np

from icha.support.input_files import require_room
from icha.surfaces.measured.array_files import is_instrument_text, read_instrument
from icha.surfaces.measured.coordinate_lines import drop_coordinates
from icha.surfaces.measured.settings import (
    LINE_SCAN,
    FileContent,
    Preparation,
    UnfitTopography,
    WrongFormat,
    metres_of,
    put_y_first,
    regular_ticks,
)
from icha.surfaces.measured.text_headings import check_counts, image_sides, read_heading
from icha.surfaces.measured.text_tables import SourceFile

# A surface has at least so many columns of heights.
_FEWEST_COLUMNS = 8
# Title of a column: its name and, in brackets, its unit.
_TITLE = re.compile(r"([a-z]+)\s*(?:[\[(]\s*([^\])]+?)\s*[\])])?", re.IGNORECASE)
_NAMES_OF_Z = ("z", "h", "height")
# Numbers that are written with seven digits, or were of single precision, agree to this relative error.
_FEW_DIGITS = 1e-6


def format_of_text(file: SourceFile) -> str:
    """Find the format of a text by its columns; "instrument" for that of an instrument, or without numbers."""
    layout = file.layout
    if layout is not None and _titles(layout):
        return "xyz"
    if layout is None or (layout.words and is_instrument_text(file)):
        return "instrument"
    return "xyz" if 3 <= layout.columns < _FEWEST_COLUMNS and not image_sides(layout.heading) else "matrix"


def read_matrix(file: SourceFile, settings: Preparation) -> FileContent:
    """Read a row of heights in every line, and units, size and missing heights from a heading."""
    values, layout = file.values, file.table_layout
    file.refuse_blocks()
    heights, steps, remark = drop_coordinates(values)
    check_counts(layout.heading, (values.shape, heights.shape))
    if layout.heading and not image_sides(layout.heading) and (known := _as_instrument_file(file, settings)):
        return known
    rows, columns = heights.shape
    heading = read_heading(layout.heading, heights.shape, layout.notation.decimal_comma)
    if heading.ambiguous and settings.size is None:
        raise UnfitTopography(
            "size",
            f"is {heading.ambiguous!r} in the file, where the comma may be decimal or separate thousands; expected the "
            "size here",
        )
    return FileContent(
        put_y_first(_mark_missing(heights, heading), settings),
        heading.height_unit,
        heading.size,
        heading.coordinates or (steps and (columns * steps[0], rows * steps[1])),
        remark=remark,
    )


def _as_instrument_file(file, settings):
    """Read the file with SurfaceTopography; None if the heights have no unit or are not the numbers of the file.

    SurfaceTopography raises all kinds of errors for texts of other formats.
    """
    try:
        found = read_instrument(file, settings)
    except Exception:
        return None
    if found.unit is None or found.heights.shape != file.values.shape or np.isnan(file.values).any():
        return None
    largest = np.max(np.abs(found.heights))
    scale = largest / np.max(np.abs(file.values))
    return found if np.allclose(found.heights, scale * file.values, rtol=1e-9, atol=1e-9 * largest) else None


def read_xyz(file: SourceFile, settings: Preparation) -> FileContent:
    """Read x y z in every line, in any order; points may be missing. A heading may give the units."""
    layout = file.table_layout
    titles = _titles(layout, settings.columns)
    points = _select_columns(file.values, settings, titles)
    heading = read_heading(layout.heading, points.shape, layout.notation.decimal_comma)
    if len(points) > 1 and any(np.ptp(points[:, axis]) == 0 for axis in (0, 1)):
        raise UnfitTopography("path", LINE_SCAN.format(len(points)))
    try:
        (column, nx, dx), (row, ny, dy) = (regular_ticks(points[:, axis], "xy"[axis]) for axis in (0, 1))
    except WrongFormat as error:
        raise UnfitTopography(
            "path",
            f"holds points that are not on a regular grid ({error}); expected rows and columns of points. Interpolate "
            "them onto a grid in the program of the instrument, such as Gwyddion",
        ) from None
    node = row * nx + column
    order = np.argsort(node, kind="stable")
    repeated = np.flatnonzero(np.diff(node[order]) == 0)
    if len(repeated):
        x, y = points[order[repeated[0]], :2]
        raise WrongFormat(f"the point x = {x:g}, y = {y:g} is given twice")
    require_room(2 * 8 * nx * ny)
    heights = np.full(nx * ny, np.nan)
    heights[node] = _mark_missing(points[:, 2], heading)
    x_unit, y_unit, z_unit = (unit for _, unit in titles.values()) if titles else (None, None, None)
    x_unit, y_unit = x_unit or heading.lateral_unit, y_unit or heading.lateral_unit
    sides, size = (nx * dx, ny * dy), None
    if x_unit and y_unit and settings.lateral_unit is None:
        size = sides[0] * x_unit, sides[1] * y_unit
    columns = [column for column, _ in titles.values()]
    return FileContent(
        heights.reshape(ny, nx),
        z_unit or heading.height_unit,
        size,
        sides,
        remark="columns x {}, y {}, z {} by their names".format(*columns) if columns != sorted(columns) else "",
    )


def _titles(layout, columns=None):
    """Read the titles x, y and z above the columns.

    Returns
    -------
    For x, y and z the number of the column, from 1, and its unit in m, None if the title gives none. Empty if a title
    is missing, or if other columns are asked for.
    """
    if not layout.heading:
        return {}
    delimiters = r"[,;\t]" if layout.notation.delimiter else r"\s+(?![\[(])"
    fields = re.split(delimiters, layout.heading[-1].strip(' \t\r\n#%"'))
    found = [_TITLE.fullmatch(field.strip(" \"'")) for field in fields]
    names = [match[1].lower() if match else "" for match in found]
    names = ["z" if name in _NAMES_OF_Z else name for name in names]
    if len(names) != layout.columns or any(names.count(axis) != 1 for axis in "xyz"):
        return {}
    at = [names.index(axis) for axis in "xyz"]
    if columns is not None and [column - 1 for column in columns] != at:
        return {}
    return {axis: (k + 1, metres_of(found[k][2] or "")) for axis, k in zip("xyz", at, strict=True)}


def _select_columns(values, settings, titles):
    """Return the columns x, y and z (k, 3) of a table."""
    count = values.shape[1]
    columns = settings.columns or [column for column, _ in titles.values()] or [1, 2, 3]
    if max(columns) > count:
        raise UnfitTopography("columns", f"exceeds the {count} numbers of a line; expected 1 to {count}")
    if settings.columns is None and not titles and count != 3:
        if not 3 < count < _FEWEST_COLUMNS:
            raise WrongFormat(f"{count} numbers in a line, not x y z")
        waves = ". For wave vectors and amplitudes use `format: fourier`" if count == 4 else ""
        raise UnfitTopography(
            "columns",
            f"is missing, and a line has {count} numbers; expected the columns x, y and z, such as [1, 2, 3]{waves}",
        )
    return values[:, [column - 1 for column in columns]]


def _mark_missing(heights, heading):
    """Replace by nan the numbers that stand for missing heights according to the heading."""
    for number in heading.missing:
        heights = np.where(np.isclose(heights, number, rtol=_FEW_DIGITS, atol=0), np.nan, heights)
    return heights
