"""Figures of the user's own: what a script draws, and scripts that cannot draw."""

import sys

import pytest
import small_campaign as small

from icha.configuration.figures import OwnFigure
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import write_dataset
from icha.datasets.results import FIGURE_ENDINGS
from icha.figures.registry import draw_figure
from icha.support.scripts import modules_of

AREAS = '''
import matplotlib.pyplot as plt

def draw(study):
    """Contact area
    against load."""
    figure, axes = plt.subplots()
    for seed in study["seed"].values:
        run = study.sel(seed=seed).squeeze()
        axes.plot(run["reduced_pressure"], run["contact_area_fraction"], label=f"seed {seed}")
    return figure
'''


@pytest.fixture
def draw(tmp_path, monkeypatch):
    """A function that draws the study `single` of the small campaign with a script."""
    write_dataset(campaign_tree(small.runs(), attrs={"title": "Small", "summary": "Small."}), tmp_path / "small.nc")
    files = [tmp_path / f"mine.{ending}" for ending in FIGURE_ENDINGS]
    monkeypatch.setattr(sys, "path", sys.path[:])
    monkeypatch.setattr(sys, "dont_write_bytecode", sys.dont_write_bytecode)

    def drawn(text):
        script = tmp_path / "mine.py"
        script.write_text(text)
        inputs = {"campaign": str(tmp_path / "small.nc"), "script": str(script)}
        draw_figure("mine", *files, inputs=inputs, arguments={"study": "single"}, studies=["single"])
        return files

    return drawn


def test_a_script_draws_a_figure_with_its_docstring_as_caption(draw, tmp_path):
    png, pdf, caption, table = draw(AREAS)
    assert len(table.read_text().splitlines()) > 2
    assert caption.read_text() == "Contact area against load.\n"
    first = png.read_bytes(), pdf.read_bytes()
    draw(AREAS)
    assert (png.read_bytes(), pdf.read_bytes()) == first, "the same bytes"
    assert not list(tmp_path.glob("__pycache__"))


def test_a_script_imports_modules_beside_it(draw, tmp_path):
    (tmp_path / "plots").mkdir()
    imported = {
        "labels.py": "from plots.units import AREA\n",
        "plots/__init__.py": "",
        "plots/more.py": "import numpy\n",
        "plots/units.py": "from . import more\nAREA = 'area'\n",
    }
    for name, content in (imported | {"unused.py": "not Python"}).items():
        (tmp_path / name).write_text(content)
    text = AREAS.replace("    return figure", "    import labels\n    axes.set_ylabel(labels.AREA)\n    return figure")
    draw(text)
    assert modules_of(tmp_path / "mine.py") == [tmp_path / name for name in imported]
    assert not list(tmp_path.rglob("__pycache__"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (AREAS.replace('"reduced_pressure"', '"load"'), r"mine.py, line 10: KeyError: .*load"),
        (AREAS.replace("return figure", "return axes"), "mine.py: draw returned Axes; expected a figure of matplotlib"),
        ("import nothing_of_this_name\n" + AREAS, "mine.py, line 1: ModuleNotFoundError"),
    ],
)
def test_errors_of_a_script_name_its_line(draw, text, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        draw(text)
    assert not (tmp_path / "mine.txt").exists()


ENTRY = {"study": "one", "script": "mine.py"}


@pytest.mark.parametrize(
    ("text", "name", "entry", "message"),
    [
        (None, "mine", ENTRY, "figures.mine.script: .* no such file; expected a Python file"),
        ("def draw(study:\n", "mine", ENTRY, "figures.mine.script: .* is not a Python file: "),
        ("pass\n", "mine", ENTRY, "figures.mine.script: .* has no function `draw`; expected `def draw.study.:`"),
        (AREAS, "fig99_mine", ENTRY, "begins like the name of a figure of ICHA"),
        (AREAS, "My figure", ENTRY, "is not a valid name"),
        (
            AREAS,
            "fig2_area",
            {"study": "one"},
            "unknown key .did you mean 'fig2_area_and_gap'.*figure of your own",
        ),
        (AREAS, "mine", ENTRY | {"study": "two"}, "'two' is not defined"),
    ],
)
def test_own_figures_are_refused_before_anything_is_computed(load, text, name, entry, message, tmp_path):
    if text is not None:
        (tmp_path / "mine.py").write_text(text)
    with pytest.raises(ValueError, match=message):
        load({"figures": {name: entry}})


def test_own_figures_stand_beside_others(load, tmp_path):
    (tmp_path / "mine.py").write_text(AREAS)
    figures = load({"figures": {"mine": ENTRY, "fig1_jkr": {}}}).campaign.figures.by_name()
    assert list(figures) == ["fig1_jkr", "mine"] and isinstance(figures["mine"], OwnFigure)
