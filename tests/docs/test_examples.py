"""Scripts in docs/examples: every script runs, and one of its numbers is right."""

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

from icha.datasets.files import read_campaign

EXAMPLES = Path(__file__).parents[2] / "docs/examples"
OF_CAMPAIGNS = {"read_campaign", "own_figure"}
# Scripts that take a second or more.
LONG = {"sphere", "loop", "finite_range", "interval", "area_and_separation", "lens"}
# For each script a variable, its value, and the largest relative difference.
NUMBERS = {
    "sphere": ("ratio", 1, 0.01),  # JKR
    "lens": ("ratio", 1, 0.005),  # JKR
    "finite_range": ("pull_off", 1.824, 0.01),  # Maugis at a Tabor number of 0.3
    "own_heights": ("ratio", 1, 0.02),  # Westergaard, with an area counted in cells
    "scan": ("ratio", 1, 1e-6),
    "jkr_test": ("ratio", 1, 0.05),  # JKR, with noise
    "loop": ("ratio", 1, 1e-3),
    "area_and_separation": ("ratio", 2.05, 0.25),  # between Persson and Bush, Gibson & Thomas
    "interval": ("mean", 0.0463, 0.1),  # boundary elements on the same surfaces
}


@pytest.fixture(autouse=True)
def quiet(monkeypatch, tmp_path):
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.chdir(tmp_path)


def test_every_example_has_a_test():
    assert {path.stem for path in EXAMPLES.iterdir()} == NUMBERS.keys() | OF_CAMPAIGNS


@pytest.mark.parametrize("name", [pytest.param(each, marks=[pytest.mark.slow] * (each in LONG)) for each in NUMBERS])
def test_a_number_of_each_example(name):
    variable, value, difference = NUMBERS[name]
    np.testing.assert_allclose(runpy.run_path(str(EXAMPLES / f"{name}.py"))[variable], value, rtol=difference)


def test_examples_with_a_campaign(smoke, monkeypatch):
    file = smoke / "results/smoke/dataset/smoke.nc"
    monkeypatch.setattr(sys, "argv", ["read_campaign.py", str(file), "challenge"])
    rows = runpy.run_path(str(EXAMPLES / "read_campaign.py"))["rows"]
    study = read_campaign(file)["challenge"].to_dataset()
    assert {material for material, *_ in rows} == set(study.material.values)
    for material in study.material.values:
        areas = [area for name, _, area in rows if name == material]
        assert len(areas) > 1 and sorted(areas) == areas
    figure = runpy.run_path(str(EXAMPLES / "own_figure.py"))["draw"](study)
    assert len(figure.axes[0].patches) == study.sizes["material"]
