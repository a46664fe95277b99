"""The report is one page without outside parts, shows failures, and changes with the data only."""

import re
import shutil
from html.parser import HTMLParser

import compared_campaign as compared
import cyclic_campaign as cyclic
import numpy as np
import pytest
import small_campaign as small
from scipy.stats import t

from icha.analysis.checks import check_campaign
from icha.analysis.common_loads import compare_campaign, compare_runs, interpolated
from icha.checks.findings import Check
from icha.datasets.campaign import campaign_tree
from icha.datasets.files import read_campaign, read_dataset, write_dataset
from icha.datasets.labels import RunLabels
from icha.datasets.surface_file import write_surface
from icha.figures import fig1_jkr
from icha.figures.captions import caption_of
from icha.figures.select import path_steps
from icha.figures.style import quantity, save
from icha.report import report, studies
from icha.report.report import ReportFigure, write_report
from icha.report.run_times import Benchmark, read_benchmark, write_times, write_times_page
from icha.report.sections import _draw_spectra, read_surface_statistics
from icha.report.studies import _range, own_stops
from icha.report.template import scientific


class Page(HTMLParser):
    """Collects what a page refers to, and sees that tags are closed."""

    VOID = frozenset({"meta", "link", "img", "br"})

    def __init__(self, text):
        super().__init__()
        self.open, self.targets, self.ids = [], [], set()
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name in ("href", "src"):
                self.targets.append(value)
            if name == "id":
                self.ids.add(value)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """A folder with a figure and a surface, and what is found of the small campaign."""
    folder = tmp_path_factory.mktemp("parts")
    save(fig1_jkr.figure(), *(folder / "figures" / f"fig1_jkr.{ending}" for ending in ("png", "pdf")))
    write_surface(folder / "s.nc", small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
    return folder, check_campaign(small.tree()), compare_campaign(small.tree())


@pytest.fixture
def write(tmp_path, parts):
    folder, checks, comparison = parts
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    files = [tmp_path / "figures" / f"fig1_jkr.{ending}" for ending in ("png", "pdf")]
    picture = ReportFigure("fig1_jkr", caption_of("fig1_jkr"), *files)

    def written(name="report.html", **changes):
        arguments = {
            "campaign": small.tree(),
            "figures": [picture],
            "checks": checks,
            "comparison": comparison,
            "surfaces": [read_dataset(tmp_path / "s.nc")],
            "configuration": "name: small\ntext: <script>alert('no')</script>\n",
            "dataset_path": tmp_path / "dataset" / "small.nc",
        }
        write_report(tmp_path / name, **(arguments | changes))
        return (tmp_path / name).read_text(encoding="utf-8")

    return written


def test_page_needs_nothing_from_outside(write, tmp_path):
    text = write()
    page = Page(text)
    for target in page.targets:
        assert target.startswith(("data:", "#")) or target in ("figures/fig1_jkr.pdf", "dataset/small.nc")
        if target.startswith("#"):
            assert target[1:] in page.ids
    assert "://" not in re.sub(r"base64,[^\"]*", "", text) and str(tmp_path) not in text
    explored = write(results=tmp_path)
    assert "icha explore" not in text and 'href="explore.html"' in explored


def test_page_shows_parameters_results_and_checks(write):
    text = write()
    passed = f"all {len(check_campaign(small.tree()))} passed"
    for part in ("Small campaign", "25 MPa", "50 mJ/m²", "2.071 nm", passed, "100 µm", "CC0-1.0"):
        assert part in text, part
    assert "<script>alert" not in text and "&lt;script&gt;alert" in text
    area = own_stops(small.run(rms_slope=0.2, material="hertz"))["reduced_pressure", 1e-2]["area"]
    assert f"{area:.4f}" in text


def test_error_of_the_model_has_a_section_where_it_is_known(write):
    assert 'id="error"' not in write() and "#error" not in Page(write()).targets
    text = write(campaign=compared.tree(), comparison=None, checks=[], model_error=compared.errors())
    page = Page(text)
    assert "error" in page.ids and "#error" in page.targets
    section = text[text.index('<h2 id="error">') : text.index('<h2 id="surfaces">')]
    adhesive, bare = section.split("<h3>")[1:]
    # A quarter more area and a fifth less separation in every state without adhesion ...
    for part in (
        "In 6 states",
        "seeds 1, 2, 3",
        "−20.0 % in the median",
        "+25.0 %, from +25.0 % to +25.0 %",
        "96² nodes",
    ):
        assert part in bare, part
    assert "hysteresis" in adhesive and "hysteresis" not in bare
    # ... and a factor of the seed with it.
    errors = 100 / np.array(list(compared.AREA_FACTORS.values())) - 100
    for value in (np.median(errors), errors.min(), errors.max()):
        assert f"{value:.1f} %".replace("-", "−") in adhesive
    assert f"{errors.mean():.1f} ({errors.min():.1f} … {errors.max():.1f})".replace("-", "−") in adhesive
    assert "±" not in adhesive
    run = compared.runs()["one", "asperities", "rough", 2, 1.0, "hertz"]
    areas = [
        float(own["contact_area_fraction"].values[0])
        for labels, own in compared.runs().items()
        if labels.material == "hertz"
    ]
    assert f"{np.mean(areas):.5f}" in bare and f"{1.25 * np.mean(areas):.4f}" in bare
    assert f"{float(run['nayak_parameter']):.3g}" in text


def test_error_of_surfaces_with_slopes_of_their_own_has_no_empty_rows(write):
    errors = compared.errors_at_own_slopes()
    text = write(campaign=compared.tree(), comparison=None, checks=[], model_error=errors)
    section = text[text.index('<h2 id="error">') : text.index('<h2 id="surfaces">')]
    assert section.count("In 12 states") == 2 and "nan" not in section
    assert len(re.findall(r"<td>other</td>|<th[^>]*>other</th>", section)) == 4


def loop_rows(text):
    """The cells of the two tables on pull-off and loss, by material."""
    tables = re.findall(r"<caption>(Pull-off|Hysteresis loss)</caption>(.*?)</table>", text, flags=re.DOTALL)
    assert [name for name, _ in tables] == ["Pull-off", "Hysteresis loss"]
    found = []
    for _, table in tables:
        head = [re.sub("<.*?>", "", cell) for cell in re.findall(r"<th[ >].*?</th>", table.split("<tbody>")[0])]
        rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in table.split("<tbody>")[1].split("</tr>")[:-1]]
        assert all(len(row) == len(head) for row in rows)
        found.append({row[1]: dict(zip(head, row, strict=True)) for row in rows})
    return found


def test_runs_that_come_back_have_tables_of_pull_off_and_loss(write):
    assert "Hysteresis loss" not in write()
    text = write(campaign=cyclic.tree(), comparison=compare_campaign(cyclic.tree()), checks=[])
    Page(text)
    pull_off, loss = loop_rows(text)
    runs = [run for labels, run in cyclic.runs().items() if (labels.study, labels.material) == ("loops", "soft")]
    tensions = np.array([float(run["pull_off_pressure"]) for run in runs]) / 1e3
    assert tensions.min() > 10 and tensions.max() < 1000
    assert pull_off["soft"]["Pull-off"] == f"{tensions.mean():.0f} kPa<br>({tensions.min():.0f} … {tensions.max():.0f})"
    assert pull_off["soft"]["Seeds"] == "2" and pull_off["soft"]["over all asperities"] == "0.250"
    assert pull_off["hertz"]["Pull-off"] == "0 Pa" and pull_off["hertz"]["Last contact"] == "–"
    # All is lost in jumping off, and nothing without adhesion.
    assert loss["soft"]["Jumping off, %"] == "100.0" and loss["hertz"]["Jumping off, %"] == "–"
    assert loss["hertz"]["Loss"] == "0 J/m²" and loss["hertz"]["over Δγ"] == "–"
    over = np.array([float(run["hysteresis_loss"]) / 0.05 for run in runs])
    mean, low, high = (scientific(each) for each in (over.mean(), over.min(), over.max()))
    assert loss["soft"]["over Δγ"] == f"{mean}<br>({low} … {high})".replace("-", "−")
    assert "Unions, %" not in loss["soft"], "what is nowhere lost has no column"
    formed, broken = loss["soft"]["Contacts formed, broken"].split("<br>")
    assert formed == broken == f"{np.mean([float(run['spot_count'].max()) for run in runs]):.4g}"


def test_statistics_are_of_the_first_loading(write):
    failed = Check("residual", 1e-3, 1e-8, False, "largest equilibrium error over h_rms", "slopes/rough")
    text = write(campaign=cyclic.tree(), comparison=None, checks=[failed])
    assert "1 of 1 failed" in text and "✗ failed" in text and "slopes/rough" in text
    run, spots = cyclic.run(seed=2, material="soft", between=4), int(small.run(seed=2)["spot_count"][-1])
    assert spots > 0
    statistics = text[text.index('id="statistics"') :]
    row = re.search(r"<tr><th>loops: rough, seed 2, slope 1, soft</th>(.*?)</tr>", statistics)
    cells = re.findall(r"<td[^>]*>(.*?)</td>", row.group(1))
    assert cells[:3] == [str(run.sizes["step"]), str(int(run["asperity_count"])), str(spots)]


def test_passed_checks_and_a_model_that_holds_are_told_apart(write):
    text = write(model_error=compared.errors())
    top = text[: text.index("</header>")]
    # Its surfaces have too few nodes to the shortest wave.
    assert "checks of the results: the equations are solved" in top and ">partly outside</b>" in top
    assert "U_full/dgamma is " in top and "; all cases inside" in top
    assert 'in this campaign <a href="#error">contact area ' in top


def test_comparison_is_of_the_first_loading():
    study = {labels: run for labels, run in cyclic.runs().items() if labels.study == "loops"}
    there = campaign_tree((labels, small.run(labels.seed, 1.0, labels.material)) for labels in study)
    one, other = compare_campaign(cyclic.tree())["loops"], compare_campaign(there)["loops"]
    assert one.sizes["reduced_pressure"] > 5
    for name in other.data_vars:
        np.testing.assert_array_equal(one[name].values, other[name].values, err_msg=name)
    assert own_stops(cyclic.run(between=3)) == own_stops(small.run())


def test_same_bytes_twice_whatever_the_times(write, tmp_path):
    times = tmp_path / "benchmarks" / "index.html"
    text = write("a.html", times_path=times)
    write_times_page(times, [Benchmark("runs/a/b", 3.0, 120.0)])
    assert text == write("b.html", times_path=times)
    assert '<object class="times" type="text/html" data="benchmarks/index.html"' in text
    assert "benchmarks/index.html" not in write()


def test_times_are_summed_by_kind_of_job(tmp_path):
    jobs = [Benchmark("runs/a/1", 3.0, 120.0), Benchmark("runs/a/2", 90.0, None), Benchmark("dataset", 7300.0, 300.4)]
    write_times_page(tmp_path / "t.html", jobs)
    text = (tmp_path / "t.html").read_text(encoding="utf-8")
    Page(text)
    kinds, longest = (part.split("</tbody>")[0] for part in text.split("<tbody>")[1:])
    cells = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in kinds.split("</tr>")[:-1]]
    assert [row[:3] for row in cells] == [["dataset", "1", "2 h"], ["runs", "2", "1.6 min"]]
    assert re.findall(r"<tr><th>(.*?)</th>", longest) == ["dataset", "runs/a/2", "runs/a/1"]


def section(text, start, end):
    return text[text.index(f'<h2 id="{start}">') : text.index(f'<h2 id="{end}">')]


def test_failed_runs_are_listed_with_their_reasons(write, tmp_path):
    assert 'id="failures"' not in write()
    runs = list(small.runs())
    runs[1] = (runs[1][0], runs[1][1].assign_attrs(incomplete="no equilibrium: <residual> 1e-3"))
    tree = campaign_tree(runs)
    text = write(campaign=tree, comparison=compare_campaign(tree), results=tmp_path)
    page = Page(text)
    (row,) = re.findall(r"<tr>(.*?)</tr>", section(text, "failures", "figures").split("<tbody>")[1])
    assert "no equilibrium: &lt;residual&gt; 1e-3" in row
    assert f"runs/{runs[1][0].path}.nc" in row and "#failures" in page.targets
    assert "3 of 4 runs are complete" in text and "3 runs, 1 failed" in text
    # Its values stand nowhere.
    shown = section(text, "studies", "surfaces")
    assert f"runs/{runs[0][0].path}.nc" in shown and f"runs/{runs[1][0].path}.nc" not in shown


def test_means_over_the_seeds_have_their_confidence(write):
    text = write()
    assert text.count("Means over <i>n</i> seeds") == 1, "of the study of two seeds alone"
    table = text[text.index("Means over <i>n</i> seeds") :].split("</table>")[0]
    pressures = re.findall(r'<th class="num">([\d.]+)</th>', table)
    cells = dict(zip(pressures, re.findall(r"<td[^>]*>(.*?)</td>", table)[-len(pressures) :], strict=True))
    areas = [own_stops(small.run(seed))["reduced_pressure", 1e-2]["area"] for seed in (1, 2)]
    assert list(cells) == [f"{p:g}" for p in small.PRESSURES], "the stops of the path"
    assert cells["0.01"].split("<br>")[0] == f"{np.mean(areas):.4f} ({min(areas):.4f} … {max(areas):.4f})"
    assert "±" not in table.split("<tbody>")[1]


def test_tables_of_survivors_promise_no_confidence_and_count(write, tmp_path):
    runs = {RunLabels("five", "asperities", "rough", seed, 1.0, "soft"): small.run(seed) for seed in range(1, 6)}
    files = [tmp_path / "figures" / f"fig1_jkr.{ending}" for ending in ("png", "pdf")]
    figures = [ReportFigure("fig2_area", "Areas.", *files, ("five",))]

    def means(text):
        table = text[text.index("Means over <i>n</i> seeds") :].split("</table>")[0].split("<tbody>")[1]
        return [re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row) for row in table.split("</tr>")[:-1]]

    whole = write(campaign=campaign_tree(runs.items()), checks=[], comparison=None, figures=figures)
    (row,) = means(whole)
    areas = np.array([own_stops(run)["reduced_pressure", 1e-2]["area"] for run in runs.values()])
    assert (
        row[3] == "5"
        and row[-2].split("<br>")[0]
        == f"{areas.mean():.4f} ±&thinsp;{t.ppf(0.975, 4) * np.std(areas, ddof=1) / 5**0.5:.5f}"
    )
    assert "Areas.</p>" in whole and 'id="not-applicable"' not in whole
    marks = [{"failed_checks": "loss below zero"}, {"applicability": "asperity model not applicable: steps"}]
    some = {labels: run.assign_attrs(marks[labels.seed - 1] if labels.seed < 3 else {}) for labels, run in runs.items()}
    text = write(campaign=campaign_tree(some.items()), checks=[], comparison=None, figures=figures)
    Page(text)
    apart, row = sorted(means(text), key=lambda cells: cells[3])
    assert apart[0].endswith("(model not applicable)") and apart[3] == "1 of 5"
    assert row[3] == "3 of 5" and not any("±" in cell for cell in row)
    assert row[-2].split("<br>")[0] == (
        f"{scientific(areas[2:].mean())} ({scientific(areas[2:].min())} … {scientific(areas[2:].max())})"
    )
    assert "loss below zero" in section(text, "failures", "not-applicable")
    assert "seed 2" in section(text, "not-applicable", "studies")
    assert "Areas. 1 of 5 seeds of material soft failed their checks: see Failed runs. 1 run is marked:" in text


def test_no_interval_of_areas_reaches_below_zero():
    assert _range(np.array([1.0, 1e-3, 1e-3, 1e-3, 1e-3]), "{:.3f}".format).startswith("(0.0")
    assert _range(np.array([1.0, 1e-3]), "{:.3f}".format) == "(0.001 … 1.000)"
    assert _range(np.array([2.0, 2.0]), "{:.3f}".format) == ""


def test_figures_stand_with_their_study_and_have_the_numbers_of_their_files(write, tmp_path):
    def figure(name, studies):
        files = [tmp_path / "figures" / f"fig1_jkr.{ending}" for ending in ("png", "pdf")]
        return ReportFigure(name, f"Caption of {name}.", *files, studies)

    figures = [
        figure("fig5_late", ("single",)),
        figure("fig9_early", ("slopes",)),
        figure("fig2_both", ("slopes", "single")),
    ]
    text = write(figures=figures)
    order = re.findall(r'<figure id="(.*?)">|<h3 id="(study-.*?)">', text)
    assert [one or other for one, other in order] == [
        "fig2_both",
        "study-slopes",
        "fig9_early",
        "study-single",
        "fig5_late",
    ]
    numbers = re.findall(r"<b>Figure (\d+)\.</b> Caption of fig(\d+)_", text)
    assert numbers == [("2", "2"), ("9", "9"), ("5", "5")]
    assert "line-clamp" not in text, "captions are whole"


@pytest.mark.parametrize("name", ["measured", "report"])
def test_graph_shows_studies_whatever_they_are_called(write, tmp_path, name):
    source = {"source_file": "scan.txt", "source_sha256": "ab", "preparation": "none", "surface": "scan"}
    runs = tuple((labels._replace(study=name), run) for labels, run in small.runs() if labels.study == "single")
    measured = read_dataset(tmp_path / "s.nc").assign_attrs(source)
    text = write(campaign=campaign_tree(runs), checks=[], comparison=None, surfaces=[measured])
    graph = text.partition('<ol class="graph"')[2].partition("</ol>")[0]
    columns = [re.findall(r"<b>(.*?)</b>", column) for column in graph.split("<li>")[1:]]
    expected = [["Configuration", "Measurements"], ["Surfaces"], [name], ["Campaign dataset"], ["Figures", "Checks"]]
    assert columns == [*expected, ["Report"]]


def test_surfaces_show_spectra_and_where_measurements_come_from(write, tmp_path):
    plain = read_surface_statistics(tmp_path / "s.nc")
    assert "height" not in plain
    origin = {"source_file": "scan & co.x3p", "source_sha256": "ab" * 32, "preparation": "tilt removed"}
    measured = plain.assign(measured_rms_slope=0.321).assign_attrs(origin | {"surface": "scan"})
    text = section(write(surfaces=[plain, measured, measured.assign(seed=2)]), "surfaces", "checks")
    for part in ("scan &amp; co.x3p", "tilt removed", "0.321"):
        assert part in text
    assert text.count("ab" * 32) == 1 and text.count('<img class="chart"') == 1
    # In its own units: files are kept at rms slope 1.
    factor = 0.321 / float(measured["rms_slope"])
    scanned = re.findall(r"<tr><th>scan</th>.*?</tr>", text)[-1]
    for value in (float(measured["rms_height"]) * factor, 1 / (float(measured["rms_curvature"]) * factor)):
        assert f">{quantity(value, 'm')}<" in scanned
    assert '<img class="chart"' not in section(write(surfaces=[plain.drop_dims("psd_bin")]), "surfaces", "checks")


def test_spectra_are_means_over_the_seeds_and_many_have_a_scale(tmp_path, parts):
    plain = read_surface_statistics(parts[0] / "s.nc")
    twice = [plain, plain.assign(power_spectrum=3 * plain["power_spectrum"], seed=2)]
    (axes,) = _draw_spectra({"rough": twice}).axes
    power = plain["power_spectrum"].values
    np.testing.assert_allclose(axes.get_lines()[0].get_ydata(), 2 * power[power > 1e-16 * power.max()])
    many = _draw_spectra({f"rough-hurst0.{k}": [plain] for k in range(20, 60)})
    assert len(many.axes[0].get_lines()) == 40 and many.axes[1].get_ylabel() == "rough-hurst" and not many.legends


def test_long_tables_are_folded_and_cut_and_say_so(write, tmp_path, monkeypatch):
    monkeypatch.setattr(report, "FOLDED_ROWS", 2)
    for module in (report, studies):
        monkeypatch.setattr(module, "MOST_ROWS", 3)
    runs = [
        (
            RunLabels("many", "asperities", "rough", seed, 1.0, "soft"),
            small.run().assign(seed=0 * small.run().seed + seed),
        )
        for seed in range(1, 6)
    ]
    text = write(campaign=campaign_tree(runs), checks=[], comparison=None, results=tmp_path)
    Page(text)
    statistics = section(text, "statistics", "data")
    assert statistics.count("<tr>") == 3 + 1 and "<summary>Every run (5)" in statistics
    assert "The first 3 of 5 rows" in text and "<b>5</b> complete runs" in text


def test_repeats_in_benchmark_files_add_up(tmp_path):
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs/a.jsonl").write_text('{"s": 1.5, "max_rss": 120.5}\n{"s": 2.5, "max_rss": null}\n')
    # What a job had for itself, where that is known.
    (tmp_path / "b.jsonl").write_text('{"s": 0.5, "max_rss": 180.0, "max_uss": 20.0}\n')
    assert read_benchmark(tmp_path / "b.jsonl", "b") == Benchmark("b", 0.5, 20.0)
    write_times(tmp_path / "t.tsv", tmp_path / "t.html", tmp_path)
    assert (tmp_path / "t.tsv").read_text().splitlines()[1:] == ["b\t0.50\t20", "runs/a\t4.00\t120"]


def test_interpolation_is_exact_at_the_stops_and_monotone_between():
    run = small.run()
    load, area = run["reduced_pressure"].values, run["contact_area_fraction"].values
    np.testing.assert_allclose(interpolated(load, area, load, logarithmic=True), area, rtol=1e-12)
    fine = interpolated(load, area, np.geomspace(load[0], load[-1], 200), logarithmic=True)
    assert np.all(np.diff(fine) > 0)
    np.testing.assert_allclose(
        interpolated([1e-3, 1e-2, 1e-1], [2e-3, 2e-2, 2e-1], [3e-3, 5e-2], logarithmic=True), [6e-3, 0.1], rtol=1e-12
    )
    with pytest.raises(ValueError, match="outside"):
        interpolated(load, area, [2 * load[-1]], logarithmic=True)


def test_comparison_of_slopes_without_adhesion_shows_no_spread():
    runs = [(labels, run) for labels, run in small.runs() if labels.material == "hertz"]
    comparison = compare_runs(campaign_tree(runs)["slopes"].to_dataset())
    # Stops differ between the slopes, so the curves agree to the interpolation's accuracy only ...
    assert float(comparison["slope_spread"].max()) < 0.03
    # ... but at the stops they share, the areas are the same.
    first, second = (run for _, run in runs)
    areas = [path_steps(run)["contact_area_fraction"].values for run in (first, second)]
    np.testing.assert_allclose(areas[0], areas[1], rtol=1e-6)
    assert float(comparison["slope_spread_at_load"].min()) > 1


def test_differences_are_told_where_there_is_something_to_compare(write):
    def own_slopes(*materials):
        runs = [
            (RunLabels("own", "asperities", f"patch{slope:g}", 1, slope, material), small.run(1, slope, material))
            for slope in (1.0, 0.2)
            for material in materials
        ]
        tree = campaign_tree(runs)
        return write(campaign=tree, checks=[], comparison=compare_campaign(tree))

    both = write()
    assert "between materials" in both and "between rms slopes" in both
    # Every surface has a slope of its own: no two runs differ in the slope alone.
    assert "Largest difference" not in own_slopes("soft")
    several = own_slopes("soft", "hertz").partition("Largest difference")[2].partition("</p>")[0]
    assert "between materials" in several and "between rms slopes" not in several
    assert several.strip().endswith("at equal reduced pressure.")


def test_studies_without_a_common_load_are_compared_where_they_can_be(tmp_path):
    labels, run = next((labels, run) for labels, run in small.runs() if labels.study == "slopes")
    steep = run.isel(step=run["reduced_pressure"].values > 5e-3)
    flat = small.run(rms_slope=0.2).isel(step=slice(0, steep.sizes["step"]))
    keep = {"snapshot": slice(0, 0), "spot": slice(0, 0)}
    tree = campaign_tree([(labels, steep.isel(keep)), (labels._replace(rms_slope=0.2), flat.isel(keep))])
    comparison = compare_campaign(tree)
    assert comparison["slopes"].sizes["relative_load"] == 0
    write_dataset(comparison, tmp_path / "c.nc")
    assert read_campaign(tmp_path / "c.nc")["slopes"].sizes["relative_load"] == 0
