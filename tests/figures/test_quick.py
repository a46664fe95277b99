"""Plots of one run, and the views of surfaces, materials and paths in notebooks."""

import logging

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import small_campaign as small

import icha
from icha.datasets.quantities import label_of

mpl.use("agg")
RUN = small.run(1)


def test_area_and_separation_are_drawn_in_units_with_prefixes():
    axes = icha.plot_area(RUN, label="soft")
    (line,) = axes.get_lines()
    np.testing.assert_allclose(line.get_ydata(), RUN.contact_area_fraction)
    np.testing.assert_allclose(line.get_xdata() * 1e3, RUN.nominal_pressure)
    assert axes.get_xlabel() == "nominal pressure  $p$ (kPa)" and line.get_label() == "soft"
    assert icha.plot_area(RUN, axes) is axes and len(axes.get_lines()) == 2
    axes = icha.plot_separation(RUN)
    assert axes.get_ylabel() == label_of("mean_gap", "µm")
    np.testing.assert_allclose(axes.get_lines()[0].get_ydata() * 1e-6, RUN.mean_gap)


@pytest.mark.parametrize("model", ["asperities", "boundary_elements"])
def test_contact_is_drawn_for_both_models(model):
    surface = icha.SelfAffineSpectrum(100e-6, 40e-6, 25e-6, 0.8).realise(32, 1)
    run = icha.simulate(surface, small.MATERIALS["hertz"], icha.Path([1e-2]), model=model)
    _, given = plt.subplots()
    axes = icha.plot_contact(run, given)
    assert axes is given and axes.get_xlabel() == "$x$ (µm)"
    # The cells of a map lie around the nodes, from x = 0.
    assert axes.get_xlim()[1] == pytest.approx(100 if model == "asperities" else 100 - 50 / 32)
    shown = axes.collections[0].get_offsets() if model == "asperities" else axes.images[0].get_array()
    assert len(shown) == (run.sizes["spot"] if model == "asperities" else 32)


def test_surfaces_materials_and_paths_show_their_values():
    surface = small.surface()
    assert "<caption>Surface</caption>" in surface._repr_html_() and "32 × 32" in surface._repr_html_()
    lens = icha.Surface(surface.heights, surface.period, "free", icha.Sphere(1e-2))
    assert "shape" in lens._repr_html_()
    assert "contact modulus" in small.MATERIALS["soft"]._repr_html_()
    assert "thickness" in icha.Material(1e6, 0.0, thickness=1e-4)._repr_html_()
    assert "pressures" in icha.Path(pressures=[1e3], unload=True)._repr_html_()


def test_the_logger_reports_every_target(caplog):
    with caplog.at_level(logging.INFO, logger="icha"):
        icha.simulate(small.surface(), small.MATERIALS["hertz"], icha.Path([1e-3, 1e-2]))
    assert [record.getMessage()[:11] for record in caplog.records] == ["stop 1 of 2", "stop 2 of 2"]
