"""A figure is one module: nothing else knows its name, and only drawing imports libraries for drawing."""

import subprocess
import sys

from icha.figures.captions import caption_of
from icha.figures.registry import DECLARATIONS, figure_module, figure_number

LIGHT = """
import sys
import icha.configuration.load
heavy = [name for name in ("matplotlib", "xarray", "netCDF4") if name in sys.modules]
assert not heavy, heavy
"""


def test_reading_a_configuration_does_not_wait_for_libraries_that_draw(tmp_path):
    subprocess.run([sys.executable, "-c", LIGHT], cwd=tmp_path, check=True)


def test_figures_are_in_the_order_of_their_numbers_and_captions_are_sentences():
    numbers = [figure_number(name) for name in DECLARATIONS]
    assert numbers == sorted(set(numbers)) and len(numbers) == 21
    for name in DECLARATIONS:
        assert callable(figure_module(name).figure)
        caption = caption_of(name, "mean separation\narea over load")
        assert len(caption) > 80 and caption.endswith(".") and not set("{[]") & set(caption)
