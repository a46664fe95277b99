"""Reading a configuration imports no figure, and every figure that a configuration may request can be drawn."""

import subprocess
import sys

from icha.configuration.figures import Figures
from icha.datasets.results import figure_number
from icha.figures.registry import drawing_function

# Plans the campaign `smoke` as `icha describe` does.
LIGHT = """
import sys
import icha.configuration
import icha.configuration.load
from typer.testing import CliRunner
from icha.cli import app
heavy = [name for name in sys.modules if name.startswith(("matplotlib", "xarray", "netCDF4", "icha.figures"))]
assert not heavy, heavy
result = CliRunner().invoke(app, ["describe", sys.argv[1]])
assert result.exit_code == 0, result.output
heavy = [name for name in sys.modules if name.startswith(("matplotlib", "icha.figures"))]
assert not heavy, heavy
"""


def test_a_configuration_is_read_and_described_without_figures(tmp_path, pytestconfig):
    smoke = str(pytestconfig.rootpath / "config/campaigns/smoke.yaml")
    subprocess.run([sys.executable, "-c", LIGHT, smoke], cwd=tmp_path, check=True)


def test_figures_are_in_the_order_of_their_numbers_and_can_be_drawn():
    names = list(Figures.model_fields)
    numbers = [figure_number(name) for name in names]
    assert numbers == sorted(set(numbers)) and len(numbers) == 21
    for name in names:
        assert callable(drawing_function(name))
