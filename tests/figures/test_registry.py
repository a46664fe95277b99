"""A figure is one module: nothing else knows its name, and only drawing imports libraries for drawing."""

import subprocess
import sys

import pytest
import small_campaign as small

from icha.datasets.files import write_dataset
from icha.figures.captions import caption_of
from icha.figures.registry import DECLARATIONS, figure_module, figure_number

MODULE = """
from icha.figures.declaration import Declaration, StudyFigure
from icha.figures.select import select_runs
from icha.figures.style import in_style, new_figure

DECLARATION = Declaration(
    description="Contact area against load, and nothing else.",
    options=StudyFigure,
)


@in_style
def figure(campaign, *, study):
    drawing = new_figure(3, 2)
    axes = drawing.subplots()
    for _, run in select_runs(campaign, study, ragged=False):
        axes.plot(run["reduced_pressure"], run["contact_area_fraction"])
    return drawing
"""

SCRIPT = """
import sys
import icha.figures
icha.figures.__path__.append(sys.argv[1])
from icha.configuration.figures import Figures
from icha.configuration.schema import json_schema, key_tables
from icha.datasets.results import ResultFiles
from icha.figures.registry import DECLARATIONS, draw_figure
figures = Figures.model_validate({"fig99_trivial": {"study": "slopes"}})
assert list(figures.by_name()) == ["fig99_trivial"]
assert "and nothing else" in json_schema() and "`figures.fig99_trivial`" in key_tables()
inputs = DECLARATIONS["fig99_trivial"].inputs(None, figures.fig99_trivial, ResultFiles("small", sys.argv[1]))
arguments = figures.fig99_trivial.arguments(None)
draw_figure("fig99_trivial", "a.png", "a.pdf", inputs=inputs, arguments=arguments)
"""

LIGHT = """
import sys
import icha.configuration.load
heavy = [name for name in ("matplotlib", "xarray", "netCDF4") if name in sys.modules]
assert not heavy, heavy
"""


def python(script, *arguments, cwd):
    subprocess.run([sys.executable, "-c", script, *map(str, arguments)], cwd=cwd, check=True)


@pytest.mark.slow
def test_a_module_on_the_path_is_a_figure(tmp_path):
    (tmp_path / "fig99_trivial.py").write_text(MODULE)
    (tmp_path / "dataset").mkdir()
    write_dataset(small.tree(), tmp_path / "dataset" / "small.nc")
    python(SCRIPT, tmp_path, cwd=tmp_path)
    assert (tmp_path / "a.png").stat().st_size > 1000 and (tmp_path / "a.pdf").stat().st_size > 1000


def test_reading_a_configuration_does_not_wait_for_libraries_that_draw(tmp_path):
    python(LIGHT, cwd=tmp_path)


def test_figures_are_in_the_order_of_their_numbers_and_captions_are_sentences():
    numbers = [figure_number(name) for name in DECLARATIONS]
    assert numbers == sorted(set(numbers)) and len(numbers) == 15
    for name in DECLARATIONS:
        assert callable(figure_module(name).figure)
        caption = caption_of(name)
        assert len(caption) > 100 and caption.endswith(".") and "{" not in caption
