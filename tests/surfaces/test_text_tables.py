"""Heights in texts of people and instruments; or a message with the line and what to do."""

import gzip
import re

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
    settings = Preparation(**{"format": "auto", "boundary": "periodic", "missing": "fill"} | given)
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


def test_a_plane_is_not_a_table_with_numbered_rows(tmp_path):
    plane = np.add.outer(np.arange(GRID), 2.0 * np.arange(GRID))
    settings = Preparation("auto", "window", height_unit=NM, size=(SIDE, SIDE), detrend="tilt")
    with pytest.raises(UnfitTopography, match="all the same, apart from the trend"):
        prepared_topography(written(tmp_path, text(rows(plane))), vars(settings))


def points(*further):
    y, x = np.mgrid[:GRID, :GRID] * SIDE / GRID / UM
    return [
        [f"{value:.6g}" for value in line] for line in zip(x.ravel(), y.ravel(), HEIGHTS.ravel(), *further, strict=True)
    ]


@pytest.mark.parametrize("further", [np.zeros(GRID**2), np.random.default_rng(4).integers(0, 255, GRID**2)])
def test_points_with_a_column_too_many_or_too_few(tmp_path, further):
    path = written(tmp_path, text(points(further), " "), "scan.txt")
    with refused("columns", r"lines have 4 numbers.*\[1, 2, 3\]"):
        read(path)
    lines = points(further)
    lines[50][2] = "no data"
    path = written(tmp_path, text(lines, ","), "scan.xyz")
    assert_heights(read(path, columns=(1, 2, 3), size=None, lateral_unit=UM), missing=1)
    with refused("columns", r"^is larger than the number of columns; expected 1 to 4"):
        read(path, columns=(1, 2, 9))


# --- coordinates, commas, several images, counts, damage -------------------------------------------------------------


def with_coordinates(along, row, column, corner):
    fields = [[each, *line] for each, line in zip(along, rows(), strict=True)] if column else rows()
    return [[corner, *along] if column else list(along), *fields] if row else fields


@pytest.mark.parametrize(("row", "column", "corner"), [(1, 0, ""), (0, 1, ""), (1, 1, ""), (1, 1, "0")])
@pytest.mark.parametrize(
    "write", ["{0:g}", "{1:.3f}", "{1:.1f}", "{2:.3f}"], ids=["numbers", "steps", "few digits", "unequal"]
)
def test_coordinates_along_an_edge_are_asked_about(tmp_path, write, row, column, corner):
    along = [write.format(k, 7.5 / 128 * k, k**1.2) for k in range(GRID)]
    with refused("path", r"first (row|column) of numbers, .* seem to be coordinates.*Remove the (row|column)"):
        read(written(tmp_path, text(with_coordinates(along, row, column, corner))))


def test_heights_along_an_edge_are_no_coordinates(tmp_path):
    """An egg box whose first row and column are zero, a facet, a saddle; and zeros below the first row."""
    y, x = 2 * np.pi * np.mgrid[:GRID, :GRID] / GRID
    box = 100 * np.sin(2 * x) * np.sin(2 * y)
    first = HEIGHTS.copy()
    first[1:3] = 0
    for heights in (box, np.abs(x - np.pi) + np.sin(3 * y), x * y, first):
        read_ = read(written(tmp_path, text(rows(heights, "{:.4f}".format))))
        assert read_.surface.grid == GRID


def test_delimiters_at_the_end_of_all_lines(tmp_path):
    fields = [[*row, ""] for row in rows()]
    fields[3][4] = ""
    assert_heights(read(written(tmp_path, text(fields))), missing=1)
    # The last column, of missing heights.
    with refused("path", "the last column may be missing heights, or no column"):
        read(written(tmp_path, text([[*row[:-1], ""] for row in rows()])))
    lines = [[*line, ""] for line in points()]
    assert_heights(read(written(tmp_path, text(lines), "scan.xyz"), size=None, lateral_unit=UM))


@pytest.mark.parametrize("between", ["\n", "# Channel B\n"])
def test_blocks_of_rows_are_refused_but_not_empty_lines_between_all_rows(tmp_path, between):
    with refused("path", r"2 blocks of rows, the second from line 26"):
        read(written(tmp_path, text(rows()) + between + text(rows())))
    assert_heights(read(written(tmp_path, between.join(text([row]) for row in rows()))))


@pytest.mark.parametrize(
    ("heading", "words"),
    [
        *(
            (["Scan size: 12 um x 12 um", "Unit: um", line], f"also {re.escape(repr(line))}, which may change it")
            for line in ("Unit Z: nm", "Height [nm]", "The heights are in nm.")
        ),
        (["Z unit: nm", "Height unit: um"], "the file states nm and um"),
        (["Z unit: nm", "Units: um"], "the file states nm and um"),
        # Gwyddion writes the same Korean words for the unit of coordinates and that of heights.
        (["# 채널: Z", "# 값 단위: nm", "# 값 단위: um"], "the file states nm and um"),
    ],
)
def test_a_unit_that_a_heading_does_not_state_clearly_is_asked_for(tmp_path, heading, words):
    path = written(tmp_path, text(rows(), " ", heading), "scan.txt")
    with refused("height_unit", words):
        read(path, height_unit=None)
    assert_heights(read(path))
    unit = written(tmp_path, text(rows(), " ", ["Scan size: 12 um x 12 um", "Unit: nm"]))
    assert_heights(read(unit, height_unit=None))


@pytest.mark.parametrize(
    "entry", ["Z scale: 0.5 nm/LSB", "1 count = 0.1 nm", "Z-scale factor = 2.5", "Height gain [V]: 3", "Scaling\t0,1"]
)
def test_factors_of_heights_in_headings_are_asked_about(tmp_path, entry):
    path = written(tmp_path, text(rows(), " ", [entry, "Zoom factor: 2", "X scale: 3 um", "Z unit: nm"]), "scan.txt")
    with refused("height_unit", "may be a factor of the heights"):
        read(path, height_unit=None)
    assert "not applied: " in read(path).reading


# Lines that change the size or the heights, or nothing: only a person knows.
UNKNOWN = (
    "Line spacing: 1 um|Pixel aspect ratio: 2|Binning: 2x2|Decimation: every 2nd point|every second line is left out"
    "|Transposed: yes|Columns along y|Downsampled|Stride: 2 pixels|Skip: one pixel|Skipped lines: 1|Decimation rate: 4"
    "|Number of skipped points: 3|Z increment: 0.1 nm|Heights x10|Heights times ten|Z zoom: 10x|Überhöhung: 10-fach"
    "|log10 of heights|Comment: heights multiplied by 10|Height channel: x10|Conversion: 0.1|Values x 10|BAD = 0"
    "|Zoom: 50%|half resolution|Multiplied by ten|Normalized to rms = 1|Title: scaled by 10|Filtered, mean 2x2"
    "|Average: 2x2|Units: x10|Objective: 50x|Pixels 4um|Lines: 24, every second one left out|Unit: nm, one half"
    "|Topography"
)


@pytest.mark.parametrize("line", UNKNOWN.split("|"))
def test_a_heading_with_a_line_that_is_not_known_is_asked_about(tmp_path, line):
    path = written(tmp_path, text(rows(), " ", ["Pixel: 0.5 um", "Z unit: nm", line]), "scan.txt")
    for key in ("size", "height_unit"):
        with refused(key, f"also {re.escape(repr(line))}, which may change it|may be a factor"):
            read(path, **{key: None})
    assert_heights(read(path))


def test_lines_about_directions_and_factors_beside_points(tmp_path):
    heading = ["Magnification: 2", "x [um],y [um],z [nm]"]
    path = written(tmp_path, text(points(), ",", heading), "scan.txt")
    with refused("lateral_unit", "also 'Magnification: 2', which may change it"):
        read(path, size=None)
    for line in ("Inverted: yes", "Z inverted", "Positive: down", "Invert Z: true", "Invertiert: ja", "Flip Z: yes"):
        path = written(tmp_path, text(rows(), " ", [line]))
        with refused("touches_first", re.escape(line)):
            read(path)
    assert_heights(read(written(tmp_path, text(rows(), " ", ["Inverted: no", "Invertiert: nein", "Invert Z: false"]))))


@pytest.mark.parametrize(
    "heading",
    [
        "Wyko ASCII Data File Format\t0\t0\t1\nX Size\t24\nY Size\t24\nWavelength\t7\t4\t632.8\n"
        "Pixel_size\t7\t4\t0.0005\nRAW_DATA\t3\t2304\t",
        "# File Format = ASCII\n# x-pixels = 24\n# x-length = 12000\n# x-unit = nm\n# z-unit = nm\n# voidpixels = 4",
        "File Format = ASCII\nScale X = 0.5\nScale Y = 0.5\nScale Data = 0.1\nDataScaleNeeded = yes",
    ],
    ids=["Wyko", "SPIP", "Nova"],
)
def test_texts_of_instruments_are_tables_whose_size_and_unit_are_asked_for(tmp_path, heading):
    path = written(tmp_path, text(rows(), "\t", [heading]), "scan.asc")
    for key in ("size", "height_unit"):
        with refused(key, "is missing"):
            read(path, **{key: None})
    assert_heights(read(path))
    with refused("format", "a text of numbers without the signature of one"):
        read(path, format="instrument")


def test_a_heading_of_known_entries_is_read(tmp_path):
    heading = ["Pixel: 0.5 um", "Z unit: nm", "Nx: 24", "Size: 24 x 24 px", "# ----"]
    assert_heights(read(written(tmp_path, text(rows(), " ", heading)), size=None, height_unit=None))


@pytest.mark.parametrize(
    "line", ["nrows 30", "ncols 12", "Lines: 30", "Columns: 25", '"Vertical",30', "Size: 48 x 48 px"]
)
def test_counts_of_a_heading_are_checked(tmp_path, line):
    with refused("path", f"24 (rows|columns) of numbers, but its heading states .*{line!r}"):
        read(written(tmp_path, text(rows(), " ", [line])))
    assert_heights(read(written(tmp_path, text(rows(), " ", [re.sub("\\d+", "24", line), "Samples: 4"]))))


@pytest.mark.parametrize(
    ("heading", "words"),
    [
        (["Width: 12 um", "Lines: 24"], "does not contain the size"),
        (["Width: 12 um", "Height: 350 nm"], "12 um x 350 nm, do not fit 24 x 24 square pixels"),
        (["Scan size: 12 um x 6 um"], "do not fit"),
        (["Scan size: 12 um x 11.98 um"], "do not fit"),
        (["Scan size: 10 um", "Pixel: 0.5 um"], "10 um, 0.5 um, do not fit"),
        (["Pixel: 0.5"], "does not contain the size"),
        *((["Pixel: 0.5 um", line], f"also '{line}'") for line in ("Width: 96 um", "Breite: 9 um", "Height: 80 um")),
        (["# Width: 24 um", "# Height: 12 um", "# Pixel: 0.5 um", "# Value units: nm"], "do not fit 24 x 24 square"),
        (["ncols 24", "nrows 24", "dx 1 um", "dy 0.5 um", "pixel 0.5 um"], "do not fit 24 x 24 pixels"),
        (["# Channel: Z", "# Width: 1,250 um", "# Height: 1,250 um"], "1,250 um.*thousands"),
    ],
)
def test_a_size_that_a_heading_does_not_state_clearly_is_asked_for(tmp_path, heading, words):
    path = written(tmp_path, text(rows(), " ", heading), "scan.txt")
    with refused("size", words):
        read(path, size=None)
    assert_heights(read(path))


# Width, height, value units and lateral units as Gwyddion translates them, in some of its languages.
GWYDDION = {
    "en": ("Width:", "Height:", "Value units:", "Lateral units:"),
    "fr": ("Largeur :", "Hauteur :", "Unités :", "Unités latérales :"),
    "ko": ("폭:", "높이:", "값 단위:", "Lateral units:"),
}


@pytest.mark.parametrize("language", GWYDDION)
def test_headings_of_gwyddion_in_its_languages(tmp_path, language):
    width, height, values, lateral = GWYDDION[language]
    image = ["# Z: Z", f"# {width} 12.00 µm", f"# {height} 12000 nm", f"# {values} nm"]
    assert_heights(read(written(tmp_path, text(rows(), "\t", image), "scan.txt"), height_unit=None, size=None))
    places = ["# Z: Z", f"# {lateral} µm", f"# {values} nm"]
    assert_heights(read(written(tmp_path, text(points(), "\t", places), "scan.xyz"), height_unit=None, size=None))


@pytest.mark.parametrize("heading", ["ncols 24\nnrows 24\ncellsize 0.5", "DSAA\n24 24\n0 11.5\n1 12.5\n-500 500"])
def test_grids_of_esri_and_surfer_that_end_early_are_refused(tmp_path, heading):
    numbers = [field for row in rows() for field in row]
    lines = [numbers[k : k + 5] for k in range(0, GRID**2, 5)]
    content = text(lines, " ", [heading])
    assert_heights(read(written(tmp_path, content, "scan.grd"), size=None, lateral_unit=UM))
    with refused("path", "numbers in the last row|23 rows of numbers"):
        read(written(tmp_path, content.rsplit(None, 24)[0], "scan.grd"), size=None, lateral_unit=UM)


def test_a_size_has_the_proportions_of_the_coordinates(tmp_path):
    path = written(tmp_path, text(points()[: 20 * GRID]), "scan.xyz")
    with refused("size", "the proportions 12 : 10 of the coordinates"):
        read(path)
    assert "pixels of 1 um x 1 um" in read(path, size=(24 * UM, 20 * UM), boundary="mirror").reading


@pytest.mark.parametrize(
    ("said", "stored"),
    [
        ("NODATA_value -3.4028234663852886e+38", "-3.402823e+38"),
        ("NODATA_value -9999.000", "-9999"),
        ("Invalid: 32767", "32767"),
        ("", "-9999"),
    ],
)
def test_missing_values_agree_to_the_digits_that_are_written(tmp_path, said, stored):
    heading = ["ncols 24", "nrows 24", "cellsize 500", said]
    fields = rows()
    fields[3][4] = stored
    assert_heights(read(written(tmp_path, text(fields, " ", heading), "scan.asc")), missing=1)


def decimal(write, heights=HEIGHTS):
    return rows(heights, lambda height: write.format(height).replace(".", ","))


def thousands(separator, offset=5000):
    return rows(HEIGHTS + offset, lambda height: f"{height:,.0f}".replace(",", separator))


CONTENT = text(rows(), " ")
THIRDS = [f"{k / 3:.2f}" for k in range(GRID)]
BLANKS = "blanks may separate thousands or columns|has .* in line 1, column 1; expected a number"
ZYGO = ["Zygo ASCII Data File - Format 2", '1 7 5 0 "Thu Jan 01 2026"', "0 0 0 0 0 0", "0 0 24 24", "#"]
IMAGE = "# Channel: {}\n# Width: 12.00 µm\n# Height: 12.00 µm\n# Value units: nm\n" + text(rows(), "\t")
CURVES = r"is a table of .*[Rr]adius.*belong to the section `measurements`"
CURVE = [[str(k**power) for power in (1, 2, 3)] for k in range(1, 12)]
REFUSED = [
    (text([[*row, str(k)] for k, row in enumerate(rows())]), "last column"),
    (text(with_coordinates(THIRDS, 1, 1, "y/x")), "'y/x' in line 1"),
    (text(with_coordinates(THIRDS, 1, 1, ""), " "), "24 numbers in line 1 but 25"),
    (IMAGE.format("Topography") + "\n" + IMAGE.format("Phase"), "2 blocks of rows, the second from line 34"),
    (text(rows(write="{:.0f}".format), " ", ZYGO), "Zygo file without points"),
    # Commas, points and blanks between digits, which may be decimal or separate thousands or columns.
    *((text(decimal("{:.2f}"), delimiter), "decimal") for delimiter in ", "),
    (text(decimal("{:.1f}")), "decimal"),
    (text(decimal("{:.3f}"), ", "), "decimal"),
    *((text(rows(1e4 + 10 * HEIGHTS, "{:,.0f}".format), delimiter), "separate thousands") for delimiter in "\t;"),
    *((text(thousands("."), delimiter), "that may separate thousands.*add a digit") for delimiter in "\t; "),
    (text(thousands(".", 1000), "\t"), "that may separate thousands.*add a digit"),
    *((text(thousands(blank), delimiter), BLANKS) for delimiter, blank in ("\t ", "; ", "\t\xa0", " \u202f")),
    # Curves of a contact.
    (text(CURVE, heading=["load (mN),contact radius (um),depth (nm)"]), CURVES),
    (text(np.array(CURVE)[:, :2], heading=["Force [N],Radius [m]"]), CURVES),
    # Damage.
    (gzip.compress(CONTENT.encode())[:-200], "the file is damaged"),
    (text([[f"L{k}", *row] for k, row in enumerate(rows())]), "'L0' in line 1, column 1"),
    (text([["xxx", *row] for row in rows()], heading=["a,b", ""]), "'xxx' in line 3"),
    (text(rows()).replace("\n", "]\n"), r"\]' in line 1, column 24"),
    (text(rows()).replace("\n", '"\n', 1), "\"' in line 1, column 24"),
]


@pytest.mark.parametrize(("content", "words"), REFUSED, ids=[words for _, words in REFUSED])
def test_texts_that_are_no_heights_or_can_be_read_in_two_ways_are_refused(tmp_path, content, words):
    (tmp_path / "scan.txt").write_bytes(content if isinstance(content, bytes) else content.encode())
    for keys in ({}, {"height_unit": None, "size": None}):
        with refused("path", words):
            read(tmp_path / "scan.txt", **keys)


@pytest.mark.parametrize(
    ("fields", "delimiter"),
    [
        *((decimal("{:.3f}", HEIGHTS + 1e4), delimiter) for delimiter in "\t;"),
        *((rows(), f" {delimiter} ") for delimiter in "\t; "),
        (rows(write=lambda height: f"{height:.10E}".replace("E", "D")), " "),
    ],
)
def test_numbers_as_programs_write_them(tmp_path, fields, delimiter):
    assert_heights(read(written(tmp_path, text(fields, delimiter))))


@pytest.mark.parametrize(
    ("heading", "order"),
    [
        ("x [um],y [um],z [nm]", (0, 1, 2)),
        ("Y(um),X(um),Z(nm)", (1, 0, 2)),
        ("z [nm],x [um],y [um]", (2, 0, 1)),
        ("X/um,Y/um,z_nm", (0, 1, 2)),
        ("Y;X;Z\n[um];[um];[nm]", (1, 0, 2)),
        ("X Y Z\n[um] [um] [nm]", (0, 1, 2)),
    ],
)
def test_titles_of_columns_give_their_order_and_units(tmp_path, heading, order):
    lines = [[line[k] for k in order] for line in points()]
    delimiter = next((sign for sign in ";," if sign in heading), " ")
    path = written(tmp_path, text(lines, delimiter, [heading]))
    for unit in (None, NM):
        assert_heights(read(path, height_unit=unit, size=None))
    wide = read(path, size=None, lateral_unit=2 * UM)
    np.testing.assert_allclose(wide.surface.period, 2 * SIDE)


def test_units_in_titles_may_differ_and_count_for_given_columns(tmp_path):
    lines = [[f"{float(x) / 1000:.4f}", y, z] for x, y, z in points()]
    path = written(tmp_path, text(lines, ",", ["x [mm],y [um],z [nm]"]))
    assert_heights(read(path, height_unit=None, size=None))
    assert_heights(read(path))
    path = written(tmp_path, text(lines, ",", ["along [mm],across [um],relief [nm]"]))
    assert_heights(read(path, height_unit=None, size=None, columns=(1, 2, 3)))


@pytest.mark.parametrize("given", [{"lateral_unit": UM, "size": None}, {}])
def test_points_of_nan_are_missing_points_of_a_grid(tmp_path, given):
    lines = points()
    for k in (5, 77, 300):
        lines[k] = ["nan"] * 3
    lines[200][2] = "nan"
    assert_heights(read(written(tmp_path, text(lines, " "), "scan.xyz"), **given), missing=4)
    lines[:GRID] = [["nan"] * 3] * GRID
    with refused("path", f"{GRID + 2} lines without coordinates, but the grid of the other lines lacks 2 points"):
        read(written(tmp_path, text(lines, " "), "scan.xyz"), **given)
    lines[0][2] = "3.5"
    with refused("path", "a height without coordinates"):
        read(written(tmp_path, text(lines, " "), "scan.xyz"), **given)


@pytest.mark.parametrize("titles", ["row,col,z", "x_1,y_1,z_raw"])
def test_titles_that_are_not_known_are_asked_about(tmp_path, titles):
    path = written(tmp_path, text(points(), ",", [titles]))
    with refused("columns", f"the columns are {titles.replace(',', ', ')}; expected"):
        read(path, size=None, lateral_unit=UM)
    assert_heights(read(path, size=None, lateral_unit=UM, columns=(1, 2, 3)))
    path = written(tmp_path, text(points(), ",", ["x (px),y (px),z (nm)"]))
    with refused("lateral_unit", "does not contain the unit of its coordinates"):
        read(path, size=None)


@pytest.mark.parametrize(
    "line",
    ["# Z axis: down", "Z-Axis direction = inverted", "polarity: depth positive", "Depth unit: nm", "Tiefen in nm"],
)
def test_numbers_that_increase_downwards_are_not_read_as_heights(tmp_path, line):
    path = written(tmp_path, text(rows(), heading=[line]))
    with pytest.raises(UnfitTopography, match="valleys") as refusal:
        read(path)
    assert refusal.value.key == "touches_first"
    turned = read(path, touches_first="low").surface.heights / NM
    np.testing.assert_allclose(np.ptp(turned), np.ptp(HEIGHTS), rtol=1e-9)
    assert np.corrcoef(turned.ravel(), HEIGHTS.ravel())[0, 1] < 0


def test_points_with_a_title_of_depths_are_asked_about(tmp_path):
    for title in ("Depth (nm)", "Tiefe [nm]", "z_depth (nm)"):
        path = written(tmp_path, text(points(), ",", ["Bit depth: 16", f'"X (um)","Y (um)","{title}"']))
        with refused("touches_first", re.escape(title)):
            read(path, size=None, height_unit=None, columns=(1, 2, 3))
