"""Three hundred text tables made at random give the right heights and cells, or a question; never a wrong number."""

import gzip

import numpy as np
import pytest
from scans import NM, UM, scan

from icha.surfaces.measured.settings import UnfitTopography

DELIMITERS, ENCODINGS = (",", ";", "\t", " "), ("utf-8", "utf-8-sig", "utf-16", "cp1252")
WORDS = ("", "nan", "NaN", "BAD", "none", "-", "***", "#N/A", "1.#QNAN", "no data")
# Headings that state nothing of use, or what is not enough for the size of a scan.
USELESS = ("Samples: 4", "Operator: N. N.", "Width: 20 um", "I gain: 3", "Date: 2026-01-01", "Pixel: 512", "Rate: 1 Hz")


def heights_of(random, rows, columns):
    """Rough or smooth heights in nm, rounded as they are written."""
    wave = random.uniform(0.1, 1.5, 2)
    y, x = np.mgrid[:rows, :columns]
    smooth = 100 * np.sin(wave[0] * x + random.uniform(0, 6)) * np.sin(wave[1] * y + random.uniform(0, 6))
    return np.round(smooth + random.choice([0, 5, 60]) * random.normal(size=(rows, columns)), 3)


class Table:
    """A table of heights in nm on cells of dx by dy (um), and a text that contains it."""

    def __init__(self, seed):
        self.random = random = np.random.default_rng(seed)
        rows, columns = random.integers(8, 41, 2)
        self.heights = heights_of(random, rows, columns)
        self.cell = (0.5, random.choice([0.5, 0.5, 0.25]))
        self.keys, self.axis, self.broken, self.stated = {}, False, False, True
        self.delimiter, self.comma = str(random.choice(DELIMITERS)), random.random() < 0.3
        self.quoted = self.delimiter != " " and random.random() < 0.2
        self.ending = self.delimiter if self.delimiter != " " and random.random() < 0.15 else ""
        self.hide_points()
        formats = "plain unknown gwyddion esri surfer zygo keyence points".split()
        getattr(self, formats[random.integers(len(formats))])()

    def hide_points(self):
        """Remove points, and whole rows at the start, in the middle or at the end."""
        random, count = self.random, len(self.heights)
        if random.random() < 0.4:
            self.heights[random.random(self.heights.shape) < 0.03] = np.nan
        if random.random() < 0.4:
            first = random.choice([0, count // 2, count - 2])
            self.heights[first : first + random.integers(1, 3)] = np.nan
        self.heights[3, 3] = 1.5

    def field(self, number, digits=3):
        if np.isnan(number):
            words = WORDS[1:] if self.delimiter == " " else WORDS
            return str(words[self.random.integers(len(words))])
        text = f"{number:.{digits}f}" if digits else f"{number:g}"
        if self.comma:
            text = text.replace(".", ",")
        return f'"{text}"' if self.quoted else text

    def rows(self, table=None):
        return [[self.field(number) for number in row] for row in (self.heights if table is None else table)]

    def write(self, heading, fields):
        ends = [self.delimiter.join(row) + self.ending for row in fields]
        self.text = "\n".join([*heading, *ends]) + "\n"

    def side(self, axis):
        return self.cell[axis] * self.heights.shape[1 - axis]

    def plain(self):
        """Rows of heights, sometimes with coordinates, or with a damaged row."""
        self.keys = {"height_unit": NM, "size": (self.side(0) * UM, self.side(1) * UM)}
        fields, random = self.rows(), self.random
        if random.random() < 0.4:
            self.axis = True
            step, columns = random.choice([1, 0.5, 1 / 3]), self.heights.shape[1]
            row, column = ((1, 0), (0, 1), (1, 1))[random.integers(3)]
            if column:
                fields = [[self.field(step * k), *line] for k, line in enumerate(fields)]
            if row:
                corner = [str(random.choice(["", "y/x", "0"]))] * column
                fields.insert(0, [*corner, *(self.field(step * k) for k in range(columns))])
        elif random.random() < 0.2:
            self.broken = True
            row = fields[random.integers(len(fields))]
            changes = (lambda: row.__setitem__(4, "1.2.3"), row.pop, lambda: row.append("3.1"))
            changes[random.integers(3)]()
        self.write([], fields)

    def unknown(self):
        """A heading of no known format, with or without a size that a person understands."""
        heading = list(self.random.permutation(USELESS)[: self.random.integers(3)])
        self.stated = self.random.random() < 0.6
        if self.stated:
            size = f"Scan size: {self.side(0):g} um x {self.side(1):g} um"
            pixel = "Pixel size = {:g} um x {:g} um".format(*self.cell)
            heading.insert(1, str(self.random.choice([size, pixel])))
            self.stated = self.cell == (0.5, 0.5) and len(heading) == 1
        self.write([*heading, "Z unit: nm", f"Lines: {len(self.heights)}"], self.rows())

    def gwyddion(self):
        labels = (("Channel", "Width", "Height", "Value units"), ("Kanal", "Breite", "Höhe", "Einheiten"))
        names = labels[self.random.integers(2)]
        values = ("Z", f"{self.side(0):.4f} µm", f"{self.side(1) * 1e3:.1f} nm", "nm")
        heading = [f"# {name}: {value}" for name, value in zip(names, values, strict=True)]
        if self.comma:
            heading = [line.replace(".", ",") for line in heading]
        self.write(heading, self.rows())

    def wrapped(self, words):
        """Numbers in reading order, in lines of any length, with a number for missing heights."""
        self.delimiter, self.comma, self.quoted, self.ending = " ", False, False, ""
        numbers = [words if np.isnan(number) else f"{number:.3f}" for number in self.heights.ravel()]
        count = self.random.choice([10, 7, self.heights.shape[1]])
        return [numbers[k : k + count] for k in range(0, len(numbers), count)]

    def esri(self):
        rows, columns = self.heights.shape
        steps = [f"cellsize {self.cell[0]}"] if len({*self.cell}) == 1 else [f"dx {self.cell[0]}", f"dy {self.cell[1]}"]
        heading = [f"ncols {columns}", f"nrows {rows}", "xllcorner 0", "yllcorner 0", *steps]
        self.keys = {"height_unit": NM, "lateral_unit": UM}
        self.write(heading, self.wrapped("-9999"))

    def surfer(self):
        rows, columns = self.heights.shape
        ranges = [f"3 {3 + self.cell[0] * (columns - 1)}", f"0 {self.cell[1] * (rows - 1)}", "-400 400"]
        self.keys = {"height_unit": NM, "lateral_unit": UM}
        self.write(["DSAA", f"{columns} {rows}", *ranges], self.wrapped("1.70141e+38"))

    def zygo(self):
        """Columns, rows and heights in um; a line for each point."""
        self.delimiter, self.comma, self.quoted, self.ending, self.cell = " ", False, False, "", (0.5, 0.5)
        rows, columns = self.heights.shape
        heading = ["Zygo XYZ Data File - Format 1", '1 7 5 0 "Thu Jan 01 2026"', "0 0 0 0 0 0", f"0 0 {columns} {rows}"]
        heading += ['""'] * 3 + ["0 0.5 6.33e-007 0 1 0 5e-007 1700000000", "0 0 0 0 0 0", "0 0 0", "#"]
        points = [[str(x), str(y), f"{1e-3 * self.heights[y, x]:.6f}"] for y in range(rows) for x in range(columns)]
        self.write(heading, [[*point[:2], point[2].replace("nan", "No Data")] for point in points])
        self.text += "#\n"

    def keyence(self):
        self.delimiter, self.comma, self.quoted, self.ending, self.cell = ",", False, True, "", (0.5, 0.5)
        heading = [f'"Horizontal",{self.heights.shape[1]}', f'"Vertical",{len(self.heights)}']
        heading += ['"XY Calibration",500,"nm"', '"Unit","nm"', "", '"Height"']
        self.write(heading, self.rows())

    def points(self):
        """Points in any order, some of them without coordinates."""
        y, x = (number.ravel() for number in np.indices(self.heights.shape))
        table = np.column_stack([x * self.cell[0], y * self.cell[1], self.heights.ravel()])
        table[np.isnan(table[:, 2]) & (x > 0) & (y > 0) & (y < y.max() - 2)] = np.nan
        order = self.random.permutation(len(table)) if self.random.random() < 0.5 else slice(None)
        columns = [0, 1, 2] if self.random.random() < 0.7 else [1, 0, 2]
        titles = [self.delimiter.join(np.array(["x (um)", "y (um)", "z (nm)"])[columns])]
        if columns == [0, 1, 2] and self.random.random() < 0.5:
            titles, self.keys = [], {"height_unit": NM, "lateral_unit": UM}
        self.write([titles[0] + self.ending] if titles else [], self.rows(table[order][:, columns]))

    def content(self):
        text = self.text.replace("\n", str(self.random.choice(["\n", "\r\n"])))
        content = text.encode(str(self.random.choice(ENCODINGS)))
        return gzip.compress(content) if self.random.random() < 0.1 else content


@pytest.mark.parametrize("part", [0, 1, *(pytest.param(k, marks=pytest.mark.slow) for k in range(2, 6))])
def test_tables_give_the_right_heights_and_cells_or_a_question(tmp_path, part):
    path, asked = tmp_path / "scan.txt", []
    for seed in range(50 * part, 50 * (part + 1)):
        table = Table(seed)
        path.write_bytes(table.content())
        try:
            found = scan(path, **table.keys)
        except UnfitTopography as error:
            assert "cannot be read" not in str(error), seed
            if table.broken:
                assert "line " in str(error), seed
            if not (table.axis or table.broken or not table.stated):
                # Ambiguous commas and points, and delimiters at the ends of lines, are the only reasons for questions.
                ambiguous = "has points, as in" in str(error)
                assert table.comma or table.ending or ambiguous, f"table {seed}: {error}"
                asked.append(seed)
            continue
        assert not table.axis and not table.broken and table.stated, f"table {seed}: {table.text[:300]}"
        np.testing.assert_allclose(found.heights, table.heights * NM, rtol=1e-6, err_msg=f"table {seed}")
        np.testing.assert_allclose(found.pixel, np.multiply(table.cell, UM), rtol=1e-5, err_msg=f"table {seed}")
    assert len(asked) <= 8
