"""The page on trust names existing tests, and the limits of the code."""

import re

from conftest import REPOSITORY
from typer.main import get_command

from icha.cli import app
from icha.deposit.verify import ALLOWANCE, LARGEST_TEXT, MOST_GROWTH

PAGE = (REPOSITORY / "docs/threat_model.md").read_text(encoding="utf-8")


def test_every_named_test_exists():
    existing = {path.name for path in (REPOSITORY / "tests").rglob("test_*.py")}
    assert set(re.findall(r"test_\w+\.py", PAGE)) <= existing


def test_every_command_that_reads_files_is_listed():
    table = PAGE.partition("| command |")[2].partition("\n\n")[0]
    for name in get_command(app).commands:
        assert f"`{name}`" in table or f"`icha {name}`" in table, name


def test_limits_are_those_of_the_code():
    assert f"more than the sum of {MOST_GROWTH} times its size and {ALLOWANCE // 10**6} MB" in PAGE
    assert f"have at most {LARGEST_TEXT // 10**6} MB" in PAGE
