"""Figures of indenters: what is drawn agrees with the runs and with the theory of JKR."""

import math

import numpy as np
import pytest

import icha
from icha.analysis.validity import statements_on_dataset
from icha.datasets.campaign import campaign_tree
from icha.datasets.labels import RunLabels
from icha.figures import (
    fig5_multi_slope,
    fig7_stiffness,
    fig17_force_indentation,
    fig18_jkr_plot,
    fig19_work_of_adhesion,
    fig20_pressure_maps,
    select,
)
from icha.figures.captions import caption_of, texts_of
from icha.figures.indenter_curves import select_series
from icha.surfaces.shapes import Cone, CylinderPunch, Sphere

SIDE, GRID, MODULUS, RADIUS = 48e-6, 48, 1e6, 1e-3
ENERGY = (4e-6) ** 3 * MODULUS / RADIUS**2
PULL_OFF = 1.5 * math.pi * ENERGY * RADIUS
FIGURES = fig17_force_indentation, fig18_jkr_plot, fig19_work_of_adhesion


def press(shape=Sphere(RADIUS), rms=0.0, energy=ENERGY):  # noqa: B008, a frozen value
    waves = rms * math.sqrt(2) * np.cos(np.arange(GRID) * np.pi / 4)
    surface = icha.Surface(np.tile(waves, (GRID, 1)), SIDE, "free", shape)
    path = icha.Path(indentations=[1e-8], unload=True)
    return icha.simulate(surface, icha.Material(MODULUS, energy, 1e-12), path, model="boundary_elements")


def tree_of(*runs):
    labels = [RunLabels("press", "boundary_elements", f"s{k}", 0, 0.1, "soft") for k in range(len(runs))]
    return campaign_tree(zip(labels, runs, strict=True))


@pytest.fixture(scope="module")
def campaign():
    """Return the dataset of a smooth and of a slightly rough sphere."""
    return tree_of(press(), press(rms=1e-8))


def lines(ax):
    return [line.get_xydata() for line in ax.get_lines()]


def test_forces_are_those_of_the_runs_beside_jkr_and_hertz(campaign):
    (ax,) = fig17_force_indentation.figure(campaign, study="press").axes
    assert ax.get_xlabel() == "indentation (nm)" and ax.get_ylabel().startswith("force (")
    jkr, hertz = lines(ax)[:2]
    factor = {"µ": 1e6, "n": 1e9}[ax.get_ylabel()[7]]
    assert jkr[:, 1].min() == pytest.approx(-PULL_OFF * factor, rel=1e-3)
    np.testing.assert_allclose(hertz[:, 1] / factor, 4 / 3 * MODULUS * np.sqrt(RADIUS) * (hertz[:, 0] * 1e-9) ** 1.5)
    smooth = np.concatenate(lines(ax)[2:4])
    assert smooth[:, 1].min() == pytest.approx(-PULL_OFF * factor, rel=0.03)


def test_states_of_a_smooth_sphere_are_on_the_line_of_jkr(campaign):
    fig = fig18_jkr_plot.figure(campaign, study="press")
    for ax in fig.axes:
        states, fit = lines(ax)[:2]
        np.testing.assert_allclose(states[:, 0], fit[:, 0])
        np.testing.assert_allclose(states[:, 1], fit[:, 1], rtol=0.03)
    texts = [text.get_text() for text in fig.legends[0].get_texts()]
    assert any(text.startswith("smooth: loading ") for text in texts)
    assert any(text.startswith("rms height 10 nm: loading ") for text in texts)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0)])
def test_the_line_of_jkr_leaves_out_shapes_without_a_radius(order):
    runs = press(), press(shape=CylinderPunch(1e-5)), press(shape=Cone(1.56))
    several, alone = tree_of(*(runs[k] for k in order)), tree_of(runs[0])
    fig, only = (fig18_jkr_plot.figure(tree, study="press") for tree in (several, alone))
    for ax, expected in zip(fig.axes, only.axes, strict=True):
        for line, other in zip(lines(ax), lines(expected), strict=True):
            np.testing.assert_allclose(line, other)
    captions = [
        caption_of("fig18_jkr_plot", texts_of(drawn, {"campaign": tree}, ["press"]))
        for drawn, tree in ((fig, several), (only, alone))
    ]
    assert ["without a radius" in caption for caption in captions] == [True, False]


def test_works_of_adhesion_of_a_smooth_sphere_are_one(campaign):
    (ax,) = fig19_work_of_adhesion.figure(campaign, study="press").axes
    at_zero = [line[line[:, 0] == 0, 1] for line in lines(ax)[:-1]]
    values = np.concatenate(at_zero)
    assert len(values) == 6  # each of three quantities as a seed and as a mean
    np.testing.assert_allclose(values, 1, atol=0.05)


def test_fig5_draws_a_measurement_of_a_rough_sphere_where_the_run_is(tmp_path):
    """The roughness has an rms slope of its own, so both are drawn at relative loads; panel (b) is A E*/F."""
    run = press(rms=1e-8, energy=0.0)
    campaign, at = tree_of(run), int(np.argmax(run["step_kind"].values == "indentation"))
    pressure, area = (float(run[name][at]) for name in ("nominal_pressure", "contact_area_fraction"))
    (tmp_path / "own.csv").write_text(f"p,a\n{pressure!r},{area!r}\n")
    known = {"columns": {"p": 1.0, "a": 1.0}, "label": "own", "material": "soft", "rms_slope": None}
    options = {"study": "press", "measurements": [known | {"contact_modulus": MODULUS}]}
    figure = fig5_multi_slope.figure(campaign, [tmp_path / "own.csv"], **options)
    for ax, value in zip(figure.axes, (area, area / pressure * MODULUS), strict=True):
        assert ax.get_xlabel().startswith("relative load")
        measured = [line for line in ax.get_lines() if line.get_label() == "own"]
        np.testing.assert_allclose(measured[0].get_xydata(), [(pressure / MODULUS, value)])
        drawn = [line for line in ax.get_lines() if line not in measured]
        assert any(np.isclose(line.get_xydata(), measured[0].get_xydata()).all(axis=1).any() for line in drawn)
    shown = texts_of(figure, {"campaign": campaign}, ["press"])
    assert "relative loads F/(E* A0) take the place of reduced pressures" in caption_of("fig5_multi_slope", shown)


def test_captions_state_the_units_of_shapes():
    campaign = tree_of(press(energy=0.0))
    shown = texts_of(fig7_stiffness.figure(campaign, study="press"), {"campaign": campaign}, ["press"])
    assert "the units h_rms of gaps and h'rms of loads are not those of the roughness" in caption_of(
        "fig7_stiffness", shown
    )


def test_maps_show_the_pressure_at_every_snapshot():
    run = press()
    fig = fig20_pressure_maps.figure(tree_of(run), run, run=("press", "boundary_elements", "s0", 0, 0.1, "soft"))
    panels = [ax for ax in fig.axes if ax.get_images()]
    titles = [ax.get_title("right") for ax in panels]
    assert [title.split(",")[0] for title in titles] == ["loading", "pull-off"]
    for k, ax in enumerate(panels):
        shown = ax.get_images()[0].get_array()
        force = run["force"].values[run["snapshot_step"].values[k]]
        unit = {"kPa": 1e3, "MPa": 1e6, "Pa": 1.0}[fig.axes[-1].get_ylabel().split("(")[1][:-1]]
        assert shown.sum() * unit * (SIDE / GRID) ** 2 == pytest.approx(force, rel=1e-4)


def test_five_snapshots_leave_one_place_empty():
    pressures = [1e-3, 2e-3, 5e-3, 1e-2, 2e-2]
    path = icha.Path(reduced_pressures=pressures, snapshots=[("reduced_pressure", p) for p in pressures])
    surface = icha.SelfAffineSpectrum(1e-4, 5e-5, 2e-5, 0.8, 0.1).realise(48, 1)
    run = icha.simulate(surface, icha.Material(MODULUS, 0.0), path, model="boundary_elements")
    fig = fig20_pressure_maps.figure(tree_of(run), run, run=("press", "boundary_elements", "s0", 0, 0.1, "soft"))
    assert len([ax for ax in fig.axes if ax.get_images()]) == 5


def test_reasons_for_an_empty_figure():
    bare = tree_of(press(energy=0.0))
    fig17_force_indentation.figure(bare, study="press")
    for module in FIGURES[1:]:
        with pytest.raises(select.NothingToDraw, match="no sphere with adhesion"):
            module.figure(bare, study="press")
    cone = tree_of(press(shape=Cone(1.56)))
    assert len(lines(fig17_force_indentation.figure(cone, study="press").axes[0])) == 3  # both legs, and zero force
    with pytest.raises(select.NothingToDraw, match="no sphere with adhesion"):
        fig18_jkr_plot.figure(cone, study="press")


@pytest.mark.parametrize("module", FIGURES)
def test_captions_exist(module):
    assert len(caption_of(module.__name__.rsplit(".", 1)[1], "")) > 200


def test_statements_on_validity_if_surfaces_have_slopes_of_their_own():
    """A smooth surface has the slope 0 only, and there are more slopes than surfaces."""
    run = press()
    labels = [("smooth", 0.0), ("rough", 0.1), ("rough", 0.2), ("rough", 0.3)]
    runs = [(RunLabels("press", "boundary_elements", name, 0, slope, "soft"), run) for name, slope in labels]
    assert statements_on_dataset(campaign_tree(runs))


def test_a_study_with_both_models_shows_boundary_elements():
    labels = [RunLabels("press", model, "s0", 0, 0.1, "soft") for model in ("asperities", "boundary_elements")]
    both = campaign_tree(zip(labels, (press(), press()), strict=True))
    (series,) = select_series(both, "press")
    assert series.runs.labels.model == "boundary_elements"
