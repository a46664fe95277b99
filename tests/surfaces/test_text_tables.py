"""Heights in texts of people and instruments; or a message with the line and what to do."""

import gzip

import numpy as np
import pytest
from scans import refused

from icha.surfaces.measured.settings import Preparation, UnfitTopography
from icha.surfaces.measured.topography import prepared_topography
from icha.surfaces.spectrum import SelfAffineSpectrum

NM, UM = 1e-9, 1e-6
GRID, SIDE = 24, 12 * UM
# As written, in nm.
HEIGHTS = np.round(SelfAffineSpectrum(SIDE, 0.5 * SIDE, 0.4 * SIDE, 0.8, 0.05).realise(GRID, 3).heights / NM, 3)


def rows(heights=HEIGHTS, write="{:.3f}".format):
    """The fields of a table, row by row."""
    return [[write(height) for height in row] for row in heights]


def text(fields, delimiter=",", heading=()):
    return "\n".join([*heading, *(delimiter.join(row) for row in fields)]) + "\n"


def read(path, **keys):
    """Prepare the surface of a text without removing a trend."""
    given = {"height_unit": NM, "size": (SIDE, SIDE)} | keys
    settings = Preparation(format="auto", boundary="periodic", missing="fill", **given)
    return prepared_topography(path, vars(settings))


def written(tmp_path, content, name="scan.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(content.encode(encoding))
    return path


def assert_heights(prepared, missing=0):
    """Check the heights, except for their mean and missing points."""
    assert prepared.filled == missing
    difference = prepared.surface.heights / NM - HEIGHTS
    # Filled points shift the mean.
    assert np.median(np.abs(difference - np.median(difference))) < 1e-6
    np.testing.assert_allclose(prepared.surface.period, SIDE, rtol=1e-9)


@pytest.mark.parametrize("word", ["", "nan", "#N/A", "no data", "***", '""'])
@pytest.mark.parametrize("delimiter", [",", ";", "\t", " "])
def test_missing_points_keep_their_places(tmp_path, word, delimiter):
    fields = rows()
    for k, row in enumerate(fields):
        # With blanks between the numbers nothing is no field.
        row[-1 - k] = word if word or delimiter != " " else "BAD"
    assert_heights(read(written(tmp_path, text(fields, delimiter))), missing=GRID)


def test_a_plane_is_not_a_table_with_numbered_rows(tmp_path):
    plane = np.add.outer(np.arange(GRID), 2.0 * np.arange(GRID))
    settings = Preparation("auto", "window", height_unit=NM, size=(SIDE, SIDE), detrend="tilt")
    with pytest.raises(UnfitTopography, match="all the same, apart from the trend"):
        prepared_topography(written(tmp_path, text(rows(plane))), vars(settings))


HEADINGS = {
    "words": (("Surface: sample A", "Unit: nm", "Pixel: 0.5 um"), True),
    "size": (("Sample B", "Scan size: 12 µm x 12 µm", "Z unit = nm"), True),
    "esri": (("ncols 24", "nrows 24", "xllcorner 0.0", "yllcorner 0", "cellsize 500", "NODATA_value -9999"), False),
    "gwyddion": (("# Channel: Z", "# Width: 12,00 µm", "# Height: 12,00 µm", "# Value units: nm"), True),
}


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "utf-16"])
@pytest.mark.parametrize("kind", HEADINGS)
def test_headings_give_size_unit_and_missing_value(tmp_path, kind, encoding):
    heading, whole = HEADINGS[kind]
    fields = rows()
    if kind == "esri":
        fields[3][4] = "-9999"
    decimal = kind == "gwyddion"
    if decimal:
        fields = [[field.replace(".", ",") for field in row] for row in fields]
    path = written(tmp_path, text(fields, "\t" if decimal else " ", heading), "scan.txt", encoding)
    given = {} if whole else {"height_unit": NM}
    assert_heights(read(path, **({"height_unit": None, "size": None} | given)), missing=kind == "esri")


@pytest.mark.parametrize(
    ("write", "delimiter", "encoding"),
    [
        ('"{:.3f}"'.format, ",", "utf-8"),
        (lambda height: f"{height:.10E}".replace("E", "D"), " ", "utf-8"),
        (lambda height: f"{height:.3f}".replace(".", ","), "\t", "utf-8"),
        ("{:.3f}".format, ",", "utf-16"),
        ("{:.3f}".format, ", ", "utf-8-sig"),
    ],
    ids=["quotes", "Fortran", "decimal commas", "UTF-16", "byte order mark"],
)
def test_ways_to_write_numbers(tmp_path, write, delimiter, encoding):
    assert_heights(read(written(tmp_path, text(rows(write=write), delimiter), "scan.txt", encoding)))


def points(*further):
    y, x = np.mgrid[:GRID, :GRID] * SIDE / GRID / UM
    return [
        [f"{value:.6g}" for value in line] for line in zip(x.ravel(), y.ravel(), HEIGHTS.ravel(), *further, strict=True)
    ]


@pytest.mark.parametrize("further", [np.zeros(GRID**2), np.random.default_rng(4).integers(0, 255, GRID**2)])
def test_points_with_a_column_too_many(tmp_path, further):
    path = written(tmp_path, text(points(further), " "), "scan.txt")
    with refused("columns", r"lines have 4 numbers.*\[1, 2, 3\]"):
        read(path)
    lines = points(further)
    lines[50][2] = "no data"
    path = written(tmp_path, text(lines, ","), "scan.xyz")
    assert_heights(read(path, columns=(1, 2, 3), size=None, lateral_unit=UM), missing=1)


@pytest.mark.parametrize("damage", ["short", "long", "word"])
def test_a_damaged_row_is_named_by_its_line(tmp_path, damage):
    fields = rows()
    fields[9] = {"short": fields[9][:-3], "long": [*fields[9], "1.0"], "word": [*fields[9][:-1], "1.2.3"]}[damage]
    with pytest.raises(UnfitTopography, match=r"line 11") as raised:
        read(written(tmp_path, text(fields, heading=["# a remark"])))
    assert raised.value.key == "path" and "remove the line" in str(raised.value)


# --- coordinates, commas, several images, counts, damage -------------------------------------------------------------


def with_coordinates(along, row, column, corner):
    fields = [[each, *line] for each, line in zip(along, rows(), strict=True)] if column else rows()
    return [[corner, *along] if column else list(along), *fields] if row else fields


@pytest.mark.parametrize(("row", "column", "corner"), [(1, 0, ""), (0, 1, ""), (1, 1, ""), (1, 1, "0")])
@pytest.mark.parametrize(("step", "write"), [(1, "{:g}"), (7.5 / 128, "{:.3f}"), (1 / 3, "{:.1f}"), (0.0586, "{:.1f}")])
def test_numbers_and_coordinates_of_rows_and_columns_are_no_heights(tmp_path, step, write, row, column, corner):
    along = [write.format(step * k) for k in range(GRID)]
    prepared = read(written(tmp_path, text(with_coordinates(along, row, column, corner))))
    assert_heights(prepared)
    left_out = " and ".join(["row"] * row + ["column"] * column)
    assert f"first {left_out} left out" in prepared.reading


def test_a_corner_without_a_number_is_refused(tmp_path):
    along = [f"{k / 3:.2f}" for k in range(GRID)]
    for corner, delimiter, words in (("y/x", ",", "'y/x' in line 1"), ("", " ", "24 numbers in line 1 but 25")):
        with refused("path", words):
            read(written(tmp_path, text(with_coordinates(along, 1, 1, corner), delimiter), "scan.txt"))


@pytest.mark.parametrize("place", [(1, 0), (0, 1)])
def test_unequal_coordinates_are_asked_about(tmp_path, place):
    along = [f"{k**1.2:.3f}" for k in range(GRID)]
    with refused("path", r"seem to be coordinates; expected.*Remove the"):
        read(written(tmp_path, text(with_coordinates(along, *place, ""))))


def test_numbers_in_the_last_column_are_refused(tmp_path):
    with refused("path", "last column"):
        read(written(tmp_path, text([[*row, str(k)] for k, row in enumerate(rows())])))


def test_several_images_in_a_text_are_refused(tmp_path):
    heading = "# Channel: {}\n# Width: 12.00 µm\n# Height: 12.00 µm\n# Value units: nm\n".format
    two = [heading(name) + text(rows(), "\t") for name in ("Topography", "Phase")]
    with refused("path", "2 blocks of rows, the second from line 34"):
        read(written(tmp_path, "\n".join(two), "scan.txt"), height_unit=None, size=None)


def test_arrays_without_names_have_no_data(tmp_path):
    np.save(tmp_path / "scan.npy", HEIGHTS)
    for path in (tmp_path / "scan.npy", written(tmp_path, text(rows()))):
        with refused("data", "Remove the key"):
            read(path, data="Nonsense")


@pytest.mark.parametrize("between", ["\n", "# Channel B\n"])
def test_blocks_of_rows_are_refused_but_not_empty_lines_between_all_rows(tmp_path, between):
    with refused("path", r"2 blocks of rows, the second from line 26"):
        read(written(tmp_path, text(rows()) + between + text(rows())))
    assert_heights(read(written(tmp_path, between.join(text([row]) for row in rows()))))


def decimal(write, heights=HEIGHTS):
    return rows(heights, lambda height: write.format(height).replace(".", ","))


@pytest.mark.parametrize(
    ("write", "delimiter"), [('"{:.3f}"', ","), ("{:.3f}", ";"), ('"{:.3f}"', ";"), ("{:.3f}", "\t")]
)
def test_decimal_commas_that_are_clear(tmp_path, write, delimiter):
    assert_heights(read(written(tmp_path, text(decimal(write), delimiter))))


@pytest.mark.parametrize(("write", "delimiter"), [("{:.2f}", ","), ("{:.1f}", ","), ("{:.3f}", ", "), ("{:.2f}", " ")])
def test_decimal_commas_between_commas_are_refused(tmp_path, write, delimiter):
    with refused("path", "decimal"):
        read(written(tmp_path, text(decimal(write), delimiter)))


def test_integers_between_commas_are_no_decimals(tmp_path):
    for heights in (np.rint(HEIGHTS), np.rint(HEIGHTS) + 5000, np.rint(HEIGHTS / 20) + 5):
        assert read(written(tmp_path, text(rows(heights, "{:.0f}".format)))).surface.grid == GRID


@pytest.mark.parametrize("delimiter", ["\t", ";"])
def test_commas_before_three_digits_are_ambiguous(tmp_path, delimiter):
    """1,234 is a thousand or a bit more than one; 0,234 and 1234,567 are decimal."""
    with refused("path", "separate thousands"):
        read(written(tmp_path, text(rows(1e4 + 10 * HEIGHTS, "{:,.0f}".format), delimiter)))
    assert_heights(read(written(tmp_path, text(decimal("{:.3f}", HEIGHTS + 1e4), delimiter))))


def test_a_size_with_three_digits_behind_a_comma_is_ambiguous(tmp_path):
    heading = ["# Channel: Z", "# Width: 1,250 um", "# Height: 1,250 um", "# Value units: nm"]
    path = written(tmp_path, text(rows(), " ", heading), "scan.txt")
    with refused("size", "1,250 um.*thousands"):
        read(path, size=None)
    assert_heights(read(path))


@pytest.mark.parametrize("line", ["nrows 30", "ncols 12", "Lines: 30", "Columns: 25"])
def test_counts_of_a_heading_are_checked(tmp_path, line):
    with refused("path", f"24 (rows|columns) of numbers, but its heading states {line[-2:]}"):
        read(written(tmp_path, text(rows(), " ", [line])))
    assert_heights(read(written(tmp_path, text(rows(), " ", [f"{line[:-2]}24"]))))


@pytest.mark.parametrize(
    ("said", "stored"), [("-3.4028234663852886e+38", "-3.402823e+38"), ("-9999.000", "-9999"), (None, "-9999")]
)
def test_missing_values_agree_to_the_digits_that_are_written(tmp_path, said, stored):
    heading = ["ncols 24", "nrows 24", "cellsize 500"] + ([f"NODATA_value {said}"] if said else [])
    fields = rows()
    fields[3][4] = stored
    assert_heights(read(written(tmp_path, text(fields, " ", heading), "scan.asc")), missing=1)


def test_what_is_wrong_with_a_file_is_named(tmp_path):
    content = text(rows(), " ").encode()
    labelled = text([[f"L{k}", *row] for k, row in enumerate(rows())])
    below_heading = text([["x" * 3, *row] for row in rows()], heading=["a,b", ""])
    for damaged, words in (
        (gzip.compress(content)[:-200], "the file is damaged"),
        (labelled.encode(), "'L0' in line 1, column 1"),
        (below_heading.encode(), "'xxx' in line 3"),
        (text(rows()).replace("\n", "]\n").encode(), r"\]' in line 1, column 24"),
    ):
        (tmp_path / "scan.txt").write_bytes(damaged)
        with refused("path", words):
            read(tmp_path / "scan.txt")
    with refused("columns", r"^is larger than the number of columns; expected 1 to 3"):
        read(written(tmp_path, text(points(), " "), "scan.xyz"), columns=(1, 2, 9))


@pytest.mark.parametrize(
    ("heading", "order"),
    [("x [um],y [um],z [nm]", (0, 1, 2)), ("Y(um),X(um),Z(nm)", (1, 0, 2)), ("z [nm],x [um],y [um]", (2, 0, 1))],
)
def test_titles_of_columns_give_their_order_and_units(tmp_path, heading, order):
    lines = [[line[k] for k in order] for line in points()]
    path = written(tmp_path, text(lines, ",", [heading]))
    for unit in (None, NM):
        assert_heights(read(path, height_unit=unit, size=None))
    wide = read(path, size=None, lateral_unit=2 * UM)
    np.testing.assert_allclose(wide.surface.period, 2 * SIDE)


def test_what_is_given_instead_of_what_the_file_says_is_printed(tmp_path):
    heading = ["Unit: um", "Scan size: 10 um x 10 um"]
    reading = read(written(tmp_path, text(rows(), " ", heading), "scan.txt")).reading
    assert "24 rows x 24 columns" in reading and "pixels of 500 nm x 500 nm" in reading
    assert "the size 10 um x 10 um and the unit of heights 1 um" in reading


# --- two hundred tables, damaged at random -------------------------------------------------------------------------

WRITE = ("{:.3f}".format, "{:.6e}".format, '"{:.3f}"'.format, lambda height: f"{height:.9E}".replace("E", "D"))
WORDS = ("", "BAD", "none", "NaN", "-", "*", "#N/A", "null")


def damaged_table(number):
    """A table with several damages: its bytes, the number of missing points, and whether a row is broken."""
    random = np.random.default_rng(number)
    delimiter = random.choice([",", ";", "\t", " "])
    write = WRITE[random.integers(4)]
    fields = rows(write=write)
    holes = random.choice(GRID**2, random.choice([0, 1, 20]), replace=False)
    for hole in holes:
        # With blanks between the numbers nothing is no field.
        fields[hole // GRID][hole % GRID] = str(random.choice(WORDS[1:] if delimiter == " " else WORDS))
    broken = random.random() < 0.2
    if broken:
        row = fields[random.integers(GRID)]
        changes = (lambda: row.__setitem__(random.integers(GRID), "1.2.3"), row.pop, lambda: row.append("3.1"))
        changes[random.integers(3)]()
    heading = random.choice(["", "# remark\n", "Sample: A1\nUnit: nm\n", "x;y;z\n\n"])
    if random.random() < 0.3:
        fields = [[str(k), *row] for k, row in enumerate(fields)]
    if random.random() < 0.3:
        first = [f"{0.25 * k:g}" for k in range(GRID)]
        fields.insert(0, ["0"] * (len(fields[-1]) > len(first) and not broken) + first)
        if len(fields[0]) != max(map(len, fields)):
            del fields[0]
    ending = random.choice(["\n", "\r\n"])
    content = heading + text(fields, delimiter)
    content = content.replace("\n", ending).encode(random.choice(["utf-8", "utf-8-sig", "utf-16", "latin-1"]))
    if random.random() < 0.1:
        content = gzip.compress(content)
    return content, len(holes), broken


@pytest.mark.parametrize("part", range(4))
def test_damaged_tables_give_the_right_heights_or_the_line(tmp_path, part):
    path = tmp_path / "scan.txt"
    refused = 0
    for number in range(50 * part, 50 * (part + 1)):
        content, missing, broken = damaged_table(number)
        path.write_bytes(content)
        try:
            prepared = read(path)
        except UnfitTopography as error:
            assert broken, f"table {number}: {error}"
            assert "line " in str(error) and "remove" in str(error)
            refused += 1
            continue
        assert not broken, f"table {number} is broken, and was read"
        assert_heights(prepared, missing)
    assert refused
