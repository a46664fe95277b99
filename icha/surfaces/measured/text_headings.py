"""What the heading of a text file says of its numbers: their unit, the size of the scan, what stands for missing."""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

from icha.surfaces.measured.found import metres_of

# How Gwyddion begins the line with the width of an image that it exports, in the languages of its menus. The line with
# its height follows.
WIDTH = re.compile(r"^#?\s*(Width|Šířka|Breite|Anchura|Largeur|Larghezza|幅|폭|Largura|Ширина)\s*[:：]\s*(.*)$")
_VALUE = r"([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)"
_LENGTH = re.compile(rf"{_VALUE}\s*(\S+)?$")
_TWO_LENGTHS = re.compile(rf"{_VALUE}\s*(\S+)?\s*[x×*]\s*{_VALUE}\s*(\S+)?$")
# A line of a heading: a name, a colon, an equals sign, a delimiter or blanks, and a value.
_LINE = re.compile(r"^[#%/\s\"']*([A-Za-z][A-Za-z _./()-]*?)\s*(?:[:=,;\t]\s*|\s+(?=[-+]?\d))(.+?)[\s\"']*$")
# Names in small letters, without punctuation.
_SIZES = ("size", "scan size", "scan range", "scan area", "field of view")
_PIXELS = ("pixel", "pixel size", "pixel spacing", "spacing", "point spacing", "cellsize", "cell size")
_UNITS = ("unit", "units", "z unit", "z units", "value unit", "value units", "height unit", "height units", "data unit")
_MISSING = ("nodata value", "nodata", "no data value", "missing value", "bad value", "missing data value")


@dataclass(frozen=True)
class Heading:
    """What a heading says.

    height_unit, lateral_unit : metres, None if it does not say.
    size : (x, y) of the scan, m, None if it does not say.
    coordinates : (x, y) of the scan in a unit that the heading does not say, None if it does not say it either.
    missing : numbers that stand for a missing height.
    """

    height_unit: float | None = None
    lateral_unit: float | None = None
    size: tuple[float, float] | None = None
    coordinates: tuple[float, float] | None = None
    missing: tuple[float, ...] = ()


def read_heading(lines: Sequence[str], shape: tuple[int, int]) -> Heading:
    """Read the heading of a table of a shape (rows, columns)."""
    said = {}
    for line in lines:
        if found := _LINE.match(line):
            said.setdefault(re.sub(r"[\s_.-]+", " ", found[1].lower()).strip(), found[2].strip())
    units = [metres_of(said[name]) for name in _UNITS if name in said]
    missing = [_value(found[1]) for name in _MISSING if name in said and (found := _LENGTH.match(said[name]))]
    size, coordinates = _sizes(lines, said, shape)
    lateral = metres_of(said["lateral units"]) if "lateral units" in said else None
    return Heading(next((unit for unit in units if unit), None), lateral, size, coordinates, tuple(missing))


def _sizes(lines, said, shape):
    """Size in m, and in units that are not said; None where they are not known."""
    rows, columns = shape
    for line, following in itertools.pairwise(lines):
        if (found := WIDTH.match(line)) and ":" in following:
            sides = [_length(found[2].strip()), _length(following.split(":", 1)[1].strip())]
            if all(side and side[1] for side in sides):
                return tuple(side[0] for side in sides), None
    for names, factors in ((_SIZES, (1, 1)), (_PIXELS, (columns, rows))):
        for text in (said[name] for name in names if name in said):
            if two := _TWO_LENGTHS.match(text):
                sides = [_length(f"{value} {two[4] or ''}".strip()) for value in (two[1], two[3])]
            else:
                sides = [_length(text)] * 2
            if all(sides):
                lengths = tuple(side[0] * factor for side, factor in zip(sides, factors, strict=True))
                if sides[0][1]:
                    return lengths, None
                if names is _PIXELS:
                    return None, lengths
    return None, None


def _length(text):
    """Value of a length, in m if its unit is said, and whether it is; None if it is no length."""
    if not (found := _LENGTH.match(text)):
        return None
    unit = metres_of(found[2]) if found[2] else None
    return None if found[2] and unit is None else (_value(found[1]) * (unit or 1.0), unit is not None)


def _value(text):
    return float(text.replace(",", "."))
