"""Headings of text files: the units, the size and the missing heights that they give."""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

from icha.surfaces.measured.settings import Preparation, UnfitTopography, metres_of
from icha.surfaces.measured.text_lines import AMBIGUOUS_COMMA

# First word of the line with the width of an image that Gwyddion exported, in the languages of its menus. The next line
# contains the height of the image.
_WIDTH = re.compile(r"^#?\s*(Width|Šířka|Breite|Anchura|Largeur|Larghezza|幅|폭|Largura|Ширина)\s*[:：]\s*(.*)$")
_NUMBER = r"([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)"
# One length or two, such as 12 µm x 12 µm.
_LENGTHS = re.compile(rf"{_NUMBER}\s*(\S+?)?(?:\s*[x×*]\s*{_NUMBER}\s*(\S+)?)?$")
# A name; a colon, an equals sign, a delimiter or blanks; and a value.
_ENTRY = re.compile(r"^[#%/\s\"']*([A-Za-z][A-Za-z _./()-]*?)\s*(?:[:=,;\t]\s*|\s+(?=[-+]?\d))(.+?)[\s\"']*$")
# Names in small letters, without punctuation.
_SIZES = ("size", "scan size", "scan range", "scan area", "field of view")
_PIXELS = ("pixel", "pixel size", "pixel spacing", "spacing", "point spacing", "cellsize", "cell size")
_UNITS = ("unit", "units", "z unit", "z units", "value unit", "value units", "height unit", "height units", "data unit")
_COUNTS = {
    "rows": ("nrows", "rows", "lines", "number of rows", "number of lines"),
    "columns": ("ncols", "cols", "columns", "samples", "number of columns"),
}
_MISSING = ("nodata value", "nodata", "no data value", "missing value", "bad value", "missing data value")
# Missing height in grids of ESRI whose headings do not give one.
_ESRI_MISSING = "-9999"


@dataclass(frozen=True)
class Heading:
    """Facts that a heading contains; an attribute is None if the heading does not contain the fact.

    Attributes
    ----------
    height_unit, lateral_unit : m.
    size : (x, y) of the scan, m.
    coordinates : (x, y) of the scan in a unit that the heading does not contain.
    missing : numbers that stand for a missing height.
    """

    height_unit: float | None
    lateral_unit: float | None
    size: tuple[float, float] | None
    coordinates: tuple[float, float] | None
    missing: tuple[float, ...]


def read_heading(lines: Sequence[str], shape: tuple[int, int], decimal_comma: bool, settings: Preparation) -> Heading:
    """Read the heading of a table of a shape (rows, columns), whose numbers have decimal commas or not.

    Raises UnfitTopography if a comma in the size may be decimal or separate thousands, and the settings have no size.
    """
    entries, sides = _entries(lines), image_sides(lines)
    if {"ncols", "nrows", "cellsize"} <= entries.keys():
        entries.setdefault(_MISSING[0], _ESRI_MISSING)

    def values(names):
        return [entries[name] for name in names if name in entries]

    sizes, pixels = values(_SIZES), values(_PIXELS)
    commas = [text for text in (*sizes, *pixels, *sides) if AMBIGUOUS_COMMA.match(text)]
    if commas and not decimal_comma and settings.size is None:
        raise UnfitTopography(
            "size",
            f"is {commas[0]!r} in the file; the comma may be decimal or separate thousands; expected the size here",
        )
    size, coordinates = _size([*([" x ".join(sides)] if sides else []), *sizes], pixels, shape)
    return Heading(
        height_unit=next(filter(None, map(metres_of, values(_UNITS))), None),
        lateral_unit=metres_of(entries.get("lateral units", "")),
        size=size,
        coordinates=coordinates,
        missing=tuple(_number(found[1]) for found in map(_LENGTHS.match, values(_MISSING)) if found),
    )


def image_sides(lines: Sequence[str]) -> list[str]:
    """Return the texts of width and height of an image that Gwyddion exported; an empty list for other headings."""
    for line, following in itertools.pairwise(lines):
        if (found := _WIDTH.match(line)) and ":" in following:
            return [found[2].strip(), following.partition(":")[2].strip()]
    return []


def check_counts(lines: Sequence[str], shapes: Sequence[tuple[int, int]]) -> None:
    """Raise UnfitTopography unless one of the shapes has the numbers of rows and columns in the heading."""
    entries = _entries(lines)
    for axis, (what, names) in enumerate(_COUNTS.items()):
        counts = [int(entries[name]) for name in names if entries.get(name, "").isdecimal()]
        if counts and counts[0] not in [shape[axis] for shape in shapes]:
            raise UnfitTopography(
                "path",
                f"has {shapes[-1][axis]} {what} of numbers, but {counts[0]} according to its heading; expected a whole "
                "table. Export it again, or correct the heading",
            )


def _entries(lines):
    """Return the values in the lines of a heading, by their names in small letters."""
    entries = {}
    for line in lines:
        if found := _ENTRY.match(line):
            entries.setdefault(re.sub(r"[\s_.-]+", " ", found[1].lower()).strip(), found[2].strip())
    return entries


def _size(sizes, pixels, shape):
    """Return the size (x, y) in m, and the size in an unknown unit; each is None if the heading does not contain it."""
    rows, columns = shape
    for texts, (nx, ny) in ((sizes, (1, 1)), (pixels, (columns, rows))):
        for x, y, in_metres in filter(None, map(_lengths, texts)):
            if in_metres:
                return (x * nx, y * ny), None
            if texts is pixels:
                return None, (x * nx, y * ny)
    return None, None


def _lengths(text):
    """Return the lengths x and y in a text, and whether they are in m or in an unknown unit; None for other text."""
    if not (found := _LENGTHS.match(text)):
        return None
    x, y, units = _number(found[1]), _number(found[3] or found[1]), (found[2] or found[4], found[4] or found[2])
    if units == (None, None):
        return x, y, False
    x_unit, y_unit = map(metres_of, units)
    return (x * x_unit, y * y_unit, True) if x_unit and y_unit else None


def _number(text):
    return float(text.replace(",", "."))
