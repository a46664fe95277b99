"""Read text files with a row of heights or a point x y z in every line; interpret the heading of the file."""

import math
import re

import numpy as np

from icha.support import formatting
from icha.support.input_files import require_room
from icha.support.tables import AMBIGUOUS_COMMA
from icha.surfaces.measured.array_files import is_instrument_text
from icha.surfaces.measured.settings import (
    DEPTHS,
    DOWNWARDS,
    LINE_SCAN,
    FileContent,
    Preparation,
    UnfitTopography,
    grid_indices,
    metres_of,
    refuse_downwards,
    unused_factors,
)
from icha.surfaces.measured.text_tables import Layout, SourceFile, refuse_coordinates, strip_remark

# Beginning of the heading of text files by Zygo.
_ZYGO = "Zygo "
# Fewest columns of a table with a row of heights in every line.
_FEWEST_COLUMNS = 8
# Title of a column: its name and its unit, in brackets or after a sign.
_TITLE = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])]|[/_]\s*([^\W\d_]+))?")
_NAMES_OF_Z = re.compile(rf"z|h|height|{DEPTHS}", re.IGNORECASE)
# Words in the titles of tables that are no topographies, such as measurements of contact.
_QUANTITIES = re.compile(r"load|force|radius|area|pressure|displacement|indentation|approach|time", re.IGNORECASE)
# Relative error of numbers with seven digits, or of single precision.
_FEW_DIGITS = 1e-6
# A size in a heading of no known format counts only if the pixels are square up to this relative difference. Sizes from
# the first to the last point give pixels that are not.
_SQUARE = 1e-3
_NUMBER = r"([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)"
# One length or two, such as 12 µm x 12 µm.
_LENGTHS = re.compile(rf"{_NUMBER}\s*(\S+?)?(?:\s*[x×*]\s*{_NUMBER}\s*(\S+)?)?$")
# A line of the heading: a name, then a colon, an equals sign, a delimiter or blanks, then a value.
# The name may begin with 1, as in 1 count = 0.1 nm.
_ENTRY = re.compile(
    r"^[#%/\s'_]*((?:1\s+)?[^\W\d_](?:[^\W\d]|[ ./()\[\]-])*?)\s*(?:[:：=,;\t]\s*|\s+(?=[-+]?\d))(.+?)[\s',;]*$"
)
# Meaning of the names in a heading, in small letters and without punctuation. The words of Gwyddion for width, height,
# value units and lateral units are those of its languages (msgid in its files po/*.po).
_NAMES = {
    "width": "width|šířka|breite|anchura|largeur|larghezza|幅|폭|largura|ширина",
    "height": "height|výška|höhe|altura|hauteur|altezza|高さ|높이|высота",
    "value units": "value units|jednotky hodnot|einheiten|unités|unità valore|値の単位|값 단위|unidades de valor"
    "|единицы измерения",
    "lateral units": "lateral units|jednotky rozměrů|laterale einheiten|unités latérales|unità laterali"
    "|единицы горизонтальных размеров",
    "unit of heights": "z unit|z units|value unit|height unit|height units|data unit",
    "unit": "unit|units|einheit",
    "size": "size|scan size|scan range|scan area|field of view",
    "pixel": "pixel|pixel size|pixel spacing|point spacing|spacing|cell size|cellsize|xy calibration|xy justierung",
    "rows": "nrows|ny|rows|lines|number of rows|number of lines|vertical|vertikal",
    "columns": "ncols|nx|cols|columns|number of columns|points per line|pixels per line|horizontal|horizont",
    "corner": "xllcorner|yllcorner|xllcenter|yllcenter",
    "missing": "nodata value|nodata|no data|undefined value|nan value|fehlwert|ungültiger wert|valeur manquante"
    "|no data value|missing value|missing data value|bad value|bad data|invalid"
    "|invalid value|invalid data|invalid height|void value|null value|fill value|fillvalue",
}
_KNOWN = {*_NAMES, "dx", "dy", "distance of points"}
# Names with a meaning only in pairs.
_SIDES = {"width", "height", "dx", "dy"}
# A word, a number with or without a unit, or two of them, such as 24 x 24 px.
_PLAIN = re.compile(rf"(?:{_NUMBER}\s*)?\S*(?:\s*[x×*]\s*{_NUMBER}\s*\S*)?")
_MEANINGS = {name: meaning for meaning, names in _NAMES.items() for name in names.split("|")}
# An entry that states in which direction the numbers increase.
_DIRECTION = re.compile(r"\bz\b.*(axis|direction|achse)|polarity|positive|height direction")
# A line by which the numbers are inverted, or are depths.
_INVERTED = re.compile(
    rf"\b(?:inver[st]|flip)\w*\b(?!\s*z?\s*[:=]?\s*(?:no|non|nein|0|off|false|none)\b)|{DEPTHS}",
    re.IGNORECASE,
)
# Number for a missing height in grids by ESRI, if the heading does not define another number.
_ESRI_MISSING = -9999.0


def format_of_text(file: SourceFile) -> str:
    """Find the format of a text file from its columns; "instrument" if it has no numbers or is from an instrument."""
    layout = file.layout
    if layout is None:
        return "instrument"
    titles, _ = _find_titles(layout)
    if _read_titles(titles)[0]:
        return "xyz"
    if sum(bool(_QUANTITIES.search(title)) for title in titles) > 1:
        raise UnfitTopography(
            f"is a table of {', '.join(titles)[:80]}; expected heights over x and y. Measured loads and areas belong "
            "to the section `measurements`"
        )
    # Headings from instruments contain lines that are not remarks.
    if any(map(strip_remark, layout.heading)) and is_instrument_text(file):
        return "instrument"
    return "xyz" if 3 <= layout.columns < _FEWEST_COLUMNS and not _Heading(layout).is_image else "matrix"


def read_matrix(file: SourceFile, settings: Preparation) -> FileContent:
    """Read a text file with a row of heights in every line; units, size and missing heights come from its heading."""
    (heights, _, ends_with_delimiters), heading = file.table, _Heading(file.table_layout)
    if "".join(heading.lines[:1]).startswith(_ZYGO):
        raise UnfitTopography("is a Zygo file without points x y z; expected another export, such as XYZ")
    file.refuse_blocks()
    if not (heading.agrees_with(heights.shape) or heading.is_image):
        refuse_coordinates(heights)
        if ends_with_delimiters and len(heights) != len(heights.T):
            raise UnfitTopography(
                "has a delimiter at the end of every line; the last column may be missing heights, or no column. "
                "Remove these delimiters, or write nan for missing heights"
            )
    size, coordinates = heading.find_size(heights.shape, settings)
    remark, unit = heading.unused_factors(settings), heading.find_height_unit(settings)
    return FileContent(heading.mark_missing(heights), unit, size, coordinates, remark=remark)


def read_xyz(file: SourceFile, settings: Preparation) -> FileContent:
    """Read a text file with a point x y z in every line; points may be in any order or missing."""
    layout = file.table_layout
    table, (titles, _) = file.table[0], _find_titles(layout)
    count = table.shape[1]
    titled, units = _read_titles(titles)
    columns = list(settings.columns or titled or (1, 2, 3))
    if settings.columns is None and not titled and (count != 3 or titles):
        stated = f"the columns are {', '.join(titles)[:80]}" if titles else f"lines have {count} numbers"
        raise UnfitTopography(
            f"is missing, and {stated}; expected the columns x, y and z, such as [1, 2, 3]", "columns"
        )
    if max(columns) > count:
        raise UnfitTopography(f"is larger than the number of columns; expected 1 to {count}", "columns")
    points = table[:, [column - 1 for column in columns]]
    placed = np.isfinite(points[:, :2]).all(axis=1)
    if np.isfinite(points[~placed, 2]).any():
        raise UnfitTopography("has a height without coordinates; expected x, y and z in every line")
    without_place, points = np.count_nonzero(~placed), points[placed]
    if len(points) > 1 and any(np.ptp(points[:, axis]) == 0 for axis in (0, 1)):
        raise UnfitTopography(LINE_SCAN.format(len(points)))
    scattered = ""
    try:
        grid = [grid_indices(points[:, axis], "xy"[axis]) for axis in (0, 1)]
        require_room(2 * 8 * grid[0][1] * grid[1][1])
        sparse = any(len(np.unique(index)) < count for index, count, _ in grid)
        if sparse and (settings.missing == "refuse" or settings.scattered == "interpolate"):
            raise UnfitTopography(
                f"does not allow coordinates on a grid of {grid[0][1]} x {grid[1][1]} points that lack whole rows or "
                "columns, as rounded coordinates do; expected interpolate, or `missing: fill` if points are missing",
                "scattered",
            )
    except UnfitTopography:
        if settings.scattered != "interpolate":
            raise
        points, scattered = _interpolate(points)
        grid = [grid_indices(points[:, axis], "xy"[axis]) for axis in (0, 1)]
    (column, nx, dx), (row, ny, dy) = grid
    node = row * nx + column
    order = np.argsort(node, kind="stable")
    repeated = np.flatnonzero(np.diff(node[order]) == 0)
    if len(repeated):
        x, y = points[order[repeated[0]], :2]
        raise UnfitTopography(f"contains the point x = {x:g}, y = {y:g} twice; expected every point once")
    if without_place > nx * ny - len(points) and not scattered:
        raise UnfitTopography(
            f"has {without_place} lines without coordinates, but the grid of the other lines lacks "
            f"{nx * ny - len(points)} points, so the edge of the scan is not known. Remove the lines, or add x and y"
        )
    heading = _Heading(layout)
    heights = np.full(nx * ny, np.nan)
    heights[node] = heading.mark_missing(points[:, 2])
    x_unit, y_unit, z_unit = (metres_of(units[column - 1]) if units else None for column in columns)
    lateral_unit = heading.find_lateral_unit(settings)
    x_unit, y_unit = x_unit or lateral_unit, y_unit or lateral_unit
    named = "columns x {}, y {}, z {} by their names".format(*columns)
    remarks = named if titled and columns != sorted(columns) else "", heading.unused_factors(settings)
    if x_unit and y_unit and settings.lateral_unit is None:
        heading.ask_if_in_doubt("lateral_unit", "the units of x and y")
    if z_unit and settings.height_unit is None:
        heading.ask_if_in_doubt("height_unit", "the unit of z")
    size = (nx * dx * x_unit, ny * dy * y_unit) if x_unit and y_unit and settings.lateral_unit is None else None
    return FileContent(
        heights.reshape(ny, nx),
        z_unit or heading.find_height_unit(settings),
        size,
        size or (nx * dx, ny * dy),
        "y",
        remark="; ".join(filter(None, (*remarks, scattered))),
    )


def _interpolate(points):
    """Interpolate scattered points (x, y, z) onto a square grid; return the new points, and a remark.

    The grid has as many nodes per area as the points. The interpolation is linear on Delaunay's triangles. Nodes
    outside the convex hull of the points have no height.
    """
    # Slow to import, and rarely needed.
    from scipy.interpolate import LinearNDInterpolator

    known = points[np.isfinite(points).all(axis=1)]
    low, high = known[:, :2].min(axis=0), known[:, :2].max(axis=0)
    step = math.sqrt(float(np.prod(high - low)) / len(known))
    nx, ny = (int(length / step) + 1 for length in high - low)
    require_room(4 * 8 * nx * ny)
    y, x = np.meshgrid(low[1] + step * np.arange(ny), low[0] + step * np.arange(nx), indexing="ij")
    z = LinearNDInterpolator(known[:, :2], known[:, 2], rescale=True)(x, y)
    empty = formatting.share(int(np.count_nonzero(np.isnan(z))), z.size)
    remark = f"{len(known)} scattered points interpolated onto {nx} x {ny} nodes, {empty} of which have no height"
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), remark


def _find_titles(layout):
    """Return the words above the numbers, one for each column, and the number of their lines; [] without titles.

    Units may be in a line of their own.
    """
    delimiters = r"[,;\t]" if layout.delimiter != " " else r"[,;]\s*|(?<=[\])])\s+|\s+(?![\[(])"
    names, last = (
        [word.strip(" \"'") for word in re.split(delimiters, line.strip(' \t\r\n,;#%"')) if not re.search("[:=]", line)]
        for line in ("", "", *layout.heading)[-2:]
    )
    units = [word.strip("[]()") for word in last]
    of_units = len(names) == len(last) and sum(metres_of(unit) is not None for unit in units) > 2
    if of_units:
        last = [f"{name} [{unit}]" for name, unit in zip(names, units, strict=True)]
    return (last, 1 + of_units) if len(last) == layout.columns else ([], 0)


def _read_titles(titles):
    """Return the column (from 1) of each axis x, y and z, if each occurs exactly once, and the units of all columns."""
    found = [_TITLE.fullmatch(title) for title in titles]
    units = [match[2] or match[3] or "" for match in found if match]
    # A word after a sign is part of the name if it is not a unit, as in z_raw.
    names = [match[1 if match[3] is None or metres_of(match[3]) else 0].lower() for match in found if match]
    names = ["z" if _NAMES_OF_Z.fullmatch(name) else name for name in names]
    unique = all(names.count(axis) == 1 for axis in "xyz")
    return [names.index(axis) + 1 for axis in "xyz"] if unique else [], units


class _Heading:
    """Units, size and missing heights in the lines above a table.

    The methods raise UnfitTopography if entries of the heading contradict each other and the settings do not contain
    the value.
    """

    def __init__(self, layout: Layout):
        """Find the entries of a heading: meaning of the name, value, and line."""
        self.lines, self.decimal = layout.heading, layout.decimal
        self.entries: list[tuple[str, str, str]] = []
        self.doubts: dict[str, list[str]] = {}
        names, previous = set(), ("", "")
        unknown: list[str] = []
        alone: list[str] = []
        of_titles = _find_titles(layout)[1]
        for k, line in enumerate(self.lines, of_titles - len(self.lines)):
            if not (found := _ENTRY.match(line.replace('"', ""))):
                unknown += [line] if k < 0 and re.search(r"\w", line) else []
                continue
            name = re.sub(r"[\s_.-]+", " ", found[1].lower()).strip()
            # A delimiter may stand between a number and its unit.
            value = re.sub(r"(?<=\d)\s*[,;\t]\s*(?=[^\W\d])", " ", found[2])
            meaning = _MEANINGS.get(name, name)
            self.entries.append((meaning, value, line))
            # The height of an image follows its width; elsewhere it may be a height of the surface.
            if (previous[0], meaning) in (("width", "height"), ("dx", "dy")):
                self.entries.append(("size" if meaning == "height" else "pixel", f"{previous[1]} x {value}", line))
                alone.pop()
            elif meaning in _SIDES:
                alone.append(line)
            plain = metres_of(value) if "unit" in meaning else _PLAIN.fullmatch(value)
            unknown += [] if k >= 0 or (meaning in _KNOWN and plain) else [line]
            previous = meaning, value
            names.add(name)
        self.is_grid = {"ncols", "nrows"} <= names
        stated, remarks = [each for each, *_ in self.entries if each in _KNOWN], "".join(self.lines).startswith("#")
        # The headings of an image and of points that Gwyddion exported.
        self.is_image = remarks and stated == ["width", "height", "size", "value units"]
        is_points = stated == ["lateral units", "value units"]
        is_keyence = not names.isdisjoint({"xy calibration", "xy justierung"})
        is_zygo = "".join(self.lines[:1]).startswith(_ZYGO)
        # Lines of a heading of no known format that may change what the heading states, by key.
        if not (self.is_image or is_points or is_keyence or is_zygo):
            self.doubts = {"height_unit": unknown, "lateral_unit": unknown, "size": unknown + alone}

    def values(self, *meanings: str) -> list[str]:
        """Return the values of the entries with these meanings."""
        return [value for meaning, value, _ in self.entries if meaning in meanings]

    def ask_if_in_doubt(self, key: str, stated: str) -> None:
        """Raise UnfitTopography if a heading of no known format has a line that may change what it states for a key.

        Such lines are those that ICHA does not know, and a width alone, which may contradict a size.
        """
        if lines := self.doubts.get(key):
            raise UnfitTopography(
                f"is missing; the heading states {stated!r}, but also {lines[0].strip()[:60]!r}, which may change it. "
                "Give the value for the table of numbers in this key",
                key,
            )

    def agrees_with(self, shape: tuple[int, int]) -> bool:
        """Return whether the heading states the rows and columns of a table; raise an error if it states others."""
        counts, agreed = dict(zip(("rows", "columns"), shape, strict=True)), set()
        for axis, value, line in self.entries:
            sides = re.fullmatch(r"(\d+)\s*[x×*]\s*(\d+)\s*(?:px|pixels?|points?)?", value)
            if axis == "size" and sides and sorted(map(int, sides.groups())) != sorted(shape):
                raise UnfitTopography(
                    f"has {shape[0]} rows and {shape[1]} columns of numbers, but its heading states "
                    f"{line.strip()[:40]!r}; expected a whole table. Export it again, or correct or remove this line"
                )
            if axis in counts and value.isdecimal():
                if int(value) != counts[axis]:
                    raise UnfitTopography(
                        f"has {counts[axis]} {axis} of numbers, but its heading states {value} in "
                        f"{line.strip()[:40]!r}; expected a whole table. Export the table again, or correct or remove "
                        "this line"
                    )
                agreed.add(axis)
        return len(agreed) == 2

    def unused_factors(self, settings: Preparation) -> str:
        """Return factors of the heights that are not applied; raise an error if the numbers increase downwards."""
        inverted = [line for line in self.lines if _INVERTED.search(line)]
        inverted += [line for name, each, line in self.entries if _DIRECTION.search(name) and DOWNWARDS.search(each)]
        refuse_downwards(inverted, settings)
        return unused_factors(self.entries, settings)

    def find_height_unit(self, settings: Preparation) -> float | None:
        """Return the unit of the heights, m; None without a unit."""
        texts = self.values("value units", "unit of heights", "unit")
        unit = _agreed("height_unit", texts, settings.height_unit)
        if texts and settings.height_unit is None:
            self.ask_if_in_doubt("height_unit", texts[0])
        return unit

    def find_lateral_unit(self, settings: Preparation) -> float | None:
        """Return the unit of the coordinates, m; None without a unit."""
        steps = [x for text in self.values("distance of points") for x, _ in _lengths(text)]
        return next(iter(steps), None) or _agreed("lateral_unit", self.values("lateral units"), settings.lateral_unit)

    def mark_missing(self, heights: np.ndarray) -> np.ndarray:
        """Replace numbers by nan if the heading defines them as missing heights."""
        stated = [_number(found[1]) for found in map(_LENGTHS.match, self.values("missing")) if found]
        for number in stated or [_ESRI_MISSING] * self.is_grid:
            heights = np.where(np.isclose(heights, number, rtol=_FEW_DIGITS, atol=0), np.nan, heights)
        return heights

    def find_size(self, shape: tuple[int, int], settings: Preparation):
        """Return the sides (along the rows, along the columns) of a table in m, and in an unknown unit, if stated."""
        rows, columns = shape
        texts = [(text, 1, 1) for text in self.values("size")]
        texts += [(text, columns, rows) for text in self.values("pixel")]
        found = [(text, x * nx, y * ny) for text, nx, ny in texts for x, y in _lengths(text)]
        if not found:
            steps = re.fullmatch(rf"{_NUMBER}(?: x {_NUMBER})?", texts[0][0]) if self.is_grid and texts else None
            return None, steps and (_number(steps[1]) * columns, _number(steps[2] or steps[1]) * rows)
        stated = ", ".join(text for text, _, _ in found)
        pixels = [(x / columns, y / rows) for _, x, y in found]
        mark = "." if self.decimal == "," else ","
        problem, known = "", self.is_grid or self.is_image
        if any(AMBIGUOUS_COMMA.match(text.replace(".", ",")) and mark in text for text, _, _ in found):
            problem = f"is {stated!r} in the file; the {mark!r} may be decimal or separate thousands"
        elif not np.allclose(pixels, pixels[0] if known else pixels[0][0], rtol=_SQUARE, atol=0):
            pixels_of_table = f"{columns} x {rows} {'' if known else 'square '}pixels"
            problem = f"is missing, and the lengths in the heading, {stated}, do not fit {pixels_of_table}"
        if settings.size is None:
            if problem:
                raise UnfitTopography(f"{problem}. Give the size in this key", "size")
            self.ask_if_in_doubt("size", stated)
        return (None if problem else found[0][1:]), None


def _agreed(key, texts, given):
    """Return the unit of length that all texts name; None without a unit."""
    units = sorted({unit for unit in map(metres_of, texts) if unit})
    if len(units) > 1 and given is None:
        raise UnfitTopography(f"is missing, and the file states {' and '.join(texts)}; expected one unit", key)
    return units[0] if units else None


def _lengths(text):
    """Return a list of the lengths x and y (m) in a text; an empty list if the text has no lengths with units."""
    found = _LENGTHS.match(text)
    x_unit, y_unit = map(metres_of, (found[2] or found[4] or "", found[4] or found[2] or "")) if found else (None, None)
    return [(_number(found[1]) * x_unit, _number(found[3] or found[1]) * y_unit)] if x_unit and y_unit else []


def _number(text):
    return float(text.replace(",", "."))
