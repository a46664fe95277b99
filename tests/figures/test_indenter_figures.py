"""Figures of indenters: what is drawn agrees with the runs and with the theory of JKR."""

import math
from functools import cache

import numpy as np
import pytest
from drawn import legend
from typer.testing import CliRunner

import icha
from icha.asperity.tabor import SHORT_RANGE_FROM
from icha.cli import app
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_dataset, write_dataset
from icha.datasets.labels import RunLabels
from icha.datasets.quantities import label_of
from icha.datasets.surface_file import write_surface
from icha.datasets.variables.run import LOOP
from icha.figures import against_load, at_one_load, contact_maps, indenters, loops, select
from icha.figures.captions import count_runs, units_of_shapes
from icha.figures.drawn import caption_of, shown_runs, table_of
from icha.figures.looks import FEWER_SEEDS
from icha.figures.measured import read_measurements
from icha.surfaces.shapes import Cone, CylinderPunch, Paraboloid, Sphere

SIDE, GRID, MODULUS, RADIUS = 40e-6, 40, 1e6, 1e-3
ENERGY = (4e-6) ** 3 * MODULUS / RADIUS**2
PULL_OFF = 1.5 * math.pi * ENERGY * RADIUS
FIGURES = indenters.force_indentation, indenters.jkr_plot, indenters.work_of_adhesion


def press(*arguments, **named):
    """Return a loop that the test may change."""
    return _press(*arguments, **named).copy(deep=True)


@cache
def _press(shape=Sphere(RADIUS), rms=0.0, energy=ENERGY):  # noqa: B008, a frozen value
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
    (ax,) = indenters.force_indentation(campaign, study="press").axes
    assert ax.get_xlabel() == label_of("indentation", "nm") and ax.get_ylabel().startswith("force ")
    jkr, hertz = lines(ax)[:2]
    factor = {"µ": 1e6, "n": 1e9}[ax.get_ylabel().split("(")[1][0]]
    assert jkr[:, 1].min() == pytest.approx(-PULL_OFF * factor, rel=1e-3)
    np.testing.assert_allclose(hertz[:, 1] / factor, 4 / 3 * MODULUS * np.sqrt(RADIUS) * (hertz[:, 0] * 1e-9) ** 1.5)
    smooth = np.concatenate(lines(ax)[2:4])
    assert smooth[:, 1].min() == pytest.approx(-PULL_OFF * factor, rel=0.03)


def test_states_of_a_smooth_sphere_are_on_the_line_of_jkr(campaign):
    fig = indenters.jkr_plot(campaign, study="press")
    for ax in fig.axes:
        states, fit = lines(ax)[:2]
        np.testing.assert_allclose(states[:, 0], fit[:, 0])
        np.testing.assert_allclose(states[:, 1], fit[:, 1], rtol=0.03)
    texts = [text.get_text() for text in fig.legends[0].get_texts()]
    assert any(text.startswith("smooth: loading ") for text in texts)
    assert any(text.startswith("rms height 10 nm: loading ") for text in texts)


def test_the_line_of_jkr_leaves_out_shapes_without_a_radius():
    sphere = press()
    several, alone = tree_of(press(shape=CylinderPunch(1e-5)), press(shape=Cone(1.56)), sphere), tree_of(sphere)
    fig, only = (indenters.jkr_plot(tree, study="press") for tree in (several, alone))
    for ax, expected in zip(fig.axes, only.axes, strict=True):
        for line, other in zip(lines(ax), lines(expected), strict=True):
            np.testing.assert_allclose(line, other)
    assert "on shapes without a radius, and on layers are left out" in caption_of(fig)
    assert "sqrt(R1 R2)" not in caption_of(fig)
    paraboloid = tree_of(press(shape=Paraboloid((RADIUS, 2 * RADIUS))))
    for draw in FIGURES[:2]:
        assert "geometric mean of its two radii, sqrt(R1 R2)" in caption_of(draw(paraboloid, study="press"))


@pytest.fixture(scope="module")
def lenses():
    """Return the dataset of two smooth lenses of different radii, and of the smaller one without adhesion."""
    runs = {"small": press(), "large": press(shape=Sphere(2 * RADIUS)), "dry": press(energy=0.0)}
    places = {"small": ("small", "soft"), "large": ("large", "soft"), "dry": ("small", "dry")}
    labels = {name: RunLabels("press", "boundary_elements", at, 0, 0.0, of) for name, (at, of) in places.items()}
    return campaign_tree((labels[name], run) for name, run in runs.items())


def test_each_panel_has_the_theories_of_its_own_runs(lenses):
    figure = indenters.force_indentation(lenses, study="press")
    panels = {ax.get_title("right"): ax for ax in figure.axes}
    assert panels.keys() == {"small, smooth, soft", "small, smooth, dry", "large, smooth, soft"}
    factor = {"µ": 1e6, "n": 1e9}[figure.axes[0].get_ylabel().split("(")[1][0]]
    for title, ax in panels.items():
        lowest, radius = min(line[:, 1].min() for line in lines(ax)), RADIUS * (1 + title.startswith("large"))
        # Without adhesion, no line is below zero.
        bare = "dry" in title
        assert lowest / factor == pytest.approx(0.0 if bare else -1.5 * math.pi * ENERGY * radius, rel=0.03, abs=1e-12)
        hertz = lines(ax)[0 if bare else 1]
        force = 4 / 3 * MODULUS * np.sqrt(radius) * (hertz[:, 0] * 1e-9) ** 1.5
        np.testing.assert_allclose(hertz[:, 1] / factor, force)
    assert "Runs without adhesion have no line of JKR" in caption_of(figure)


def test_lenses_have_names_and_colours_of_their_own_and_bare_ones_are_left_out(lenses):
    figure = indenters.jkr_plot(lenses, study="press")
    (legend,) = figure.legends
    entries = [(text.get_text(), line) for text, line in zip(legend.get_texts(), legend.legend_handles, strict=True)]
    names = {text.partition(":")[0]: line.get_color() for text, line in entries if "loading" in text}
    assert names.keys() == {"small, smooth", "large, smooth"} and len(set(names.values())) == 2
    assert "Runs without adhesion" in caption_of(figure)


def test_points_of_different_lenses_are_not_joined(lenses, campaign):
    figure = indenters.work_of_adhesion(lenses, study="press")
    assert all(len(line) == 1 for line in lines(figure.axes[0])[:-1])
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {"small", "large"} < set(names) and not [name for name in names if "dry" in name]
    # A smooth and a rough sphere of the same radius are joined.
    joined = indenters.work_of_adhesion(campaign, study="press").axes[0]
    assert [len(line) for line in lines(joined)[:-1]].count(2) == 3


def test_states_beyond_jkr_do_not_spoil_the_axes_and_spheres_of_long_range_have_no_fit(tmp_path):
    """A little contact area under the attraction across the gap has F/a^(3/2) far below that of JKR."""
    run = press().drop_vars(["work_of_adhesion_approach", "work_of_adhesion_retraction"])
    run["interaction_range"] = run["interaction_range"] * 0 + (RADIUS * (ENERGY / MODULUS) ** 2) ** (1 / 3) / 0.3
    first = int(np.argmax(run["contact_radius"].values > 0))
    run["contact_radius"][first] = 1e-3 * run["contact_radius"].max()
    tree = tree_of(run)
    write_dataset(run, tmp_path / "run.nc")
    shown = CliRunner().invoke(app, ["show", str(tmp_path / "run.nc")]).output
    assert "work of adhesion on approach: no fit (Tabor parameter 0.3 below 3)" in shown
    write_dataset(press(rms=1e-8), tmp_path / "rough.nc")
    rough = CliRunner().invoke(app, ["show", str(tmp_path / "rough.nc")]).output
    assert "rms height of the shape" in rough and "mean separation ū/unit_height" in rough
    assert "largest reduced pressure F/(E* unit_slope A0)" in rough
    # There are no reduced values of a smooth shape, and values of full contact are those of the roughness.
    assert "reduced_" not in shown and shown.count("of the roughness alone") == 2
    assert loops.loops(tree, study="press").axes[0].get_xlabel().startswith(label_of("mean_separation"))
    figure = indenters.jkr_plot(tree, study="press")
    lowest = min(line[:, 0].min() for ax in figure.axes for line in lines(ax))
    factor = {"k": 1e-3, "N": 1.0}[figure.axes[0].get_xlabel().split("(")[1][0]]
    assert -math.sqrt(8 * math.pi * MODULUS * ENERGY) < lowest / factor < 0
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    reason = "no fit (Tabor parameter 0.3 below 3)"
    assert f"smooth: loading {reason}, unloading {reason}" in names
    words = caption_of(figure)
    assert f"Tabor parameter of the sphere is below {SHORT_RANGE_FROM:g}" in words
    assert f"A smooth sphere with a Tabor parameter of {SHORT_RANGE_FROM:g} or more gives a straight line" in words


@pytest.mark.parametrize("module", [against_load.area_and_gap, at_one_load.distributions, against_load.stiffness])
def test_captions_say_that_theories_of_flat_surfaces_do_not_hold_under_a_shape(module):
    tree = tree_of(press(rms=1e-8, energy=0.0))
    words = caption_of(module(tree, study="press"))
    assert "They do not hold under a shape, so none is drawn" in words and "Persson" not in words
    figure, studies = module(tree, study="press"), [tree["press"].to_dataset()]
    assert "the units h_rms of gaps and h'rms of loads are not those of the" in units_of_shapes(figure, studies)


def test_works_of_adhesion_of_a_smooth_sphere_are_one(campaign):
    (ax,) = indenters.work_of_adhesion(campaign, study="press").axes
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
    known = {"columns": {"p": 1.0, "a": 1.0}, "label": "own", "citation": "A. Author (2000)", "material": "soft"}
    known |= {"quantities": ["load", "area"], "contact_modulus": MODULUS}
    measurements = read_measurements([tmp_path / "own.csv"], [known])
    figure = against_load.multi_slope(campaign, study="press", measurements=measurements)
    for ax, value in zip(figure.axes, (area, area / pressure * MODULUS), strict=True):
        assert ax.get_xlabel().startswith("relative load")
        measured = [line for line in ax.get_lines() if line.get_label() == "own"]
        np.testing.assert_allclose(measured[0].get_xydata(), [(pressure / MODULUS, value)])
        drawn = [line for line in ax.get_lines() if line not in measured]
        assert any(np.isclose(line.get_xydata(), measured[0].get_xydata()).all(axis=1).any() for line in drawn)


def test_measurements_of_indenters_are_drawn_in_the_units_of_the_figures(campaign, tmp_path):
    """The points of the smooth sphere's run, as a table, lie on its curves."""
    run = next(iter(indenters.select_series(campaign, "press")[0].runs.by_seed.values()))
    steps = np.flatnonzero(run["contact_radius"].values > 0)
    force, depth, radius = (run[name].values[steps] for name in ("force", "indentation", "contact_radius"))
    height = 1e-8
    columns = {"force": force * 1e3, "indentation": depth * 1e6, "contact_radius": radius * 1e6}
    columns |= {"rms_height": np.full(len(steps), height * 1e9), "receding_work": np.full(len(steps), 2e3 * ENERGY)}
    np.savetxt(
        tmp_path / "own.csv", np.transpose([*columns.values()]), header=",".join(columns), comments="", delimiter=","
    )
    known = {"label": "own", "citation": "A. Author (2000)", "material": "soft", "works": (ENERGY, ENERGY)}
    known |= {"columns": dict(zip(columns, (1e-3, 1e-6, 1e-6, 1e-9, 1e-3), strict=True)), "quantities": [*columns]}

    def drawn(draw):
        fig = draw(campaign, study="press", measurements=read_measurements([tmp_path / "own.csv"], [known]))
        assert "Crosses are measurements: own (A. Author (2000))." in caption_of(fig)
        shown = [[each for each in ax.get_lines() if each.get_marker() == "x"] for ax in fig.axes]
        return fig, [np.concatenate([each.get_xydata() for each in found]) for found in shown]

    fig, points = drawn(indenters.force_indentation)
    curves = np.concatenate([line.get_xydata() for line in fig.axes[0].get_lines() if line.get_marker() == "None"])
    for point in points[0]:
        assert np.isclose(curves, point, rtol=1e-6, atol=1e-9).all(axis=1).any()
    fig, points = drawn(indenters.jkr_plot)
    top = int(np.argmax(force))
    assert [len(each) for each in points] == [top + 1, len(steps) - top]
    scale = {"kN": 1e-3, "N": 1.0, "MN": 1e-6, "mN": 1e3}[fig.axes[0].get_xlabel().split("(")[1].split()[0]]
    expected = np.transpose([force / radius**1.5 * scale, radius**1.5 / RADIUS * 1e3])
    np.testing.assert_allclose(points[0], expected[: top + 1], rtol=1e-6)
    fig, points = drawn(indenters.work_of_adhesion)
    unit = {"nm": 1e9, "µm": 1e6}[fig.axes[0].get_xlabel().split("(")[1].rstrip(")")]
    np.testing.assert_allclose(points[0][0], [height * unit, 2.0])


def test_maps_show_the_pressure_at_every_snapshot():
    run = press()
    fig = contact_maps.pressure_maps(tree_of(run), run, run=("press", "boundary_elements", "s0", 0, 0.1, "soft"))
    panels, drawn = [ax for ax in fig.axes if ax.get_images()], table_of(fig)
    titles = [ax.get_title("right") for ax in panels]
    assert [title.split(",")[0] for title in titles] == ["loading", "pull-off"]
    for k, ax in enumerate(panels):
        shown = ax.get_images()[0].get_array()
        force = run["force"].values[run["snapshot_step"].values[k]]
        unit = {"kPa": 1e3, "MPa": 1e6, "Pa": 1.0}[fig.axes[-1].get_ylabel().split("(")[1][:-1]]
        assert shown.sum() * unit * (SIDE / GRID) ** 2 == pytest.approx(force, rel=1e-4)
        # The table has the pressure of every cell in contact, at its place.
        cells = drawn[drawn.panel == "ab"[k]]
        assert cells.pressure.sum() * (SIDE / GRID) ** 2 == pytest.approx(force, rel=1e-4)
        assert cells.x.mean() == pytest.approx(cells.y.mean()) and len(cells) == shown.count()


def test_fig4_draws_the_cells_of_boundary_elements_on_the_shape(tmp_path):
    run = press()
    write_surface(
        tmp_path / "s.nc", icha.Surface(np.zeros((GRID, GRID)), SIDE, "free", Sphere(RADIUS)), name="s", seed=0
    )
    labels = ("press", "boundary_elements", "s0", 0, 0.1, "soft")
    fig = contact_maps.contact_map(tree_of(run), read_dataset(tmp_path / "s.nc"), run, run=labels, kind="indentation")
    heights, cells = (image.get_array()[:-1, :-1] for image in fig.axes[0].get_images())
    np.testing.assert_array_equal(cells, run["contact_map"].values[0])
    assert heights.min() == pytest.approx(-(SIDE**2) / 4 / RADIUS * 1e9, rel=0.1) and heights.max() == pytest.approx(
        0, abs=1
    )
    assert "Contact of boundary elements" in caption_of(fig) and "asperity" not in caption_of(fig)
    assert "$F$ = " in fig.get_suptitle() and "mathrm{rms}}A_0" not in fig.get_suptitle()
    # The solver meets a target of no force to its tolerance.
    run, surface = run.copy(deep=True), read_dataset(tmp_path / "s.nc")
    run["force"].values[run["snapshot_step"].values[0]] = -1e-9 * run["force"].values.max()
    unloaded = contact_maps.contact_map(tree_of(run), surface, run, run=labels, kind="indentation")
    assert "$F$ = 0 N" in unloaded.get_suptitle()
    # The frame contains the contact.
    columns = np.flatnonzero(cells.any(axis=0)) / GRID * SIDE * 1e6
    left, right = fig.axes[1].get_xlim()
    assert left < columns[0] and columns[-1] < right


def test_reasons_for_an_empty_figure():
    labels = [RunLabels("press", model, "s0", 0, 0.1, "soft") for model in ("asperities", "boundary_elements")]
    (series,) = indenters.select_series(campaign_tree(zip(labels, (press(), press()), strict=True)), "press")
    assert series.runs.labels.model == "boundary_elements"
    bare = tree_of(press(energy=0.0))
    indenters.force_indentation(bare, study="press")
    for module in FIGURES[1:]:
        with pytest.raises(select.NothingToDraw, match="no sphere with adhesion"):
            module(bare, study="press")
    cone = tree_of(press(shape=Cone(1.56)))
    assert len(lines(indenters.force_indentation(cone, study="press").axes[0])) == 3  # both legs, and zero force
    with pytest.raises(select.NothingToDraw, match="no sphere with adhesion"):
        indenters.jkr_plot(cone, study="press")


def ended_seeds():
    """Return the dataset of three seeds of nearly equal roughness; the second seed ended before its unloading."""
    runs = [press(rms=1e-8), press(rms=1.00001e-8), press(rms=1.00002e-8)]
    first = runs[1].isel(step=runs[1]["leg"].values == 0, snapshot=[0])
    first = first.isel(spot=first["spot_snapshot"].values == 0, event=first["event_step"].values < first.sizes["step"])
    lost = [name for name in first if name in LOOP or name.startswith(("pull_off", "work_of", "loss"))]
    runs[1] = first.drop_vars(lost).assign_attrs(beyond_model="contact at the edge")
    labels = [RunLabels("press", "boundary_elements", "s0", seed, 0.1, "soft") for seed in (1, 2, 3)]
    return campaign_tree(zip(labels, runs, strict=True)), labels


def test_seeds_that_ended_before_their_unloading_are_counted_and_means_of_the_others_are_marked():
    tree, _ = ended_seeds()
    drawn = [module(tree, study="press") for module in FIGURES]
    for figure in drawn:
        caption = count_runs({"campaign": tree}, ["press"], shown=shown_runs(figure))
        assert caption.startswith("The figure shows 2 of 3 runs; 1 ended before this state; the others are a biased")
    assert legend(drawn[1])[0].count("(2 of 3 seeds)") == 2
    assert FEWER_SEEDS in legend(drawn[2])
    crosses = [line for line in drawn[2].axes[0].get_lines() if line.get_marker() == "x"]
    assert len(crosses) == 3


def test_axes_have_no_offset():
    tree, _ = ended_seeds()
    (axes,) = indenters.work_of_adhesion(tree, study="press").axes
    axes.figure.draw_without_rendering()
    assert axes.xaxis.get_offset_text().get_text() == ""


def test_maps_show_the_snapshots_that_a_run_reached_before_its_end():
    tree, labels = ended_seeds()
    run = press(rms=1.00001e-8).isel(snapshot=[0])
    figure = contact_maps.pressure_maps(tree, run, run=labels[1])
    assert len([ax for ax in figure.axes if ax.get_images()]) == 1
    assert "The run ended before its last target: contact at the edge." in caption_of(figure)
