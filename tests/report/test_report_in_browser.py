"""The report in headless Chromium: it asks for nothing from outside, complains of nothing, and can be used."""

import html
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest
import small_campaign as small
from chromium import CHROMIUM, OPTIONS, WANTED

from icha.analysis.checks import check_campaign
from icha.analysis.common_loads import compare_campaign
from icha.datasets.campaign import campaign_tree
from icha.datasets.surface_file import write_surface
from icha.figures import fig1_jkr, fig2_area_and_gap
from icha.figures.style import save
from icha.report.report import ReportFigure, write_report
from icha.report.run_times import Benchmark, write_times_page
from icha.report.sections import read_surface_statistics

pytestmark = WANTED


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A report with figures, a failed run and run times, in a folder as results have it."""
    folder = tmp_path_factory.mktemp("results")
    runs = list(small.runs())
    runs[1] = (runs[1][0], runs[1][1].assign_attrs(incomplete="no equilibrium at the second stop"))
    tree = campaign_tree(runs, attrs={"title": "Small campaign", "license": "CC0-1.0"})
    write_surface(folder / "s.nc", small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
    pictures = []
    for name, module, figure, studies in (
        ("fig1_jkr", fig1_jkr, fig1_jkr.figure(), ()),
        ("fig2_area_and_gap", fig2_area_and_gap, fig2_area_and_gap.figure(tree, study="slopes"), ("slopes",)),
    ):
        files = [folder / "figures" / f"{name}.{ending}" for ending in ("png", "pdf")]
        save(figure, *files)
        pictures.append(ReportFigure(name, module.DECLARATION.caption, *files, studies))
    write_times_page(folder / "benchmarks" / "index.html", [Benchmark("runs/one", 75.0, 120.0)])
    write_report(
        folder / "report.html",
        campaign=tree,
        figures=pictures,
        checks=check_campaign(tree),
        comparison=compare_campaign(tree),
        surfaces=[read_surface_statistics(folder / "s.nc")],
        dataset_path=folder / "dataset" / "small.nc",
        times_path=folder / "benchmarks" / "index.html",
        results=folder,
    )
    return folder


def browse(page, script="", *options):
    """What Chromium makes of a page on which, after it has been loaded, `script` (an async function) has run.

    Returns its document, what it wrote to its console, and the addresses that it asked for.
    """
    scratch = page.with_suffix(".d")
    scratch.mkdir()
    text = page.read_text(encoding="utf-8")
    if script:
        runs = f"<script>addEventListener('load', () => (async () => {{{script}}})());</script></body>"
        text = text.replace("</body>", runs)
    opened = page.with_name(f"{page.stem}.opened.html")
    opened.write_text(text, encoding="utf-8")
    command = [
        CHROMIUM,
        *OPTIONS,
        f"--user-data-dir={scratch / 'profile'}",
        "--enable-logging=stderr",
        "--virtual-time-budget=8000",
    ]
    command += [f"--log-net-log={scratch / 'net.json'}", "--window-size=1300,900", *options]
    done = subprocess.run(
        [*command, "--dump-dom", opened.as_uri()], capture_output=True, text=True, timeout=120, check=True
    )
    console = re.findall(r":CONSOLE[^\]]*\] (.*)", done.stderr)
    return done.stdout, console, _addresses(scratch / "net.json")


def _addresses(log):
    """Addresses that pages asked for, without what the browser asks for itself."""
    text = log.read_text(encoding="utf-8", errors="replace").rstrip()
    try:
        events = json.loads(text)["events"]
    except json.JSONDecodeError:
        # Chromium leaves the list unfinished where it is stopped.
        events = json.loads(text.rstrip(",") + "]}")["events"]
    requests = [event["params"] for event in events if {"initiator", "url"} <= set(event.get("params", {}))]
    return {request["url"] for request in requests if request["initiator"] != "not an origin"}


@pytest.fixture
def page(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "results")
    return tmp_path / "results" / "report.html"


def test_the_page_asks_for_nothing_from_outside_and_has_no_errors(page):
    document, console, addresses = browse(page)
    assert "Small campaign" in document
    assert console == []
    assert {address for address in addresses if not address.startswith(("file:", "data:"))} == set()


def test_a_request_and_an_error_would_be_seen(page):
    # The page's own policy would not let the request out.
    text = re.sub("<meta http-equiv.*?>", "", page.read_text(encoding="utf-8"))
    wrong = '<img src="http://localhost:9/x.png"><script>nothing.at.all;</script></body>'
    page.write_text(text.replace("</body>", wrong), encoding="utf-8")
    _, console, addresses = browse(page)
    assert "http://localhost:9/x.png" in addresses
    assert any("nothing is not defined" in line for line in console)


def note(expression):
    """A line of script that leaves a value in the document."""
    return f"document.body.dataset.seen = JSON.stringify({expression});"


def seen(document):
    return json.loads(html.unescape(re.search(r'data-seen="(.*?)"', document).group(1)))


def test_figures_are_enlarged_by_a_click_and_left_again(page):
    script = """
      const viewer = document.getElementById("viewer");
      const pause = () => new Promise((go) => setTimeout(go, 200));
      const image = () => viewer.querySelector("img");
      const at = () => figures.findIndex((figure) => figure.querySelector("img").src === image().src);
      const states = [viewer.open];
      const state = () => states.push([viewer.open, at(), image().getBoundingClientRect().width]);
      const key = (name) => viewer.dispatchEvent(new KeyboardEvent("keydown", {key: name}));
      document.querySelectorAll("figure button")[1].click(); await pause(); state();
      key("ArrowRight"); await pause(); state();
      viewer.querySelector(".previous").click(); await pause(); state();
      states.push(viewer.querySelector(".words").textContent.startsWith("Figure 2."));
      states.push(document.querySelector("figure img").getBoundingClientRect().width);
      image().click(); states.push(viewer.open);
    """ + note("states")
    document, console, _ = browse(page, script)
    closed, one, following, before, caption, small_width, at_last = seen(document)
    assert console == []
    assert closed is at_last is False and caption is True
    # After the last figure comes the first.
    assert [state[:2] for state in (one, following, before)] == [[True, 1], [True, 0], [True, 1]]
    assert one[2] > small_width


def test_every_link_of_the_contents_leads_to_its_heading(page):
    script = """
      document.documentElement.style.scrollBehavior = "auto";
      const found = [];
      for (const link of document.querySelectorAll("nav a")) {
        link.click();
        await new Promise((go) => setTimeout(go, 60));
        const place = document.getElementById(link.hash.slice(1)).getBoundingClientRect();
        const end = scrollY + innerHeight >= document.documentElement.scrollHeight - 2;
        found.push([link.hash, place.top >= -1 && place.top < (end ? innerHeight : 120),
                    document.querySelectorAll("nav a[aria-current]").length]);
      }
    """ + note("found")
    document, console, _ = browse(page, script)
    found = seen(document)
    assert console == []
    assert {"#failures", "#studies", "#study-slopes", "#surfaces", "#checks", "#times", "#data"} <= {
        at for at, *_ in found
    }
    assert all(there and current == 1 for _, there, current in found), found


def test_nothing_is_wider_than_a_telephone(page):
    measure = note("[document.documentElement.scrollWidth, innerWidth]")
    document, *_ = browse(page, measure, "--window-size=500,900")
    width, window = seen(document)
    assert width <= window


def test_dark_and_light_are_told_apart(page):
    colours = "[getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color]"
    script = f'const before = {colours}; document.getElementById("theme").click(); const after = {colours};'
    document, *_ = browse(page, script + note("[before, after]"))

    def brightness(colour):
        return sum(map(int, re.findall(r"\d+", colour)[:3])) / 3

    (paper, ink), (other_paper, other_ink) = ([brightness(each) for each in pair] for pair in seen(document))
    assert (paper - ink) * (other_paper - other_ink) < 0
    assert min(abs(paper - ink), abs(other_paper - other_ink)) > 150


@pytest.mark.parametrize("there", [True, False])
def test_run_times_are_shown_where_they_are(page, there):
    if not there:
        Path(page.parent, "benchmarks", "index.html").unlink()
    script = """
      const frame = document.querySelector("object.times");
      frame.scrollIntoView();
      await new Promise((go) => setTimeout(go, 500));
      const words = document.querySelector("object.times p").getBoundingClientRect().height;
    """ + note("words")
    document, *_ = browse(page, script)
    assert (seen(document) == 0) == there
