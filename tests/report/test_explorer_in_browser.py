"""The page for exploring in headless Chromium: real keys move what they should; it asks for nothing from outside."""

import io
import json
import re

import numpy as np
import pytest
from chromium import WANTED, chromium
from explorer_results import write_results
from PIL import Image

from icha.report.explorer import write_explorer

pytestmark = WANTED


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    folder = write_results(tmp_path_factory.mktemp("results"))
    write_explorer(folder, folder / "explore.html", largest=20)
    return folder / "explore.html"


@pytest.fixture(scope="module")
def browser(file, tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("profile")) as page:
        yield page


@pytest.fixture
def page(browser, file):
    """The page, newly opened; nothing that a test does may lead to an error or to a request."""
    browser.console.clear(), browser.addresses.clear()
    browser.show(1300)
    browser.open(file)
    yield browser
    assert browser.console == []
    assert {address for address in browser.addresses if not address.startswith(("file:", "data:"))} == set()


def choose(page, **choices):
    """Choose from the lists as a reader does."""
    for name, value in choices.items():
        page.value(
            f"{{ const list = document.getElementById('{name}'); list.value = {json.dumps(str(value))};"
            "list.dispatchEvent(new Event('change')); }"
        )
        page.settle()


def shown(page):
    """What the page shows: the place, its words, the table, and by model picture, its opacity, point and curve."""
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


def test_where_there_is_no_snapshot_the_page_says_so(page):
    choose(page, study="slopes", rms_slope=1, material="soft")
    page.value("document.getElementById('stop').focus()")
    page.press("Home")
    start = shown(page)
    assert start["images"] == [None] and start["curves"] == [[], [], [], []]
    assert start["points"][0][0] != [None, None] and "no snapshot up to here" in start["notices"][0]
    page.press("ArrowRight")
    on_it = shown(page)
    assert on_it["notices"] == [] and on_it["images"][0][1] == 1 and on_it["table"][0][-1] == "yes"
    page.press("End")
    later = shown(page)
    assert "pale, are those of the last one before" in later["notices"][0] and later["table"][0][-1] == "no"
    assert later["images"][0][1] < 1 and {curve[0][1] for curve in later["curves"]} == {0.3}
    assert later["points"] != on_it["points"]


def test_failures_and_ways_back_are_told(page):
    choose(page, study="slopes", rms_slope=0.2)
    assert any("the run failed; the path ends early, at A/A0 < 1 &" in each for each in shown(page)["notices"])
    choose(page, study="loops")
    page.value("document.getElementById('stop').focus()")
    page.press("End")
    assert "unloading" in shown(page)["state"]
    # Loads are negative on the way: such axes are not logarithmic.
    assert page.value("document.getElementById('log').checked") is False


def test_everything_is_reached_and_used_by_keys(page):
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
    # From top to bottom; lists with one entry have nothing to choose.
    assert order == ["study", "material", "seed", "model", "log", "before", "stop"], order
    assert set(outlines) == {"solid3"}
    labels = page.value(
        "[...document.querySelectorAll('select, input')].map((each) => each.labels[0].textContent.trim())"
    )
    assert len(labels) == 8 and all(labels)
    # The first list, by keys alone.
    page.value("document.getElementById('study').focus()")
    before = page.value("document.getElementById('study').value")
    page.press("ArrowUp")
    assert page.value("document.getElementById('study').value") != before
    # The buttons go from snapshot to snapshot.
    choose(page, study="one", material="soft")
    page.value("document.getElementById('before').focus()")
    page.press("Enter")
    assert shown(page)["place"] == 0
    spoken = page.value("document.getElementById('stop').getAttribute('aria-valuetext')")
    assert spoken == "1 of 2, loading, p* = 0.003"
    assert page.value("document.getElementById('state').getAttribute('role')") == "status"


def test_maps_are_enlarged_together(page):
    choose(page, study="one", material="soft", model="both")
    page.value("Plotly.relayout('map-asperities', {'xaxis.range': [10, 30], 'yaxis.range': [20, 40]}).then(() => 0)")
    page.settle()
    assert page.value("document.getElementById('map-boundary_elements').layout.xaxis.range") == [10, 30]
    # What is enlarged remains so while the slider moves.
    page.value("document.getElementById('stop').focus()")
    page.press("Home")
    assert page.value("document.getElementById('map-asperities').layout.xaxis.range") == [10, 30]


def test_spots_are_where_the_dataset_has_them(page):
    """Centres of circles are red, and as much of the map is red as spots cover."""
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
    part = (inner[..., 0] > inner[..., 1] + 60).mean()
    assert part == pytest.approx(sum(np.pi * radius**2 for *_, radius in circles) / period**2, rel=0.25)


def test_dark_and_light_follow_the_reader(page):
    def brightness():
        found = page.value(
            "[getComputedStyle(document.body).backgroundColor, document.getElementById('area').layout.font.color,"
            " document.getElementById('area').data[0].line.color]"
        )
        return [sum(map(int, re.findall(r"\d+", colour)[:3])) / 3 for colour in found]

    paper, ink, curve = brightness()
    page.show(1300, scheme="dark")
    dark_paper, dark_ink, dark_curve = brightness()
    assert paper > 200 > 80 > dark_paper and ink < 80 < 200 < dark_ink
    assert curve < paper - 80 and dark_curve > dark_paper + 80


@pytest.mark.parametrize("width", [320, 400, 700])
def test_nothing_is_wider_than_the_window(page, width):
    page.show(width, 800)
    choose(page, study="one", material="soft")
    assert page.value("[document.documentElement.scrollWidth, innerWidth]") == [width, width]
    # The slider stays in sight, and leaves room for what it moves.
    page.value("scrollTo(0, 1500)")
    page.settle()
    top, bottom = page.value(
        "(({top, bottom}) => [top, bottom])(document.getElementById('path').getBoundingClientRect())"
    )
    assert top == 0 and bottom < 250


def test_errors_and_requests_would_be_seen(browser, file, tmp_path):
    text = re.sub("<meta http-equiv.*?>", "", file.read_text(encoding="utf-8"))
    wrong = '<img src="http://localhost:9/x.png"><script>nothing.at.all;</script></body>'
    (tmp_path / "wrong.html").write_text(text.replace("</body>", wrong), encoding="utf-8")
    browser.console.clear(), browser.addresses.clear()
    browser.open(tmp_path / "wrong.html")
    assert "http://localhost:9/x.png" in browser.addresses
    assert any("nothing is not defined" in line for line in browser.console)
