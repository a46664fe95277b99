"""The report is one page without external parts and scripts, shows failures, and changes with the data only."""

import re
import shutil
from html.parser import HTMLParser

import compared_campaign as compared
import numpy as np
import pytest
import small_campaign as small

from icha.analysis.checks import check_campaign
from icha.checks.findings import Check
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_dataset
from icha.datasets.labels import RunLabels
from icha.datasets.surface_file import write_surface
from icha.figures import one_asperity
from icha.figures.style import save
from icha.report import report
from icha.report.report import write_report
from icha.report.spectra import draw_spectra, read_surface_statistics
from icha.report.validity import measured_errors
from icha.support.formatting import format_quantity


class Page(HTMLParser):
    """Collect links and identifiers of a page, and check that tags are closed."""

    VOID = frozenset({"meta", "link", "img", "br"})

    def __init__(self, text):
        super().__init__()
        self.open, self.targets, self.ids = [], [], set()
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append(tag)
        self.targets += [value for name, value in attrs if name in ("href", "src")]
        self.ids |= {value for name, value in attrs if name == "id"}

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def rows(text, caption):
    """The cells of the rows of the table with a caption."""
    body = text.split(f"<caption>{caption}")[1].split("<tbody>")[1].split("</tbody>")[0]
    return [re.findall(r"<td>(.*?)</td>", row, re.DOTALL) for row in body.split("</tr>")[:-1]]


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """A folder with a figure and a surface, and the checks of the small campaign."""
    folder = tmp_path_factory.mktemp("parts")
    save(one_asperity.jkr(), *(folder / f"figures/fig1_jkr.{ending}" for ending in ("png", "pdf")))
    (folder / "figures/fig1_jkr.txt").write_text("Caption <i>with</i> E*.\n")
    (folder / "figures/fig1_jkr.csv").write_text("x,y\n")
    write_surface(folder / "s.nc", small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
    return folder, check_campaign(small.tree())


@pytest.fixture
def write(tmp_path, parts):
    """A function that writes the report of the small campaign, with other arguments on request; it returns the text."""
    folder, checks = parts
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)

    def written(name="report.html", **changes):
        arguments = {
            "campaign": small.tree(),
            "figures": sorted((tmp_path / "figures").iterdir()),
            "checks": [] if "campaign" in changes else checks,
            "surfaces": [read_dataset(tmp_path / "s.nc")],
            "configuration": "name: small\ntext: <script>alert('no')</script>\n",
            "files": {"Campaign dataset": tmp_path / "dataset/small.nc"},
        }
        write_report(tmp_path / name, **(arguments | changes))
        return (tmp_path / name).read_text(encoding="utf-8")

    return written


def test_page_needs_no_other_files_and_is_always_the_same(write, tmp_path):
    text = write()
    page = Page(text)
    for target in page.targets:
        files = [f"figures/fig1_jkr.{ending}" for ending in ("png", "pdf", "csv")] + ["dataset/small.nc"]
        assert target.startswith(("data:", "#")) or target in files
        assert not target.startswith("#") or target[1:] in page.ids
    assert "://" not in re.sub(r"base64,[^\"]*", "", text) and str(tmp_path) not in text
    assert "<script" not in text and "script-src" not in text, "the page has no scripts"
    assert write("again.html") == text


def test_page_shows_statements_parameters_checks_and_captions(write):
    text = write()
    passed = f"<b>all {len(check_campaign(small.tree()))}</b> checks of the solved equations passed"
    for words in ("Small campaign", "25 MPa", "50 mJ/m²", "2.071 nm", passed, "100 µm", "CC0-1.0", "U_full/dgamma is "):
        assert words in text, words
    # Its surfaces are outside the validated range.
    assert "<b>partly outside</b>" in text and '<b class="bad">accuracy</b>' in text
    assert "&lt;script&gt;alert" in text
    assert "<b>Figure 1.</b> Caption &lt;i&gt;with&lt;/i&gt; <i>E</i><sup>∗</sup>." in text
    assert [row[1] for row in rows(text, "Studies")] == ["4 of 4", "2 of 2"]


def test_the_error_of_the_model_is_a_statement_and_failed_checks_are_listed(write):
    errors = compared.errors()
    (statement,) = measured_errors(errors).values()
    assert f"<b>error</b>: {statement.text}." in write(campaign=compared.tree(), model_error=errors)
    assert "<b>error</b>" not in write()
    failed = Check("residual", 1e-3, 1e-8, False, "largest equilibrium error over h_rms", "slopes/rough")
    text = write(checks=[failed])
    assert "1 of 1</b> checks of the solved equations failed" in text
    (row,) = rows(text, "Failed")
    assert row[2:4] == ["0.001", "1e-08"] and "✗ failed" in row[4] and row[5] == "slopes/rough"


def test_runs_that_means_leave_out_are_listed_and_counted(write, tmp_path):
    assert 'id="failures"' not in write()
    runs = {RunLabels("five", "asperities", "rough", k, 1.0, "soft"): small.run(k) for k in range(1, 6)}
    marks = {
        1: {"failed_checks": "loss below zero"},
        2: {"applicability": "asperity model not applicable: steps"},
        3: {"incomplete": "no equilibrium: <residual> 1e-3"},
    }
    some = {labels: run.assign_attrs(marks.get(labels.seed, {})) for labels, run in runs.items()}
    text = write(
        campaign=campaign_tree(some.items(), design=[*runs, next(iter(runs))._replace(seed=6)]), results=tmp_path
    )
    assert "#failures" in Page(text).targets and "<b>3</b> of 6 runs complete" in text
    assert "Study five: 3 of 6 runs; 1 failed a check, 1 did not finish, 1 not computed" in text
    found = rows(text, "Runs that are not part of means")
    kinds = ["failed", "failed", "missing", "model not applicable"]
    assert [row[1] for row in found] == kinds
    assert [row[2] for row in found][:2] == ["loss below zero", "no equilibrium: &lt;residual&gt; 1e-3"]
    first = next(iter(runs))
    assert f'<a href="runs/{first.path}.nc">five: rough, seed 1, slope 1, soft, asperities</a>' == found[0][0]
    assert "href" not in found[2][0] and "seed 2" in found[3][0]


def test_surfaces_have_spectra_and_sources(write, tmp_path):
    plain = read_surface_statistics(tmp_path / "s.nc")
    assert "height" not in plain
    origin = {"source_file": "scan & co.x3p", "source_sha256": "ab" * 32, "preparation": "tilt removed"}
    measured = plain.assign(measured_rms_slope=0.321).assign_attrs(origin | {"surface": "scan"})
    text = write(surfaces=[plain, measured, measured.assign(seed=2, rms_height=2 * measured["rms_height"])])
    assert rows(text, "Measured topographies") == [["scan", "scan &amp; co.x3p", "ab" * 32, "tilt removed"]]
    assert text.count('alt="Power spectra') == 1
    # As measured, although files have rms slope 1, with the range over the seeds.
    factor = 0.321 / float(measured["rms_slope"])
    row = rows(text, "Surfaces")[1]
    height, radius = float(measured["rms_height"]) * factor, 1 / (float(measured["rms_curvature"]) * factor)
    assert row[:2] == ["scan", "1, 2"] and "0.321" in row and format_quantity(radius, "m") in row
    assert f"{format_quantity(height, 'm')} to {format_quantity(2 * height, 'm')}" in row
    assert 'alt="Power spectra' not in write(surfaces=[plain.drop_dims("psd_bin")])


def test_spectra_are_means_over_the_seeds_and_many_have_graded_colours(parts):
    plain = read_surface_statistics(parts[0] / "s.nc")
    twice = [plain, plain.assign(power_spectrum=3 * plain["power_spectrum"], seed=2)]
    (axes,) = draw_spectra({"rough": twice}).axes
    power = plain["power_spectrum"].values
    np.testing.assert_allclose(axes.get_lines()[0].get_ydata(), 2 * power[power > 1e-16 * power.max()])
    many = draw_spectra({f"rough-hurst0.{k}": [plain] for k in range(20, 60)})
    assert len({line.get_color() for line in many.axes[0].get_lines()}) == 40 and len(many.legends[0].get_texts()) == 9


def test_long_tables_are_folded_and_cut(write, tmp_path, monkeypatch):
    monkeypatch.setattr(report, "FOLDED_ROWS", 2)
    monkeypatch.setattr(report, "MOST_ROWS", 3)
    surface = read_dataset(tmp_path / "s.nc")
    text = write(surfaces=[surface.assign_attrs(surface=f"s{k}") for k in range(5)])
    Page(text)
    assert len(rows(text, "Surfaces")) == 3 and re.search(r"<summary>Surfaces.*\(5\)", text)
    assert "The first 3 of 5 rows" in text
