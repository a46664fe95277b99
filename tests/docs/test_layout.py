"""The layout page agrees with the code, and folders import only in its order."""

import importlib.util
import re
import tomllib

from conftest import REPOSITORY

PAGE = (REPOSITORY / "docs/layout.md").read_text(encoding="utf-8")
CONTRACTS = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
    "contracts"
]
LAYERS = [{name.strip() for name in layer.split("|")} for layer in CONTRACTS[0]["layers"]]


def test_every_folder_has_its_line_in_the_order_of_the_imports():
    table = re.findall(r"^\| `(icha/\w+(?:\.py)?)` \|", PAGE, re.MULTILINE)
    named = [name.removesuffix(".py").replace("/", ".") for name in table]
    folders = {f"icha.{path.parent.name}" for path in REPOSITORY.glob("icha/*/__init__.py")}
    alone = {f"icha.{path.stem}" for path in REPOSITORY.glob("icha/*.py")} - {"icha.__init__"}
    assert set(named) == folders | alone == set.union(*LAYERS) and len(named) == len(set(named))
    level = [next(n for n, layer in enumerate(reversed(LAYERS)) if name in layer) for name in named]
    assert level == sorted(level)


def test_all_names_on_the_page_exist():
    code = re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```$", "", PAGE, flags=re.DOTALL | re.MULTILINE))
    files = {each for each in code if "<" not in each and re.fullmatch(r"[.\w]+(/[\w.]+)+|\w+\.toml", each)}
    assert len(files) > 30
    assert not [file for file in files if not (REPOSITORY / file).exists()]
    for name in (each for each in code if each.startswith("icha.")):
        module, _, last = name.rpartition(".")
        try:
            importlib.import_module(name)
        except ModuleNotFoundError:
            assert hasattr(importlib.import_module(module), last), name


def test_modules_on_the_page_on_the_model_exist():
    page = (REPOSITORY / "docs/model.md").read_text(encoding="utf-8")
    named = re.findall(r"`([\w.]+)`", " ".join(re.findall(r" \[(`[^\]]+`)\]", page)))
    assert len(named) > 25
    assert not [name for name in named if importlib.util.find_spec(f"icha.{name}") is None]
