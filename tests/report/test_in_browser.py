"""Report and page for exploring in headless Chromium, used with real keys; they need no network."""

import io
import json
import re

import numpy as np
import pytest
import small_campaign as small
from chromium import WANTED, chromium
from explorer_results import write_results
from PIL import Image

from icha.analysis.checks import check_campaign
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.surface_file import write_surface
from icha.figures import fig2_area_and_gap
from icha.figures.style import save
from icha.report.explorer import write_explorer
from icha.report.report import write_report
from icha.report.spectra import read_surface_statistics

pytestmark = WANTED


@pytest.fixture(scope="module")
def explorer_file(tmp_path_factory):
    folder = write_results(tmp_path_factory.mktemp("results"))
    write_explorer(folder, folder / "explore.html", largest=20)
    return folder / "explore.html"


@pytest.fixture(scope="module")
def report_file(tmp_path_factory):
    """A report with a figure and a failed run, in a folder as results have it."""
    folder = tmp_path_factory.mktemp("report")
    runs = list(small.runs())
    runs[1] = (runs[1][0], runs[1][1].assign_attrs(incomplete="no equilibrium at the second stop"))
    tree = campaign_tree(runs, attrs={"title": "Small campaign", "license": "CC0-1.0"})
    write_surface(folder / "s.nc", small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
    files = [folder / f"figures/fig2_area_and_gap.{ending}" for ending in ("png", "pdf", "txt")]
    save(fig2_area_and_gap.figure(tree, study="slopes"), *files[:2])
    files[2].write_text("Caption.\n")
    write_report(
        folder / "report.html",
        campaign=tree,
        figures=files,
        checks=check_campaign(tree),
        surfaces=[read_surface_statistics(folder / "s.nc")],
        files={"Campaign dataset": folder / "dataset" / "small.nc"},
        results=folder,
    )
    return folder / "report.html"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("profile")) as page:
        yield page


def opened(browser, file):
    """Open a page; after the test there must be no error on its console and no request."""
    browser.console.clear(), browser.addresses.clear()
    browser.show(1300)
    browser.open(file)
    yield browser
    assert browser.console == []
    assert {address for address in browser.addresses if not address.startswith(("file:", "data:"))} == set()


@pytest.fixture
def page(browser, explorer_file):
    yield from opened(browser, explorer_file)


@pytest.fixture
def report(browser, report_file):
    yield from opened(browser, report_file)


# --- the page for exploring -------------------------------------------------------------------------------------


def choose(page, **choices):
    """Choose from the lists of the page."""
    for name, value in choices.items():
        page.value(
            f"{{ const list = document.getElementById('{name}'); list.value = {json.dumps(str(value))};"
            "list.dispatchEvent(new Event('change')); }"
        )
        page.settle()


def shown(page):
    """Return what the page shows: step, text, table, and for each model picture, opacity, point and curve."""
    return page.value(
        """(() => {
          const at = (id) => document.getElementById(id);
          const models = Object.keys(runs);
          return {
            place: Number(at("stop").value), last: Number(at("stop").max), state: at("state").textContent,
            table: [...document.querySelectorAll("#values tbody tr")]
              .map((row) => [...row.cells].map((cell) => cell.textContent)),
            notices: [...document.querySelectorAll("#notices p")].map((each) => each.textContent),
            images: models.map((model) => (at(`map-${model}`).layout.images || [])
              .map((each) => [each.source, each.opacity])[0] || null),
            points: ["area", "separation"]
              .map((id) => at(id).data.slice(models.length).map((each) => [each.x[0], each.y[0]])),
            curves: ["gap_density", "pressure_density", "sizes", "larger"]
              .map((id) => at(id).data.map((each) => [Array.from(each.y), each.opacity])),
          };
        })()"""
    )


def test_the_slider_moves_contact_points_and_distributions_of_both_models(page):
    choose(page, study="one", material="soft", model="both")
    page.value("document.getElementById('stop').focus()")
    page.press("End")
    last = shown(page)
    page.press("ArrowLeft")
    first = shown(page)
    assert (last["place"], first["place"], last["last"]) == (1, 0, 1)
    assert last["state"] == "2 of 2: loading, p* = 0.01" and first["state"] == "1 of 2: loading, p* = 0.003"
    assert [row[:2] for row in first["table"]] == [["asperities", "0.003"], ["boundary elements", "0.003"]]
    kinds = [re.match(r"data:image/([a-z+]+)", source)[1] for source, _ in first["images"]]
    assert kinds == ["svg+xml", "png"] and first["notices"] == []
    for k in range(2):
        assert first["images"][k][0] != last["images"][k][0] and first["images"][k][1] == last["images"][k][1] == 1
        assert all(before[k] != after[k] for before, after in zip(first["points"], last["points"], strict=True))
        assert all(before[k][0] != after[k][0] for before, after in zip(first["curves"], last["curves"], strict=True))
    area, separation = last["points"]
    assert area[0][0] == area[1][0] == pytest.approx(0.01) and area[0][1] > first["points"][0][0][1]
    assert separation[0][1] < first["points"][1][0][1]


def test_steps_without_snapshot_have_a_notice(page):
    choose(page, study="slopes", rms_slope=1, material="soft")
    page.value("document.getElementById('stop').focus()")
    page.press("Home")
    start = shown(page)
    assert start["images"] == [None] and start["curves"] == [[], [], [], []]
    assert start["points"][0][0] != [None, None] and "no snapshot up to this step" in start["notices"][0]
    page.press("ArrowRight")
    on_it = shown(page)
    assert on_it["notices"] == [] and on_it["images"][0][1] == 1 and on_it["table"][0][-1] == "yes"
    page.press("End")
    later = shown(page)
    assert "pale spots and distributions belong to the previous snapshot" in later["notices"][0]
    assert later["table"][0][-1] == "no"
    assert later["images"][0][1] < 1 and {curve[0][1] for curve in later["curves"]} == {0.3}
    assert later["points"] != on_it["points"]


def test_all_controls_can_be_used_with_keys(page):
    choose(page, study="one", material="soft")
    page.value("document.activeElement.blur(); scrollTo(0, 0)")
    order, outlines = [], []
    for _ in range(40):
        page.press("Tab")
        name, outline = page.value(
            "[document.activeElement.id, getComputedStyle(document.activeElement).outlineStyle"
            " + parseFloat(getComputedStyle(document.activeElement).outlineWidth)]"
        )
        if not name:
            break
        order.append(name), outlines.append(outline)
    # From top to bottom, without lists of one entry.
    assert order == ["study", "material", "seed", "model", "log", "before", "stop"], order
    assert set(outlines) == {"solid3"}
    # The buttons move between snapshots.
    choose(page, study="one", material="soft")
    page.value("document.getElementById('before').focus()")
    page.press("Enter")
    assert shown(page)["place"] == 0
    spoken = page.value("document.getElementById('stop').getAttribute('aria-valuetext')")
    assert spoken == "1 of 2, loading, p* = 0.003"
    assert page.value("document.getElementById('state').getAttribute('role')") == "status"


def test_spots_have_the_positions_of_the_dataset(page):
    """Centres of circles are red, and the red fraction of the map is that of the spots."""
    choose(page, study="one", material="soft", model="asperities")
    circles = page.value(
        "(() => { const kept = leading.snapshots.at(-1).circles.map((text) => Array.from(floats(text)));"
        "return kept[0].map((x, k) => [x, kept[1][k], kept[2][k]]); })()"
    )
    period = page.value("leading.period")
    place = page.value(
        "(() => { const map = document.getElementById('map-asperities'), {xaxis, yaxis} = map._fullLayout;"
        "const box = map.getBoundingClientRect();"
        "return [xaxis, yaxis].map((axis) => [axis._offset, axis._length, ...axis.range])"
        ".concat([[box.x + scrollX, box.y + scrollY]]); })()"
    )
    pixels = np.asarray(Image.open(io.BytesIO(page.picture())).convert("RGB")).astype(int)
    (left, width, x_low, x_high), (top, height, y_low, y_high), (box_x, box_y) = place
    assert x_high - x_low == pytest.approx(period * 1e6)
    for x, y, radius in circles:
        column = box_x + left + width * (x * 1e6 - x_low) / (x_high - x_low)
        row = box_y + top + height * (y_high - y * 1e6) / (y_high - y_low)
        inside = left + 3 < column - box_x < left + width - 3 and top + 3 < row - box_y < top + height - 3
        if inside and radius / period * width > 2:
            red, green, blue = pixels[round(row), round(column)]
            assert red > 150 and green < 90 and blue < 90, (x, y)
    inner = pixels[round(box_y + top) + 2 : round(box_y + top + height) - 2, round(box_x + left) + 2 :]
    inner = inner[:, : round(width) - 4]
    red_fraction = (inner[..., 0] > inner[..., 1] + 60).mean()
    assert red_fraction == pytest.approx(sum(np.pi * radius**2 for *_, radius in circles) / period**2, rel=0.25)


def brightness(colour):
    return sum(map(int, re.findall(r"\d+", colour)[:3])) / 3


@pytest.mark.parametrize("width", [320, 700])
def test_nothing_is_wider_than_the_window(page, width):
    page.show(width, 800)
    choose(page, study="one", material="soft")
    assert page.value("[document.documentElement.scrollWidth, innerWidth]") == [width, width]
    # The slider remains visible, and leaves room for the pictures.
    page.value("scrollTo(0, 1500)")
    page.settle()
    top, bottom = page.value(
        "(({top, bottom}) => [top, bottom])(document.getElementById('path').getBoundingClientRect())"
    )
    assert top == 0 and bottom < 250


def test_errors_and_requests_are_detected(browser, explorer_file, tmp_path):
    text = re.sub("<meta http-equiv.*?>", "", explorer_file.read_text(encoding="utf-8"))
    wrong = '<img src="http://localhost:9/x.png"><script>nothing.at.all;</script></body>'
    (tmp_path / "wrong.html").write_text(text.replace("</body>", wrong), encoding="utf-8")
    browser.console.clear(), browser.addresses.clear()
    browser.open(tmp_path / "wrong.html")
    assert "http://localhost:9/x.png" in browser.addresses
    assert any("nothing is not defined" in line for line in browser.console)


# --- the report -------------------------------------------------------------------------------------------------


def test_the_report_is_readable_on_a_telephone_in_the_dark_and_on_paper(report):
    colours = "[getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color]"
    contrasts = []
    for scheme, medium in (("light", ""), ("dark", ""), ("dark", "print")):
        report.show(700 if medium else 400, scheme=scheme, medium=medium)
        assert report.value("document.documentElement.scrollWidth <= innerWidth")
        assert report.value("[...document.images].every((image) => image.complete && image.width > 300)")
        paper, ink = map(brightness, report.value(colours))
        contrasts.append(paper - ink)
    light, dark, printed = contrasts
    assert light > 150 and dark < -150 and printed > 150
    assert report.value("getComputedStyle(document.querySelector('nav')).display") == "none"
