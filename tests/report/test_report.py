"""The report is one page without external parts, shows failures, and changes with the data only."""

import re
import shutil
from html.parser import HTMLParser

import compared_campaign as compared
import cyclic_campaign as cyclic
import numpy as np
import pytest
import small_campaign as small
import xarray as xr
from scipy.stats import t

from icha.analysis.checks import check_campaign
from icha.analysis.common_loads import compare_campaign, compare_runs, interpolate
from icha.checks.findings import Check
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_campaign, read_dataset, write_dataset
from icha.datasets.labels import RunLabels
from icha.datasets.surface_file import write_surface
from icha.figures import fig1_jkr
from icha.figures.captions import caption_of
from icha.figures.select import path_steps
from icha.figures.style import save
from icha.report import report, studies
from icha.report.report import ReportFigure, write_report
from icha.report.run_times import write_times
from icha.report.sections import draw_spectra, read_surface_statistics
from icha.report.studies import collect_states
from icha.report.template import format_range, format_scientific
from icha.support.formatting import format_quantity

FIGURES = tuple(f"figures/fig1_jkr.{ending}" for ending in ("png", "pdf"))


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


def section(text, start, end):
    return text[text.index(f'<h2 id="{start}">') : text.index(f'<h2 id="{end}">')]


def rows(table):
    """The cells of the rows of a table."""
    body = table.split("<tbody>")[1].split("</tbody>")[0]
    return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row, re.DOTALL) for row in body.split("</tr>")[:-1]]


def areas_at(runs, pressure=1e-2):
    return np.array([collect_states(run)["reduced_pressure", pressure]["area"] for run in runs])


def seeds_of(study, seeds):
    return {RunLabels(study, "asperities", "rough", seed, 1.0, "soft"): small.run(seed) for seed in seeds}


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """A folder with a figure and a surface, and the checks of the small campaign."""
    folder = tmp_path_factory.mktemp("parts")
    save(fig1_jkr.figure(), *(folder / name for name in FIGURES))
    write_surface(folder / "s.nc", small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
    return folder, check_campaign(small.tree())


@pytest.fixture
def picture(tmp_path):
    def picture(name, *studies, caption=""):
        text = tmp_path / f"{name}.txt"
        text.write_text(f"{caption}\n")
        return ReportFigure(name, *(tmp_path / f for f in FIGURES), text, studies)

    return picture


@pytest.fixture
def write(tmp_path, parts, picture):
    """A function that writes the report of the small campaign, with other arguments on request; it returns the text."""
    folder, checks = parts
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)

    def written(name="report.html", **changes):
        arguments = {
            "campaign": small.tree(),
            "figures": [picture("fig1_jkr", caption=caption_of("fig1_jkr", ""))],
            "checks": [] if "campaign" in changes else checks,
            "surfaces": [read_dataset(tmp_path / "s.nc")],
            "configuration": "name: small\ntext: <script>alert('no')</script>\n",
            "dataset_path": tmp_path / "dataset" / "small.nc",
        }
        write_report(tmp_path / name, **(arguments | changes))
        return (tmp_path / name).read_text(encoding="utf-8")

    return written


def test_page_needs_no_other_files(write, tmp_path):
    text = write()
    page = Page(text)
    for target in page.targets:
        assert target.startswith(("data:", "#")) or target in ("figures/fig1_jkr.pdf", "dataset/small.nc")
        assert not target.startswith("#") or target[1:] in page.ids
    assert "://" not in re.sub(r"base64,[^\"]*", "", text) and str(tmp_path) not in text
    explored = write(results=tmp_path)
    assert "icha explore" not in text and 'href="explore.html"' in explored


def test_page_shows_parameters_results_and_checks(write):
    text = write()
    passed = f"all {len(check_campaign(small.tree()))}</b> checks of the solved equations passed"
    for words in ("Small campaign", "25 MPa", "50 mJ/m²", "2.071 nm", passed, "100 µm", "CC0-1.0"):
        assert words in text, words
    assert "<script>alert" not in text and "&lt;script&gt;alert" in text
    (area,) = areas_at([small.run(rms_slope=0.2, material="hertz")])
    assert f"{area:.4f}" in text


def test_error_of_the_model_has_a_section_if_it_is_known(write):
    assert 'id="error"' not in write() and "#error" not in Page(write()).targets

    def section_of(material):
        errors = compared.errors()["one"].to_dataset()
        errors = xr.DataTree.from_dict({"/one": errors.sel(material=[material]).assign_attrs(errors.attrs)})
        text = write(campaign=compared.tree_at_finite_range(), model_error=errors)
        page = Page(text)
        assert "error" in page.ids and "#error" in page.targets
        return section(text, "error", "surfaces")

    adhesive, bare = map(section_of, ("soft", "hertz"))
    # Without adhesion, a quarter more area and a fifth less separation in every state ...
    for words in (
        "The comparison has 6 states",
        "seeds 1, 2, 3",
        "The median error of the contact area is −20.0 %",
        "+25.0 %; errors range from +25.0 % to +25.0 %",
        f"{small.surface().grid}² nodes",
    ):
        assert words in bare, words
    assert "the grid resolves the range" in adhesive and "energetic area" in adhesive and "Griffith" not in adhesive
    assert "energetic area" not in bare
    # ... and with adhesion, a factor of the seed.
    errors = 100 / np.array(list(compared.AREA_FACTORS.values())) - 100
    for value in (np.median(errors), errors.min(), errors.max()):
        assert f"{value:.1f} %".replace("-", "−") in adhesive
    assert f"{errors.mean():.1f} ({errors.min():.1f} … {errors.max():.1f})".replace("-", "−") in adhesive
    assert not re.search(r"<td[^>]*>[^<]*±", adhesive)
    runs = compared.runs()
    area = np.mean([run["contact_area_fraction"][0] for labels, run in runs.items() if labels.material == "hertz"])
    assert f"{area:.5f}" in bare and f"{1.25 * area:.4f}" in bare
    assert f"{float(runs['one', 'asperities', 'rough', 2, 1.0, 'hertz']['nayak_parameter']):.3g}" in write()


def test_error_of_surfaces_with_different_slopes_has_no_empty_rows(write):
    text = section(write(campaign=compared.tree(), model_error=compared.errors_at_own_slopes()), "error", "surfaces")
    assert text.count("The comparison has 24 states") == 1 and "nan" not in text
    assert len(re.findall(r"<td>other</td>|<th[^>]*>other</th>", text)) == 4


def test_unloaded_runs_have_tables_of_pull_off_and_loss(write):
    assert "Hysteresis loss" not in write()
    text = write(campaign=cyclic.tree())
    Page(text)
    found = {}
    for name, table in re.findall(r"<caption>(Pull-off|Hysteresis loss)</caption>(.*?)</table>", text, flags=re.DOTALL):
        head = [re.sub("<.*?>", "", cell) for cell in re.findall(r"<th[ >].*?</th>", table.split("<tbody>")[0])]
        found[name] = {row[1]: dict(zip(head, row, strict=True)) for row in rows(table)}
    pull_off, loss = found["Pull-off"], found["Hysteresis loss"]
    runs = [run for labels, run in cyclic.runs().items() if (labels.study, labels.material) == ("loops", "soft")]
    tensions = np.array([float(run["pull_off_pressure"]) for run in runs]) / 1e3
    assert tensions.min() > 10 and tensions.max() < 1000
    assert pull_off["soft"]["Pull-off"] == f"{tensions.mean():.0f} kPa<br>({tensions.min():.0f} … {tensions.max():.0f})"
    assert pull_off["soft"]["Seeds"] == "2" and pull_off["soft"]["Pull-off / sum of asperities"] == "0.250"
    assert pull_off["hertz"]["Pull-off"] == "0 Pa" and pull_off["hertz"]["Last contact"] == "–"
    # All is lost in jumps out of contact, and nothing without adhesion.
    assert loss["soft"]["Jump-off, %"] == "100.0" and loss["hertz"]["Jump-off, %"] == "–"
    assert loss["hertz"]["Loss"] == "0 J/m²" and loss["hertz"]["Loss / Δγ"] == "–"
    over = np.array([float(run["hysteresis_loss"]) / 0.05 for run in runs])
    mean, low, high = (format_scientific(each) for each in (over.mean(), over.min(), over.max()))
    assert loss["soft"]["Loss / Δγ"] == f"{mean}<br>({low} … {high})".replace("-", "−")
    assert "Coalescence, %" not in loss["soft"], "a loss of zero in all rows has no column"


def test_statistics_are_of_the_first_loading(write):
    failed = Check("residual", 1e-3, 1e-8, False, "largest equilibrium error over h_rms", "slopes/rough")
    text = write(campaign=cyclic.tree(), checks=[failed])
    assert "1 of 1</b> checks of the solved equations failed" in text and "✗ failed" in text and "slopes/rough" in text
    run, spots = cyclic.run(seed=2, material="soft", between=4), int(small.run(seed=2)["spot_count"][-1])
    assert spots > 0
    row = re.search(
        r"<tr><th>loops: rough, seed 2, slope 1, soft</th>(.*?)</tr>", text[text.index('id="statistics"') :]
    )
    cells = re.findall(r"<td[^>]*>(.*?)</td>", row.group(1))
    assert cells[:3] == [str(run.sizes["step"]), str(int(run["asperity_count"])), str(spots)]


def test_checks_and_validity_are_separate(write):
    text = write(model_error=compared.errors())
    top = text[: text.index("</header>")]
    # Its surfaces have too few nodes per shortest wave.
    assert "</b> checks of the solved equations" in top and ">partly outside</b>" in top
    assert "U_full/dgamma is " in top and 'in this campaign <a href="#error">contact area ' in top


def test_times_and_memory_of_jobs_are_in_a_table(tmp_path):
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs/a.jsonl").write_text('{"s": 1.5, "max_uss": 120.5}\n{"s": 2.5, "max_uss": null}\n')
    (tmp_path / "b.jsonl").write_text('{"s": 0.5, "max_rss": 180.0, "max_uss": 20.0}\n')
    write_times(tmp_path / "t.tsv", tmp_path)
    assert (tmp_path / "t.tsv").read_text().splitlines()[1:] == ["b\t0.50\t20", "runs/a\t4.00\t120"]


def test_failed_runs_are_listed_with_their_reasons(write, tmp_path):
    assert 'id="failures"' not in write()
    runs = list(small.runs())
    runs[1] = (runs[1][0], runs[1][1].assign_attrs(incomplete="no equilibrium: <residual> 1e-3"))
    tree = campaign_tree(runs)
    text = write(campaign=tree, results=tmp_path)
    (row,) = rows(section(text, "failures", "figures"))
    assert row[1] == "no equilibrium: &lt;residual&gt; 1e-3" and f"runs/{runs[1][0].path}.nc" in row[0]
    assert "#failures" in Page(text).targets and "3 of 4 runs are complete" in text and "3 runs, 1 failed" in text
    # Tables of results do not contain it.
    tables = section(text, "studies", "surfaces")
    assert f"runs/{runs[0][0].path}.nc" in tables and f"runs/{runs[1][0].path}.nc" not in tables


def means(text):
    assert text.count("Means over <i>n</i> seeds") == 1
    return text[text.index("Means over <i>n</i> seeds") :].split("</table>")[0]


def test_means_over_few_seeds_have_their_extremes(write):
    table = means(write())  # of the study with two seeds
    pressures = re.findall(r'<th class="num">([\d.]+)</th>', table)
    (row,) = rows(table)
    areas = areas_at([small.run(seed) for seed in (1, 2)])
    assert pressures == [f"{p:g}" for p in small.PRESSURES], "the stops of the path"
    cell = row[-len(pressures) :][pressures.index("0.01")].split("<br>")[0]
    assert cell == f"{np.mean(areas):.4f} ({min(areas):.4f} … {max(areas):.4f})"
    assert "±" not in table.split("<tbody>")[1]


def test_means_over_remaining_seeds_have_their_number_and_no_confidence(write, picture):
    runs = seeds_of("five", range(1, 6))
    figures = [picture("fig2_area", "five", caption="Areas.")]
    whole = write(campaign=campaign_tree(runs.items()), figures=figures)
    (row,) = rows(means(whole))
    areas = areas_at(runs.values())
    half_width = t.ppf(0.975, 4) * np.std(areas, ddof=1) / 5**0.5
    assert row[3] == "5" and row[-2].split("<br>")[0] == f"{areas.mean():.4f} ±&thinsp;{half_width:.5f}"
    assert "Areas.</p>" in whole and 'id="not-applicable"' not in whole
    marks = {1: {"failed_checks": "loss below zero"}, 2: {"applicability": "asperity model not applicable: steps"}}
    some = {labels: run.assign_attrs(marks.get(labels.seed, {})) for labels, run in runs.items()}
    text = write(campaign=campaign_tree(some.items()), figures=figures)
    Page(text)
    separate, row = sorted(rows(means(text)), key=lambda cells: cells[3])
    assert separate[0].endswith("(model not applicable)") and separate[3].startswith("1 of 5 seeds; 1 failed")
    assert row[3] == "3 of 5 seeds; 1 failed a check, 1 averaged separately; biased, so no interval is stated"
    assert not any("±" in cell for cell in row)
    mean, low, high = map(format_scientific, (areas[2:].mean(), areas[2:].min(), areas[2:].max()))
    assert row[-2].split("<br>")[0] == f"{mean} ({low} … {high})"
    assert "loss below zero" in section(text, "failures", "not-applicable")
    assert "seed 2" in section(text, "not-applicable", "studies")
    assert "4 of 5 runs; 1 failed a check" in section(text, "failures", "not-applicable")


@pytest.mark.parametrize(
    ("values", "expected"), [([1.0] + [1e-3] * 4, r"\(0\.0.*"), ([1.0, 1e-3], r"\(0\.001 … 1\.000\)"), ([2.0, 2.0], "")]
)
def test_no_interval_of_areas_reaches_below_zero(values, expected):
    assert re.fullmatch(expected, format_range(np.array(values), "{:.3f}".format))


def test_figures_are_in_the_section_of_their_study_with_the_numbers_of_their_files(write, picture):
    figures = [
        picture(name, *names, caption=f"Caption of {name}.")
        for name, names in (
            ("fig5_late", ("single",)),
            ("fig9_early", ("slopes",)),
            ("fig2_both", ("slopes", "single")),
        )
    ]
    text = write(figures=figures)
    order = re.findall(r'<(?:figure|h3) id="((?:fig|study-).*?)">', text)
    assert order == ["fig2_both", "study-slopes", "fig9_early", "study-single", "fig5_late"]
    numbers = re.findall(r"<b>Figure (\d+)\.</b> Caption of fig(\d+)_", text)
    assert numbers == [("2", "2"), ("9", "9"), ("5", "5")]
    assert "line-clamp" not in text, "captions are complete"


@pytest.mark.parametrize("name", ["measured", "report"])
def test_graph_shows_studies_with_any_name(write, tmp_path, name):
    source = {"source_file": "scan.txt", "source_sha256": "ab", "preparation": "none", "surface": "scan"}
    runs = tuple((labels._replace(study=name), run) for labels, run in small.runs() if labels.study == "single")
    measured = read_dataset(tmp_path / "s.nc").assign_attrs(source)
    text = write(campaign=campaign_tree(runs), surfaces=[measured])
    graph = text.partition('<ol class="graph"')[2].partition("</ol>")[0]
    columns = [re.findall(r"<b>(.*?)</b>", column) for column in graph.split("<li>")[1:]]
    expected = [["Configuration", "Measurements"], ["Surfaces"], [name], ["Campaign dataset"], ["Figures", "Checks"]]
    assert columns == [*expected, ["Report"]]


def test_surfaces_have_spectra_and_sources(write, tmp_path):
    plain = read_surface_statistics(tmp_path / "s.nc")
    assert "height" not in plain
    origin = {"source_file": "scan & co.x3p", "source_sha256": "ab" * 32, "preparation": "tilt removed"}
    measured = plain.assign(measured_rms_slope=0.321).assign_attrs(origin | {"surface": "scan"})
    text = section(write(surfaces=[plain, measured, measured.assign(seed=2)]), "surfaces", "checks")
    for words in ("scan &amp; co.x3p", "tilt removed", "0.321"):
        assert words in text
    assert text.count("ab" * 32) == 1 and text.count('<img class="chart"') == 1
    # As measured, although files have rms slope 1.
    factor = 0.321 / float(measured["rms_slope"])
    row = re.findall(r"<tr><th>scan</th>.*?</tr>", text)[-1]
    for value in (float(measured["rms_height"]) * factor, 1 / (float(measured["rms_curvature"]) * factor)):
        assert f">{format_quantity(value, 'm')}<" in row
    assert '<img class="chart"' not in section(write(surfaces=[plain.drop_dims("psd_bin")]), "surfaces", "checks")


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
    for module in (report, studies):
        monkeypatch.setattr(module, "MOST_ROWS", 3)
    run = small.run()
    runs = [(labels, run.assign(seed=0 * run.seed + labels.seed)) for labels in seeds_of("many", range(1, 6))]
    text = write(campaign=campaign_tree(runs), results=tmp_path)
    Page(text)
    statistics = section(text, "statistics", "data")
    assert statistics.count("<tr>") == 3 + 1 and "<summary>Every run (5)" in statistics
    assert "The first 3 of 5 rows" in text and "<b>5</b> complete runs" in text


# --- comparison at common loads ---


def test_comparison_is_of_the_first_loading():
    loops = {labels: run for labels, run in cyclic.runs().items() if labels.study == "loops"}
    loading = campaign_tree((labels, small.run(labels.seed, 1.0, labels.material)) for labels in loops)
    one, other = compare_campaign(cyclic.tree())["loops"], compare_campaign(loading)["loops"]
    assert one.sizes["reduced_pressure"] > 5
    for name in other.data_vars:
        np.testing.assert_array_equal(one[name].values, other[name].values, err_msg=name)
    assert collect_states(cyclic.run(between=3)) == collect_states(small.run())


def test_interpolation_is_exact_at_the_stops_and_monotone_between():
    run = small.run()
    load, area = run["reduced_pressure"].values, run["contact_area_fraction"].values
    np.testing.assert_allclose(interpolate(load, area, load, logarithmic=True), area, rtol=1e-12)
    fine = interpolate(load, area, np.geomspace(load[0], load[-1], 200), logarithmic=True)
    assert np.all(np.diff(fine) > 0)
    np.testing.assert_allclose(
        interpolate([1e-3, 1e-2, 1e-1], [2e-3, 2e-2, 2e-1], [3e-3, 5e-2], logarithmic=True), [6e-3, 0.1], rtol=1e-12
    )
    with pytest.raises(ValueError, match="outside"):
        interpolate(load, area, [2 * load[-1]], logarithmic=True)


def test_comparison_of_slopes_without_adhesion_shows_no_spread():
    runs = [(labels, run) for labels, run in small.runs() if labels.material == "hertz"]
    comparison = compare_runs(campaign_tree(runs)["slopes"].to_dataset())
    # The stops of the slopes differ, so the curves agree to the accuracy of interpolation only ...
    assert float(comparison["slope_spread"].max()) < 0.03
    # ... but at common stops, the areas are equal.
    first, second = (path_steps(run)["contact_area_fraction"].values for _, run in runs)
    np.testing.assert_allclose(first, second, rtol=1e-6)
    assert float(comparison["slope_spread_at_load"].min()) > 1


def test_studies_without_a_common_load_are_compared_where_possible(tmp_path):
    labels, run = next((labels, run) for labels, run in small.runs() if labels.study == "slopes")
    steep = run.isel(step=run["reduced_pressure"].values > 5e-3)
    flat = small.run(rms_slope=0.2).isel(step=slice(0, steep.sizes["step"]))
    keep = {"snapshot": slice(0, 0), "spot": slice(0, 0)}
    tree = campaign_tree([(labels, steep.isel(keep)), (labels._replace(rms_slope=0.2), flat.isel(keep))])
    comparison = compare_campaign(tree)
    assert comparison["slopes"].sizes["relative_load"] == 0
    write_dataset(comparison, tmp_path / "c.nc")
    assert read_campaign(tmp_path / "c.nc")["slopes"].sizes["relative_load"] == 0
