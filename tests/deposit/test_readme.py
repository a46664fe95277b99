"""The page of a deposit: texts are shown as they are written, and facts are those of a campaign in memory."""

import itertools
import re
from dataclasses import replace

import own_slopes_campaign as crops
import pytest
import small_campaign as small
import xarray as xr
from conftest import REPOSITORY
from markdown_it import MarkdownIt
from mdit_py_plugins.dollarmath import dollarmath_plugin
from publications import COMMIT, LEAST

from icha.analysis.checks import check_campaign
from icha.configuration.load import load_configuration
from icha.configuration.publication import Author, Funding, KnownFailure
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import write_dataset
from icha.deposit.readme import markdown, readme
from icha.planning.costs import Cost

# Texts with a meaning in Markdown, HTML or a table.
ODD = (
    "<load>|*x*|**x**|_x_|__a b__|a_b_c _d e_|`code`|[text](address)|![image]|~~gone~~|\\|\\*x\\*|&lt;|&#60;|R&D &c|"
    "<!-- not here -->|<b>bold</b>|# one #|> two|- three|+ four|5. five|6) six|1.5 mm|-7 °C|---|===|***|```|~~~|[a]: b|"
    "$\\alpha_0^2$|小_明_|https://example.org/~me/a_b_?c=1&d=*2*_e_.|trailing\\|* list|^ _ ^".split("|")
)
ODD += ["a | b", "\\|", "a ||| b |", "see (https://example.org/a|b)."]

# The Markdown of GitHub with its formulas; links need brackets.
MARKDOWN = MarkdownIt("gfm-like", {"linkify": False}).use(dollarmath_plugin)


def shown(text, kind="paragraph"):
    """The visible texts of all paragraphs, headings or cells of a page."""
    tokens = MARKDOWN.parse(text)
    texts = []
    for opened, inline in itertools.pairwise(tokens):
        if opened.type == f"{kind}_open":
            plain = {"text", "text_special", "link_open", "link_close", "code_inline"}
            assert {child.type for child in inline.children} <= plain
            texts.append("".join(child.content for child in inline.children))
    return texts


def test_texts_are_shown_as_they_are_written_wherever_they_stand():
    for odd in ODD:
        escaped = markdown(odd)
        assert shown(f"Before.\n\n{escaped}\n\nAfter.\n") == ["Before.", odd, "After."]
        assert shown(f"# {escaped}\n", "heading") == [odd]
        assert shown(f"> {escaped}\n") == [odd]
        assert shown(f"a {escaped} {escaped} z\n") == [f"a {odd} {odd} z"]
        assert shown(f"| a | b |\n|---|---|\n| {escaped} | {escaped} |\n", "td") == [odd, odd]


def test_links_lead_to_the_address():
    for odd in ("https://example.org/~me/a_b_?c=1&d=*2*.", "see (https://example.org/~me/a_b_?c=1&d=*2*)!"):
        tokens = MARKDOWN.parse(markdown(odd))[1].children
        (link,) = (token.attrs["href"] for token in tokens if token.type == "link_open")
        assert link == "https://example.org/~me/a_b_?c=1&d=*2"


def page_of(tree, checks, campaign):
    """The page of a campaign dataset, with files of given sizes."""
    return readme(
        campaign,
        revision=COMMIT,
        dataset=tree,
        checks=checks,
        sizes={"dataset/smoke.nc": 2_000_000, "report.html": 340_000, "source/icha/asperity/jkr.py": 10**9},
        cost=Cost(60.0, 2e8, 7e6),
    )


@pytest.fixture(scope="module")
def small_readme():
    """A function that writes the page of the small campaign in `small_campaign`, with one of its runs failed."""
    reason = "it is stuck | at <A/A0> = *1*"
    failed = small.runs()[0][0]
    runs = [(labels, run.assign_attrs(incomplete=reason) if labels == failed else run) for labels, run in small.runs()]
    tree = small.campaign_tree(runs, attrs={"campaign": "small"})
    checks = [replace(check, value=-check.value) for check in check_campaign(tree)]

    def written(publication, checks=checks):
        campaign = load_configuration(REPOSITORY / "config/campaigns/smoke.yaml").campaign
        return page_of(tree, checks, campaign.model_copy(update={"publication": publication}))

    written.failed, written.reason, written.steps = str(failed), reason, small.runs()[0][1].sizes["step"]
    return written


def test_the_page_shows_whatever_texts_a_publication_has(small_readme):
    title, other = "Two <loads> | *one* `law`: $E^*$ _x_ [1]", "R&D &lt; `q` | _K_ *"
    publication = LEAST.model_copy(
        update={
            "title": title,
            "summary": f"{other}\n{other}\n  \n- no list\n\n1. {title}\n",
            "authors": [Author(family_names=other, given_names="*Jo*", affiliation=f"<{other}>"), Author(name=title)],
            "funding": [Funding(funder=other, award_title=title)],
            "known_failures": [KnownFailure(run=small_readme.failed, reason=other)],
        }
    )
    page = small_readme(publication)
    assert shown(page, "heading")[0] == title
    tokens = [token for token in MARKDOWN.parse(page) if token.type in ("inline", "html_block")]
    texts = ["".join(child.content for child in token.children or ()) for token in tokens]
    assert not any(token.type == "html_block" for token in tokens)
    assert texts[1:4] == [f"{other} {other}", "- no list", f"1. {title}"]
    assert f"Funded by {other} ({title})." in texts
    (citation,) = (text for text in texts if text.startswith(other + ", *Jo*; "))
    assert title in citation
    for cell in (f"*Jo* {other}", f"<{other}>", small_readme.failed, small_readme.reason, other):
        assert cell in texts, cell


def test_the_page_lists_failures_that_a_rerun_repeats(small_readme):
    known = [KnownFailure(run=small_readme.failed, reason="It | shows it.")]
    page = small_readme(LEAST.model_copy(update={"known_failures": known}))
    cells = shown(page, "td")
    at = cells.index(small_readme.failed)
    assert cells[at : at + 4] == [small_readme.failed, str(small_readme.steps), small_readme.reason, "It | shows it."]
    assert "One run did not reach the end of its path" in page and "all runs are complete" not in page
    assert "The check `completed` fails for the run that is listed under *Design*" in page
    assert "Runs that failed here fail again" in page
    assert "The computation needs 2.34 MB of\ndisk, 200 MB of memory" in page


def test_the_example_selects_a_run_of_surfaces_with_slopes_of_their_own(tmp_path, monkeypatch):
    runs = [(labels, run) for labels, run in crops.runs().items() if labels.model == "asperities"]
    tree = small.campaign_tree(runs, attrs={"campaign": "crops"})
    page = page_of(tree, check_campaign(tree), load_configuration(REPOSITORY / "config/campaigns/smoke.yaml").campaign)
    write_dataset(campaign_tree(runs), tmp_path / "dataset/smoke.nc")
    monkeypatch.chdir(tmp_path)
    example = re.search(r"^study = .*\nruns = .*\nruns = .*$", page, re.MULTILINE)[0]
    namespace = {"xr": xr}
    exec(example, namespace)
    assert namespace["runs"].sizes["material"] == 2 and float(namespace["runs"]["rms_slope"]) == 0.5
    assert "| crops | asperities | crop1, crop2, crop3 | 1 | 0.21, 0.34, 0.5 |" in page
