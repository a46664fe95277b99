"""Figures of loading and unloading, with loops made from loading runs."""

from functools import cache

import cyclic_campaign as cyclic
import numpy as np
import pytest
import small_campaign as small
import xarray as xr
from drawn import draw, legend
from matplotlib.colors import to_hex
from scipy.interpolate import CubicHermiteSpline

from icha.contact.models import REFERENCE_MODEL
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import RunLabels
from icha.datasets.quantities import label_of, symbol_of
from icha.figures import against_parameter, contact_maps, loops
from icha.figures.against_parameter import fit_line, shares
from icha.figures.drawn import caption_of
from icha.figures.ensembles import Points
from icha.figures.looks import REFERENCE_NAME
from icha.figures.select import ContactRuns, select_unloaded_runs
from icha.figures.style import slope_label

NAMES = (("reduced_separation", "reduced_pressure"), ("reduced_pressure", "contact_area_fraction"))
# Numbers of steps of loading.
DEPTHS = {"gentle": 4, "middle": 5, "hard": 6}


@cache
def loop(material="soft", rms_slope=0.5, seed=1, steps=6):
    """Return a loop that turns after some steps of a loading run."""
    run = small.run(seed, rms_slope, material)
    snapshots = np.flatnonzero(run["snapshot_step"].values < steps)
    spots = np.isin(run["spot_snapshot"].values, snapshots)
    return cyclic.unloaded(run.isel(step=slice(0, steps), snapshot=snapshots, spot=spots))


def study(name, materials=("soft", "hertz"), slopes=(0.5,), seeds=(1, 2), steps=6):
    """Labels and runs of a study."""
    return [
        (RunLabels(name, "asperities", "rough", seed, slope, material), loop(material, slope, seed, steps))
        for seed in seeds
        for slope in slopes
        for material in materials
    ]


@pytest.fixture(scope="module")
def tree():
    loads = [run for name, steps in DEPTHS.items() for run in study(name, steps=steps)]
    return campaign_tree([*study("slopes", slopes=(1.0, 0.5)), *loads])


def one(material="soft", **changed):
    """A study of a single run."""
    ((labels, run),) = study("one", materials=(material,), seeds=(1,))
    return campaign_tree([(labels, run.assign(changed))])


def snap_map(tree, surface, study="one"):
    return contact_maps.snap_map(tree, surface, run=(study, "asperities", "rough", 1, 0.5, "soft"))


def curves(axes):
    """Return the solid and the dashed lines in an axes, without the thin ones of single seeds."""
    lines = [line for line in axes.get_lines() if line.get_linestyle() != "None" and len(line.get_xdata()) > 2]
    return tuple(
        [line for line in lines if line.get_linewidth() > 0.5 and (line.get_linestyle() == "-") == solid]
        for solid in (True, False)
    )


def marks(axes):
    return [line for line in axes.get_lines() if line.get_linestyle() == "None" and len(line.get_xdata())]


def test_fig13_draws_loading_unloading_and_the_pull_off():
    run = loop()
    figure = loops.loops(one(), study="one")
    turn, at = int(np.flatnonzero(run["leg"].values == 0)[-1]), int(np.argmin(run["nominal_pressure"].values))
    for axes, names in zip(figure.axes, NAMES, strict=True):
        x, y = (run[name].values for name in names)
        (solid,), (dashed,) = curves(axes)
        for line, steps in ((solid, slice(turn + 1)), (dashed, slice(turn, None))):
            drawn = np.array(line.get_data())
            every = (drawn.shape[1] - 1) // (len(x[steps]) - 1)
            np.testing.assert_array_equal(drawn[:, ::every], (x[steps], y[steps]))
        assert solid.get_color() == dashed.get_color()
        (pull_off,) = marks(axes)
        assert pull_off.get_xydata().tolist() == [[x[at], y[at]]]
    unit = float(run["contact_modulus"] * run["rms_slope"])
    assert -unit * run["reduced_pressure"].values[at] == pytest.approx(float(run["pull_off_pressure"]))
    assert {"loading", "unloading", "pull-off"} <= set(legend(figure))
    # Loops are along the mean separation, which is not the mean gap of a free square.
    left = loops.loops(one(), study="one", units="physical").axes[0]
    assert left.get_xlabel().startswith(label_of("mean_separation"))
    gap = (run["mean_separation"] + run["rms_height"]).assign_attrs(run["mean_gap"].attrs)
    free = one(boundary=run["boundary"].copy(data="free"), mean_gap=gap)
    ((_, shown),) = select_unloaded_runs(free, "one")
    np.testing.assert_allclose(shown["reduced_separation"], run["reduced_separation"])


def test_fig13_without_adhesion_has_no_hysteresis_and_rounding_is_no_pull_off():
    run = loop("hertz")
    tiny = {name: run[name].copy(deep=True) for name in ("nominal_pressure", "reduced_pressure")}
    for values in tiny.values():
        values.values[-1] = -1e-52
    figure = loops.loops(one("hertz", **tiny), study="one")
    (solid,), (dashed,) = curves(figure.axes[0])
    # The states, of which the last one is not in contact.
    x, y = (values[:-1:8] for values in dashed.get_data())
    loading = np.interp(x, solid.get_xdata()[::-1], solid.get_ydata()[::-1])
    np.testing.assert_allclose(y, loading, atol=1e-12)
    # Between them, the curve has their stiffness.
    states = run.isel(step=slice(int(np.flatnonzero(run["leg"].values == 0)[-1]), -1))
    unit = float(run["rms_height"] / (run["contact_modulus"] * run["rms_slope"]))
    curve = CubicHermiteSpline(x, y, -unit * states["contact_stiffness"].values)
    np.testing.assert_allclose(dashed.get_ydata()[:-8], curve(dashed.get_xdata()[:-8]), rtol=1e-6)
    assert not marks(figure.axes[0]) and not figure.axes[0].child_axes and "pull-off" not in legend(figure)


def test_fig13_shows_one_surface_and_seed(tree):
    run = loop(seed=2)
    figure = loops.loops(tree, study="hard", seed=2)
    solid, dashed = curves(figure.axes[0])
    assert len(solid) == len(dashed) == 2
    deepest = run["reduced_pressure"].values[np.flatnonzero(run["leg"].values == 0)[-1]]
    assert any(line.get_ydata()[-1] == deepest for line in solid)
    assert len({line.get_color() for line in solid}) == 2
    assert figure.get_suptitle() == "asperities, rough, seed 2"
    with pytest.raises(ValueError, match="no complete run has seed 7; complete runs have seed 1, 2"):
        loops.loops(tree, study="hard", seed=7)


@pytest.mark.parametrize(
    ("name", "markers"), [("boundary elements", ["+", "x"]), ("boundary elements at finite range", ["1", "2"])]
)
def test_fig13_draws_boundary_elements_over_their_run(name, markers):
    shown = loop()
    own = RunLabels("hard", "asperities", "rough", 1, 0.5, "soft")
    # The grid resolves the length of a summit.
    shown = shown.assign(rms_curvature=shown["rms_curvature"] * 1e-3)
    attraction = "short range" if name == "boundary elements" else "finite range"
    truth = shown.assign_attrs(contact_model="boundary_elements", attraction=attraction)
    truth = truth.assign(reduced_pressure=1.1 * truth["reduced_pressure"])
    both = campaign_tree([(own, shown), (own._replace(study="truth", model="boundary_elements"), truth)])
    figure = loops.loops(both, study="hard", boundary_elements="truth")
    for axes, names in zip(figure.axes, NAMES, strict=False):
        crosses = [line for line in marks(axes) if line.get_markersize() < 4]
        assert [line.get_marker() for line in crosses] == markers
        for line, branch in zip(crosses, ("loading", "unloading"), strict=True):
            states = truth.isel(step=truth["branch"].values == branch)
            np.testing.assert_array_equal(line.get_data(), [states[name].values for name in names])
            assert line.get_color() in {each.get_color() for each in curves(axes)[0]}
    assert {f"{name}, loading", f"{name}, unloading"} <= set(legend(figure))


@pytest.mark.parametrize("beside", [None, "truth"])
def test_fig13_draws_no_boundary_elements_of_another_contact(beside):
    """The inverted surface, or in another study a material with another work of receding edges."""
    run = loop()
    truth = run.assign_attrs(contact_model="boundary_elements", attraction="short range")
    own = RunLabels("hard", "asperities", "rough", 1, 0.5, "soft")
    of_own = own._replace(study=beside or "hard", model="boundary_elements")
    name, factor = ("receding_energy", 2) if beside else ("height_skewness", -1)
    other = of_own._replace(**({"material": "directed"} if beside else {"surface": "inverted"}))
    twice = truth.assign({"reduced_pressure": 2 * truth["reduced_pressure"], name: factor * truth[name]})
    runs = [(own, run), (of_own, truth), (other, twice)]
    figure = loops.loops(campaign_tree(runs), study="hard", boundary_elements=beside, surface="rough")
    crosses = [line.get_ydata() for line in marks(figure.axes[0]) if line.get_markersize() < 4]
    assert max(map(max, crosses)) == pytest.approx(float(run["reduced_pressure"].max()))


def test_fig13_of_boundary_elements_alone_draws_none_beside_them():
    run = loop().assign_attrs(contact_model="boundary_elements", attraction="short range")
    own = RunLabels("hard", "boundary_elements", "rough", 1, 0.5, "soft")
    both = campaign_tree([(own, run), (own._replace(surface="finer"), run)])
    assert not [line for line in marks(loops.loops(both, study="hard").axes[0]) if line.get_markersize() < 4]


def test_fig13_states_that_load_control_loses_more_than_the_area():
    assert "Under load control" in caption_of(loops.loops(one(control="load"), study="one"))
    assert "Under load control" not in caption_of(loops.loops(one(), study="one"))


def test_fig14_shows_means_and_scatter_over_the_seeds(tree):
    figure = against_parameter.pull_off(tree, study="slopes", load_studies=list(DEPTHS))
    left, right = figure.axes
    factor, quantity = 1e-3, "pull_off_pressure"
    (sticky, bare), slopes = left.containers, (0.5, 1.0)
    values = factor * np.array([[float(loop("soft", slope, seed)[quantity]) for slope in slopes] for seed in (1, 2)])
    # The points of both materials stand side by side.
    apart = [line[0].get_xdata() / slopes for line in (sticky, bare)]
    np.testing.assert_allclose(apart, [[1.15**-0.25] * 2, [1.15**0.25] * 2])
    np.testing.assert_allclose(sticky[0].get_ydata(), values.mean(axis=0))
    # Two seeds are too few for a confidence interval: the bars are their range.
    ranges = [segment[:, 1] for segment in sticky[2][0].get_segments()]
    np.testing.assert_allclose(ranges, np.transpose([values.min(axis=0), values.max(axis=0)]))
    assert left.get_ylim()[1] > values.max()
    assert left.get_title("right") == "asperities"
    assert np.all(bare[0].get_ydata() == 0) and bare[0].get_markerfacecolor() == "white"

    sticky, bare = right.containers
    runs = [[loop(seed=seed, steps=steps) for seed in (1, 2)] for steps in DEPTHS.values()]
    states = np.array(
        [[[float(run["largest_reduced_pressure"]), factor * float(run[quantity])] for run in each] for each in runs]
    )
    loads, tensions = sticky[0].get_data()
    expected = np.transpose(sorted(states.mean(axis=1).tolist()))
    np.testing.assert_allclose(tensions, expected[1])
    np.testing.assert_allclose(loads / expected[0], loads[0] / expected[0][0])
    assert 0.9 < loads[0] / expected[0][0] < 1
    assert np.all(bare[0].get_ydata() == 0)
    assert sticky[0].get_color() == left.containers[0][0].get_color() != bare[0].get_color()
    # Materials, the slope of (b), and the seeds.
    assert len(legend(figure)) == 4


def test_fig14_shows_boundary_elements_beside_asperities():
    runs = study("one", materials=("soft",), slopes=(1.0, 0.5))
    runs += [(labels._replace(model="boundary_elements"), run) for labels, run in runs]
    figure = against_parameter.pull_off(campaign_tree(runs), study="one")
    (asperities, *_), (truth, *_) = figure.axes[0].containers
    assert (asperities.get_marker(), truth.get_marker()) == ("o", "x")
    np.testing.assert_array_equal(asperities.get_ydata(), truth.get_ydata())
    assert (truth.get_xdata() > asperities.get_xdata()).all()
    assert {"asperities", "boundary elements"} < set(legend(figure))


def with_variants(name, *variants):
    """Return labels and runs of a study, once for each of these surfaces."""
    return [(labels._replace(surface=each), run) for each in variants for labels, run in study(name, seeds=(1,))]


def hursts(*variants):
    """Return the Hurst exponents in the names of variants, as a varied parameter."""
    return {"hurst": ("surface", "1", {each: float(each.partition("hurst")[2][:3]) for each in variants})}


def test_surfaces_with_the_same_varied_parameters_have_their_names_in_legends_and_titles():
    # Of the two varied parameters, the dataset has one as a coordinate.
    variants = [f"scan-hurst{hurst}-grid{grid}" for hurst in (0.6, 0.9) for grid in (48, 96)]
    tree = campaign_tree(with_variants("one", *variants), varied={"one": hursts(*variants)})
    assert set(variants) < set(legend(against_parameter.pull_off(tree, study="one")))
    assert variants[1] in loops.loops(tree, study="one", surface=variants[1]).get_suptitle()
    # Of two original surfaces, each is alone in its study, but they are in the same figure.
    one, *others = "scan-hurst0.6", "dust-hurst0.6", "dust-hurst0.9"
    varied = {"one": hursts(one), "two": hursts(*others)}
    tree = campaign_tree(with_variants("one", one) + with_variants("two", *others), varied=varied)
    both = legend(against_parameter.pull_off(tree, study="one", load_studies=["two"]))
    assert [name for name in both if "0.6" in name or "0.9" in name] == [one, "dust-hurst0.6", "$H$ = 0.9"]
    assert {"$H$ = 0.6", "$H$ = 0.9"} < set(legend(against_parameter.pull_off(tree, study="two")))


def test_the_label_of_a_surface_has_no_parameter_that_the_surface_lacks():
    for first, expected in (("rough", "scan, "), ("scan", "")):
        surfaces = first, "scan-cutoff4um"
        varied = {"one": {"cutoff": ("surface", "m", {surfaces[1]: 4e-6})}}
        figure = against_parameter.pull_off(campaign_tree(with_variants("one", *surfaces), varied=varied), study="one")
        assert {first, f"{expected}{symbol_of('cutoff')} = 4 µm"} < set(legend(figure))


def test_a_straight_line_and_a_power_law_are_found_exactly():
    x = np.array([0.01, 0.03, 0.04, 0.1])
    values, r_squared, _ = fit_line(x, 0.7 * x - 0.002, np.array([0.0, 1.0]))
    assert (*values, r_squared) == pytest.approx((-0.002, 0.698, 1.0), rel=1e-12)
    assert fit_line(x, 3 * x**1.3, x)[2] == pytest.approx(1.3, rel=1e-12)
    y = np.array([0.1, 0.5, 0.2, 0.9])
    assert fit_line(x, y, x)[1] == pytest.approx(np.corrcoef(x, y)[0, 1] ** 2, rel=1e-12)
    assert np.isnan(fit_line(x, y - 0.3, x)[2])


def linear_campaign(slope=0.4, offset=1e-3, scale=2e-5):
    """Studies of different loads; the loss of their runs is a straight line of the area, another one for every seed."""
    runs = []
    for name, steps in DEPTHS.items():
        for labels, run in study(name, steps=steps):
            adhesive = float(run["surface_energy"]) > 0
            loss = slope * float(run["largest_contact_area_fraction"]) + offset + (labels.seed - 1.5) * scale
            runs.append((labels, run.assign(hysteresis_loss_over_surface_energy=loss if adhesive else 0.0)))
    return campaign_tree(runs)


def test_fig15_fits_a_straight_line_to_runs_that_differ_in_load_only():
    figure = against_parameter.loss(linear_campaign(), studies=["middle", "hard", "gentle"])
    axes = figure.axes[0]
    (points,) = axes.containers
    x, y = points[0].get_data()
    own = [
        np.mean([float(loop(seed=seed, steps=steps)["largest_contact_area_fraction"]) for seed in (1, 2)])
        for steps in DEPTHS.values()
    ]
    np.testing.assert_allclose(x, sorted(own), rtol=1e-12)
    np.testing.assert_allclose(y, 0.4 * x + 1e-3, rtol=1e-12)
    (line,) = [each for each in axes.get_lines() if len(each.get_xdata()) > 10]
    np.testing.assert_allclose(line.get_ydata(), 0.4 * line.get_xdata() + 1e-3, rtol=1e-9)
    assert line.get_xdata()[0] == pytest.approx(x[0]) and line.get_xdata()[-1] == pytest.approx(x[-1])
    assert line.get_color() == points[0].get_color()
    exponent = np.polyfit(np.log(x), np.log(y), 1)[0]
    assert any(f"r^2$ = 1.0000, exponent {exponent:.2f}" in name for name in legend(figure))


def test_fig15_fits_nothing_through_two_loads_or_other_seeds(tree):
    assert not any("r^2" in name for name in legend(against_parameter.loss(tree, studies=["gentle", "hard"])))
    runs = [run for k, (name, steps) in enumerate(DEPTHS.items(), 1) for run in study(name, seeds=(k,), steps=steps)]
    figure = against_parameter.loss(campaign_tree(runs), studies=list(DEPTHS))
    assert not any("r^2" in name for name in legend(figure))
    assert np.count_nonzero(np.isfinite(figure.axes[0].containers[0][0].get_xdata())) == 3


def test_fig15_names_the_crosses_of_boundary_elements():
    stickier = [
        (labels._replace(material="stickier"), run.assign(surface_energy=2 * run["surface_energy"]))
        for labels, run in study("one", materials=("soft",), slopes=(1.0, 0.5), seeds=(1,))
    ]
    runs = study("one", materials=("soft",), slopes=(1.0, 0.5), seeds=(1,)) + stickier
    # One contact is solved only with boundary elements.
    truths = [(labels._replace(model=REFERENCE_MODEL), run) for labels, run in runs]
    figure = against_parameter.loss(campaign_tree(runs[:-1] + truths), studies=["one"])
    entries = dict(zip(legend(figure), figure.legends[0].get_lines(), strict=False))
    shapes = [entries[f"{REFERENCE_NAME}, {slope_label(slope)}"].get_marker() for slope in (1.0, 0.5)]
    crosses = [line for line in figure.axes[0].get_lines() if line.get_marker() in shapes and len(line.get_xdata())]
    assert len(set(shapes)) == 2 and len(crosses) == 4
    # The contact without asperities has an entry of its own, so that the legend names all colours.
    assert sum("gamma" in name for name in entries) == 4


def points(*runs):
    """A line of points, from x and y of every seed."""
    return Points(
        [ContactRuns(None, {seed: {"x": x, "y": y} for seed, (x, y) in own.items()}, len(own)) for own in runs],
        "x",
        "y",
    )


def test_points_of_a_line_are_means_over_the_seeds_that_all_have():
    line = points({1: (2.0, 10.0), 2: (4.0, 30.0), 3: (9.0, 99.0)}, {2: (1.0, 6.0), 1: (1.0, 2.0)})
    assert line.same_seeds and np.isfinite(line.members).all()
    assert line.means.tolist() == [[1, 3], [4, 20]]
    apart = points({1: (2.0, 10.0)}, {2: (3.0, 8.0)})
    assert not apart.same_seeds and apart.means[1].tolist() == [10, 8]


def test_fig15_parts_are_of_either_sign_and_make_up_the_whole(tree):
    run = loop()
    parts = {"loss_by_jump_in": 3.0, "loss_by_jump_off": 1.0, "loss_by_coalescence": -1.0, "loss_unattributed": 0.0}
    line = [{1: run.assign(parts), 2: run.assign(parts)}, {1: run.assign(largest_reduced_pressure=-1.0)}]
    found = shares([ContactRuns(None, runs, 2) for runs in line])
    assert list(found.values()) == pytest.approx([0.6, 0.2, -0.2, 0, 0, 0])
    figure = against_parameter.loss(one(**parts), studies=["one"])
    heights = sorted((bar.get_y(), bar.get_y() + bar.get_height()) for bar in figure.axes[1].patches)
    np.testing.assert_allclose(heights, [(0, -20), (0, 60), (60, 80)])
    assert {"jump-in", "jump-off", "coalescence"} <= set(legend(figure))
    assert not {"unattributed", "jumps at constant load"} & set(legend(figure))

    # Of these loops everything is explained by jumps off, at the largest load of every line.
    figure = against_parameter.loss(tree, studies=list(DEPTHS))
    assert [bar.get_y() + bar.get_height() for bar in figure.axes[1].patches] == pytest.approx([100])


def test_fig16_marks_where_and_counts_when(tree, surface):
    run = loop()
    figure = snap_map(tree, surface, "slopes")
    where, when = figure.axes[:2]
    formed, broke = marks(where)
    for line, kind in ((formed, 0), (broke, 1)):
        own = run["event_kind"].values == kind
        np.testing.assert_allclose(line.get_xdata(), 1e6 * run["event_x"].values[own])
        np.testing.assert_allclose(line.get_ydata(), 1e6 * run["event_y"].values[own])
    count = len(formed.get_xdata())
    assert count > 0
    assert {f"spot formed ({count})", f"spot broken ({count})", "loading", "unloading"} == set(legend(figure))
    assert (formed.get_markerfacecolor(), broke.get_markerfacecolor()) == (formed.get_markeredgecolor(), "none")
    solid, dashed = (lines[0] for lines in curves(when))
    for line, kind in ((solid, 0), (dashed, 1)):
        u, so_far = line.get_data()
        assert so_far[0] == 0 and so_far[-1] == count
        reached = run["event_separation"].values[run["event_kind"].values == kind] / float(run["rms_height"])
        np.testing.assert_allclose(np.sort(u[1:]), np.sort(reached))
    assert to_hex(solid.get_color()) == to_hex(formed.get_markeredgecolor())
    assert to_hex(dashed.get_color()) == to_hex(broke.get_markeredgecolor())
    np.testing.assert_allclose(
        where.get_images()[0].get_array()[:-1, :-1].std() / 1e6, float(run["rms_height"]), rtol=1e-6
    )


def test_fig16_shows_unions_and_their_undoing(surface):
    run = loop()
    kinds = run["event_kind"].values.copy()
    kinds[5:8] += 2
    kinds[-2] += 2
    changed = one(event_kind=("event", kinds, run["event_kind"].attrs))
    names = legend(snap_map(changed, surface))
    half = len(kinds) // 2
    expected = {f"spot formed ({half - 3})", f"spot broken ({half - 1})", "union (3)", "union undone (1)"}
    assert expected <= set(names)


# --- more than one cycle ----------------------------------------------------------------------------------------


def two_cycles():
    """A deep cycle and then a shallow one, of the same asperities."""
    deep, shallow = (loop(steps=steps) for steps in (6, 4))
    steps, events = ([name for name in deep.variables if deep[name].dims == (dim,)] for dim in ("step", "event"))
    later = shallow.assign(leg=shallow["leg"] + 2, event_step=shallow["event_step"] + deep.sizes["step"])
    parts = [xr.concat([deep[names], later[names]], dim) for names, dim in ((steps, "step"), (events, "event"))]
    whole = xr.merge(
        [shallow.drop_dims(["step", "event"]), *(part.drop_vars("step", errors="ignore") for part in parts)]
    )
    whole = whole.assign_coords(step=("step", np.arange(whole.sizes["step"]), deep["step"].attrs))
    ((labels, _),) = study("one", materials=("soft",), seeds=(1,))
    return campaign_tree([(labels, whole)]), deep, shallow


def test_figures_of_several_cycles_show_the_first_loading_and_the_last_unloading(surface):
    tree, deep, shallow = two_cycles()
    axes = loops.loops(tree, study="one").axes[0]
    assert [len(lines) for lines in curves(axes)] == [2, 2]
    (pull_off,) = marks(axes)
    assert pull_off.get_ydata()[0] == shallow["reduced_pressure"].values.min() > deep["reduced_pressure"].values.min()
    formed, broke = (np.count_nonzero(run["event_kind"] == kind) for run, kind in ((deep, 0), (shallow, 1)))
    assert formed > broke > 0
    names = legend(snap_map(tree, surface))
    assert {f"spot formed ({formed})", f"spot broken ({broke})"} <= set(names)
    words = "this is the loss of all loadings and unloadings, inner loops included"
    assert words in caption_of(draw(against_parameter.loss, tree, "one"))
    assert words not in caption_of(draw(against_parameter.loss, one(), "one"))


def test_boundary_elements_are_drawn_where_no_run_with_asperities_unloads():
    ((labels, run),) = study("one", materials=("soft",), seeds=(1,))
    first = run.isel(step=run["leg"].values == 0).drop_vars(
        [name for name in run if "loss" in name or "pull_off" in name]
    )
    first = first.assign_attrs(beyond_model="the contact area is too large")
    truth = run.assign_attrs(contact_model=REFERENCE_MODEL)
    tree = campaign_tree([(labels, first), (labels._replace(model=REFERENCE_MODEL), truth)])
    figure = draw(against_parameter.pull_off, tree, "one")
    assert figure.axes[0].get_title(loc="right") == "boundary elements"
    (line, *_) = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    assert 1e3 * line.get_ydata()[0] == pytest.approx(float(run["pull_off_pressure"]))  # kPa
    assert len(curves(loops.loops(tree, study="one").axes[0])[1]) == 1


# --- all of them ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("module", (against_parameter.pull_off, against_parameter.loss), ids=("fig14", "fig15"))
def test_runs_in_contact_at_the_end_have_no_pull_off_and_no_loss(module):
    scalars = ["hysteresis_loss", "hysteresis_loss_over_surface_energy", "pull_off_pressure"]
    ((labels, run),) = study("one", materials=("soft",), seeds=(1,))
    partial = campaign_tree([(labels, run.isel(step=slice(0, -3)).drop_vars(scalars))])
    with pytest.raises(ValueError, match="one: no run was unloaded to complete separation"):
        draw(module, partial, "one")
    assert len(curves(loops.loops(partial, study="one").axes[0])[1]) == 1
    for draws in (module, loops.loops):
        with pytest.raises(ValueError, match=r"single: no run (reached its unloading|was unloaded)"):
            draw(draws, small.tree(), "single")


def test_legends_name_both_works_of_adhesion():
    energy = loop()["surface_energy"]
    figure = loops.loops(one(receding_energy=3 * energy), study="one")
    works = rf"$\Delta\gamma$ = {float(energy) * 1e3:g} mJ/m², receding = {float(energy) * 3e3:g} mJ/m²"
    assert any(works in name for name in legend(figure))
    assert not any("receding" in name for name in legend(loops.loops(one(), study="one")))
