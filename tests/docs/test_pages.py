"""Pages agree with the code: layout, names of modules and tests, limits, and tables."""

import importlib.util
import re
import tomllib

import pytest
from conftest import REPOSITORY
from typer.main import get_command

from benchmarks import tables as benchmarks
from icha.cli import app
from icha.deposit.verify import ALLOWANCE, LARGEST_TEXT, MOST_GROWTH
from validation import applicability, indenter, jkr_test, loop_grid, short_range
from validation.tables import DOCS

LAYOUT, THREATS, MODEL = (
    (DOCS / f"{name}.md").read_text(encoding="utf-8") for name in ("layout", "threat_model", "model")
)
CONTRACTS = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
    "contracts"
]
LAYERS = [{name.strip() for name in layer.split("|")} for layer in CONTRACTS[0]["layers"]]


def test_every_folder_has_its_line_in_the_order_of_the_imports():
    table = re.findall(r"^\| `(icha/\w+(?:\.py)?)` \|", LAYOUT, re.MULTILINE)
    named = [name.removesuffix(".py").replace("/", ".") for name in table]
    folders = {f"icha.{path.parent.name}" for path in REPOSITORY.glob("icha/*/__init__.py")}
    alone = {f"icha.{path.stem}" for path in REPOSITORY.glob("icha/*.py")} - {"icha.__init__"}
    assert set(named) == folders | alone == set.union(*LAYERS) and len(named) == len(set(named))
    level = [next(n for n, layer in enumerate(reversed(LAYERS)) if name in layer) for name in named]
    assert level == sorted(level)


def test_all_names_on_the_pages_on_layout_and_model_exist():
    code = re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```$", "", LAYOUT, flags=re.DOTALL | re.MULTILINE))
    files = {each for each in code if "<" not in each and re.fullmatch(r"[.\w]+(/[\w.]+)+|\w+\.toml", each)}
    assert len(files) > 30
    assert not [file for file in files if not (REPOSITORY / file).exists()]
    for name in (each for each in code if each.startswith("icha.")):
        module, _, last = name.rpartition(".")
        try:
            importlib.import_module(name)
        except ModuleNotFoundError:
            assert hasattr(importlib.import_module(module), last), name
    named = re.findall(r"`([\w.]+)`", " ".join(re.findall(r" \[(`[^\]]+`)\]", MODEL)))
    assert len(named) > 25
    assert not [name for name in named if importlib.util.find_spec(f"icha.{name}") is None]


def test_the_page_on_trust_names_tests_commands_and_limits():
    existing = {path.name for path in (REPOSITORY / "tests").rglob("test_*.py")}
    assert set(re.findall(r"test_\w+\.py", THREATS)) <= existing
    table = THREATS.partition("| command |")[2].partition("\n\n")[0]
    for name in get_command(app).commands:
        assert f"`{name}`" in table or f"`icha {name}`" in table, name
    assert f"more than the sum of {MOST_GROWTH} times its size and {ALLOWANCE // 10**6} MB" in THREATS
    assert f"have at most {LARGEST_TEXT // 10**6} MB" in THREATS


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
