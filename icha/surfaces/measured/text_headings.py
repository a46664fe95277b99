"""Headings of text files: the units, the size and the missing heights that they give."""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

from icha.surfaces.measured.settings import UnfitTopography, metres_of
from icha.surfaces.measured.text_lines import AMBIGUOUS_COMMA

# How Gwyddion begins the line with the width of an image that it exports, in the languages of its menus. The line with
# its name stands above, that with its height below.
WIDTH = re.compile(r"^#?\s*(Width|Šířka|Breite|Anchura|Largeur|Larghezza|幅|폭|Largura|Ширина)\s*[:：]\s*(.*)$")
_VALUE = r"([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)"
_LENGTH = re.compile(rf"{_VALUE}\s*(\S+)?$")
_TWO_LENGTHS = re.compile(rf"{_VALUE}\s*(\S+)?\s*[x×*]\s*{_VALUE}\s*(\S+)?$")
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
# ESRI's grids have this one if their headings give no other.
_ESRI_MISSING = "-9999"


@dataclass(frozen=True)
class Heading:
    """Facts that a heading contains; an attribute is None if the heading does not contain the fact.

    Attributes
    ----------
    height_unit, lateral_unit : m.
    size : (x, y) of the scan, m.
    coordinates : (x, y) of the scan in a unit that the heading does not give.
    missing : numbers that stand for a missing height.
    ambiguous : a size with a comma that may be decimal or not.
    channel : name of the channel.
    """

    height_unit: float | None
    lateral_unit: float | None
    size: tuple[float, float] | None
    coordinates: tuple[float, float] | None
    missing: tuple[float, ...]
    ambiguous: str | None
    channel: str | None


def read_heading(lines: Sequence[str], shape: tuple[int, int], decimal_comma: bool) -> Heading:
    """Read the heading of a table of a shape (rows, columns), whose numbers have decimal commas or not."""
    entries = _entries(lines)
    if {"ncols", "nrows", "cellsize"} <= entries.keys():
        entries.setdefault(_MISSING[0], _ESRI_MISSING)
    units = [metres_of(entries[name]) for name in _UNITS if name in entries]
    missing = [found for name in _MISSING if name in entries and (found := _LENGTH.match(entries[name]))]
    image_sides = _image_sides(lines)
    lengths = [entries[name] for name in (*_SIZES, *_PIXELS) if name in entries] + image_sides
    size, coordinates = _sizes(image_sides, entries, shape)
    return Heading(
        height_unit=next((unit for unit in units if unit), None),
        lateral_unit=metres_of(entries.get("lateral units", "")),
        size=size,
        coordinates=coordinates,
        missing=tuple(_value(found[1]) for found in missing),
        ambiguous=next((text for text in lengths if not decimal_comma and AMBIGUOUS_COMMA.match(text)), None),
        channel=entries.get("channel"),
    )


def check_counts(lines: Sequence[str], shapes: Sequence[tuple[int, int]]) -> None:
    """Raise UnfitTopography unless one of the shapes has the numbers of rows and columns that the heading gives."""
    entries = _entries(lines)
    for axis, (what, names) in enumerate(_COUNTS.items()):
        counts = [int(entries[name]) for name in names if entries.get(name, "").isdecimal()]
        if counts and counts[0] not in [shape[axis] for shape in shapes]:
            raise UnfitTopography(
                "path",
                f"has {shapes[-1][axis]} {what} of numbers and {counts[0]} by its heading, as if cut off or damaged; "
                "expected a whole table. Export it again, or correct the heading",
            )


def _entries(lines):
    """Values of the lines of a heading, by their names in small letters."""
    entries = {}
    for line in lines:
        if found := _ENTRY.match(line):
            entries.setdefault(re.sub(r"[\s_.-]+", " ", found[1].lower()).strip(), found[2].strip())
    return entries


def _image_sides(lines):
    """Return the texts of width and height of the first image of Gwyddion; an empty list without Gwyddion's heading."""
    for line, following in itertools.pairwise(lines):
        if (found := WIDTH.match(line)) and ":" in following:
            return [found[2].strip(), following.partition(":")[2].strip()]
    return []


def _sizes(image_sides, entries, shape):
    """Return the size in m and the size in an unknown unit; a size that the heading does not contain is None."""
    rows, columns = shape
    sides = [_length(text) for text in image_sides]
    if sides and all(side and side[1] for side in sides):
        return tuple(side[0] for side in sides), None
    for names, factors in ((_SIZES, (1, 1)), (_PIXELS, (columns, rows))):
        for text in (entries[name] for name in names if name in entries):
            if two := _TWO_LENGTHS.match(text):
                sides = [_length(f"{value} {two[4] or ''}".strip()) for value in (two[1], two[3])]
            else:
                sides = [_length(text)] * 2
            if not all(sides):
                continue
            lengths = tuple(side[0] * factor for side, factor in zip(sides, factors, strict=True))
            if sides[0][1]:
                return lengths, None
            if names is _PIXELS:
                return None, lengths
    return None, None


def _length(text):
    """Value of a length, in m if its unit is given, and whether it is; None for other text."""
    if not (found := _LENGTH.match(text)):
        return None
    if not found[2]:
        return _value(found[1]), False
    unit = metres_of(found[2])
    return None if unit is None else (_value(found[1]) * unit, True)


def _value(text):
    return float(text.replace(",", "."))
