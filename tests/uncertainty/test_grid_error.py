"""Errors of boundary elements due to the grid: laws from the measurements, and words where numbers stand."""

import math

import cyclic_campaign as cyclic
import numpy as np
import pytest
from drawn import draw, legend

import icha
from icha.datasets.campaign_file import campaign_tree
from icha.figures import against_parameter
from icha.figures import loops as loop_figures
from icha.figures.drawn import caption_of
from icha.figures.select import COARSE_GRID
from icha.report.answers import answers_of, answers_table
from icha.report.validity import statements_on_dataset
from icha.uncertainty.estimates import estimate_campaign
from icha.uncertainty.grid_error import AREA_ERROR, LOOP_ERRORS, cells_of_length, error_beyond
from validation import loop_grid

QUANTITIES = ("pull_off_pressure", "hysteresis_loss")


def loops(cells):
    """Loops of boundary elements whose length has a number of cells."""

    def resolved(seed, run):
        curvature = run["rms_curvature"] * float(cells_of_length(run) / cells) ** 1.5
        return run.assign(rms_curvature=curvature.assign_attrs(run["rms_curvature"].attrs))

    return campaign_tree(cyclic.pulls((1, 2), resolved))


def test_laws_are_those_of_the_measurements():
    measurements = loop_grid.read_measurements()
    for variable in QUANTITIES:
        law, known = loop_grid.fit_loops(measurements, variable), LOOP_ERRORS[variable]
        assert (known.width, known.power, known.scatter) == pytest.approx((law.width, law.power, law.scatter), rel=0.01)
    areas = loop_grid.areas_of(measurements)
    assert AREA_ERROR == pytest.approx(loop_grid.fit_areas(areas), rel=0.01)
    # Four of five errors at least are within two standard deviations.
    assert np.mean(np.abs(areas["error"]) < 2 * AREA_ERROR.at(areas["contact_cells"])) > 0.8


def test_length_of_a_summit_in_cells():
    spectrum = icha.SelfAffineSpectrum(100e-6, 50e-6, 12.5e-6, 0.8, 0.1)
    surface, material = spectrum.realise(64, 1), icha.Material(25e6, 0.02, 1e-8)
    run = icha.simulate(surface, material, icha.Path(reduced_pressures=[1e-3]), model="boundary_elements")
    length = (0.02 / 25e6 * surface.summit_radius**2) ** (1 / 3)
    assert float(cells_of_length(run)) == pytest.approx(length / surface.spacing)
    assert math.isnan(cells_of_length(run.assign(surface_energy=0.0)))


def test_loops_on_a_coarse_grid_are_named_and_pale():
    coarse, fine = loops(0.7), loops(2 * LOOP_ERRORS["hysteresis_loss"].least_cells)
    stated = {each.about: each for each in statements_on_dataset(coarse) if each.about == "loops"}
    text = stated["loops"].text
    assert (
        not stated["loops"].good and "0.7 cells for soft on rough (pull-off " in text and " % too small, loss " in text
    )
    for module in (loop_figures.loops, against_parameter.pull_off, against_parameter.loss):
        figure = draw(module, coarse, "pull")
        assert f"pale: {COARSE_GRID}" in legend(figure) and "0.7 cells for soft on rough" in caption_of(figure)
        assert f"pale: {COARSE_GRID}" not in legend(draw(module, fine, "pull"))
    assert {each.about: each.good for each in statements_on_dataset(fine)}["loops"]


def test_estimates_of_loops_say_that_the_error_of_the_grid_is_not_known():
    tree = estimate_campaign(loops(0.7))
    answers = answers_of(tree["pull"].to_dataset())
    rows, latex = [each for each in answers if not each.state], answers_table(answers).as_latex()
    assert {each.quantity for each in rows} == {"pull-off pressure", "hysteresis loss"}
    for each in rows:
        assert "; on this grid, whose error is not known; with 0.7 cells" in each.number
        assert any(each.quantity in line and "whose error is not known" in line for line in latex.splitlines())


def test_estimates_are_silent_only_if_the_interval_contains_the_expected_error():
    expected = LOOP_ERRORS["hysteresis_loss"].at(2.0)
    for known, silent in ((1.01 * expected, True), (0.99 * expected, False), (math.nan, False)):
        assert (error_beyond(known, "hysteresis_loss", 2.0, math.nan, math.nan) == "") == silent
    assert error_beyond(math.nan, "pull_off_pressure", math.nan, math.nan, math.nan).endswith("error is not known")
    assert "4 contact patches of 10 cells" in error_beyond(math.nan, "contact_area_fraction", math.nan, 4, 40)
    assert error_beyond(math.nan, "mean_gap", math.nan, 4, 40) == ""
