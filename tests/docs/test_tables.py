"""Tables of the pages: each is included once, and is written from the saved measurements if there are any."""

import re

import pytest

from benchmarks import tables as benchmarks
from validation import applicability, indenter, jkr_test, loop_grid, short_range
from validation.tables import DOCS


def test_every_table_is_included_by_one_page():
    pages = "".join(page.read_text(encoding="utf-8") for page in DOCS.glob("*.md"))
    included = re.findall(r"^```\{include\} tables/(\w+)\.md\n```$", pages, flags=re.MULTILINE)
    assert sorted(included) == sorted(file.stem for file in (DOCS / "tables").iterdir())


@pytest.mark.parametrize(
    "tables",
    [
        lambda: benchmarks.tables(benchmarks.read_results()),
        lambda: short_range.tables(short_range.read_measurements()),
        lambda: indenter.tables(indenter.read_measurements()),
        lambda: loop_grid.tables(loop_grid.read_measurements()),
        lambda: jkr_test.tables(jkr_test.read_measurements()),
        lambda: applicability.tables(applicability.read_measurements()),
    ],
    ids=["benchmarks", "short_range", "indenter", "loop_grid", "jkr_test", "applicability"],
)
def test_tables_agree_with_the_saved_measurements(tables):
    for name, table in tables().items():
        assert (DOCS / "tables" / f"{name}.md").read_text(encoding="utf-8") == str(table), name
