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
from icha.figures import against_load
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
    save(against_load.area_and_gap(tree, study="slopes"), *files[:2])
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
            f"{{ byId('{name}').value = {json.dumps(str(value))}; byId('{name}').dispatchEvent(new Event('change')); }}"
        )
    page.value("byId('snapshot').focus()")
    page.settle()


def shown(page):
    """Return what the page shows: text, for each model the picture, and in each plot the lines and points."""
    return page.value(
        """({
          words: byId("words").textContent,
          maps: [...document.querySelectorAll("#maps svg")].map((map) => map.innerHTML),
          lines: [...document.querySelectorAll("#plots polyline")].map((line) => line.getAttribute("points")),
          points: [...document.querySelectorAll("#plots circle")]
            .map((point) => [point.cx.baseVal.value, point.cy.baseVal.value]),
        })"""
    )


def test_the_slider_moves_contact_points_and_distributions_of_both_models(page):
    choose(page, study="one", material="soft")
    last = shown(page)
    page.press("ArrowLeft")
    first = shown(page)
    page.press("End")
    assert shown(page) == last
    assert last["words"].startswith("Snapshot 2 of 2. asperities, loading: reduced pressure p* = 0.01, contact area")
    assert first["words"].startswith("Snapshot 1 of 2.") and "boundary elements, loading: reduced" in first["words"]
    assert [len(first[name]) for name in ("maps", "lines", "points")] == [2, 8, 4]
    assert all("NaN" not in text for name in ("maps", "lines") for text in first[name] + last[name])
    assert all(one != other for one, other in zip(first["maps"], last["maps"], strict=True))
    assert first["lines"][:4] == last["lines"][:4], "the curves stay"
    assert all(one != other for one, other in zip(first["lines"][4:], last["lines"][4:], strict=True))
    # The load grows to the right and the contact area upwards; the points are on the curves.
    assert last["points"][0][0] > first["points"][0][0] and last["points"][0][1] < first["points"][0][1]
    end = np.array(last["lines"][0].split(" ")[-1].split(","), float)
    np.testing.assert_allclose(last["points"][0], end, atol=0.01)


def test_spots_have_the_positions_of_the_dataset(page):
    """Centres of circles are red, and the red fraction of the map is that of the spots."""
    choose(page, study="one", material="soft")
    circles = page.value("contact.states.at(-1).asperities.circles")
    half = page.value("500 / contact.grid")
    left, top, side = page.value(
        "(({ x, y, width }) => [x + scrollX, y + scrollY, width])"
        "(document.querySelector('#maps svg').getBoundingClientRect())"
    )
    pixels = np.asarray(Image.open(io.BytesIO(page.picture())).convert("RGB")).astype(int)
    for x, y, radius in circles:
        column, row = left + side * (x + half) / 1000, top + side * (1000 - half - y) / 1000
        if left + 3 < column < left + side - 3 and top + 3 < row < top + side - 3 and radius * side > 2000:
            red, green, blue = pixels[round(row), round(column)]
            assert red > 150 and green < 90 and blue < 90, (x, y)
    inner = pixels[round(top) : round(top + side), round(left) : round(left + side)]
    red_fraction = (inner[..., 0] > inner[..., 1] + 60).mean()
    assert red_fraction == pytest.approx(sum(np.pi * radius**2 for *_, radius in circles) / 1e6, rel=0.25)


@pytest.mark.parametrize("width", [320, 700])
def test_nothing_is_wider_than_the_window(page, width):
    page.show(width, 800)
    choose(page, study="one", material="soft")
    assert page.value("[document.documentElement.scrollWidth, innerWidth]") == [width, width]
    page.value("scrollTo(0, 1500)")
    page.settle()
    assert page.value("document.querySelector('form').getBoundingClientRect().top") == 0


# --- the report -------------------------------------------------------------------------------------------------


def test_the_report_is_readable_on_a_telephone_in_the_dark_and_on_paper(report):
    colours = "[getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color]"
    contrasts = []
    for scheme, medium in (("light", ""), ("dark", ""), ("dark", "print")):
        report.show(700 if medium else 400, scheme=scheme, medium=medium)
        assert report.value("document.documentElement.scrollWidth <= innerWidth")
        assert report.value("[...document.images].every((image) => image.complete && image.width > 300)")
        paper, ink = (sum(map(int, re.findall(r"\d+", each)[:3])) / 3 for each in report.value(colours))
        contrasts.append(paper - ink)
    light, dark, printed = contrasts
    assert light > 150 and dark < -150 and printed > 150
    assert report.value("getComputedStyle(document.querySelector('nav')).display") == "none"
