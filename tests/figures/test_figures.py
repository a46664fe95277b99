"""Figures of small and unusual campaigns: what they show, their messages, and their bytes."""

import compared_campaign as compared
import cyclic_campaign as cyclic
import matplotlib as mpl
import numpy as np
import pytest
import small_campaign as small
import xarray as xr
from drawn import legend, lines_of
from matplotlib.colors import to_hex, to_rgb

import icha
from icha.analysis.model_error import jaccard
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import RunLabels
from icha.datasets.quantities import label_of
from icha.figures import against_load, against_parameter, at_one_load, contact_maps, errors, one_asperity
from icha.figures.drawn import caption_of
from icha.figures.looks import material_colours
from icha.figures.maps import average_blocks, wrap_circles
from icha.figures.measured import read_measurements
from icha.figures.select import NothingToDraw, branches, path_steps, select_runs
from icha.figures.style import interfaces_of, material_labels, save
from icha.references.persson import persson_pressure_density
from icha.references.theories import reference_dataset
from icha.surfaces.moments import spectral_moments
from icha.uncertainty.ensembles import ensemble

LABELS = RunLabels("one", "asperities", "rough", 1, 1.0, "soft")
KIND = "reduced_pressure"


@pytest.fixture(autouse=True)
def densities_of_few_patches(monkeypatch):
    """The small surfaces of these tests have few patches."""
    monkeypatch.setattr(at_one_load, "_FEWEST_BINS", 1)


def truth(area=1.5):
    """Return boundary elements beside the run of figure 4, with contact shifted by two nodes."""
    found = compared.own_patches(compared.runs()[LABELS], area=area)
    return found.assign(contact_map=0.75 * found["contact_map"].roll(column=2))


def test_same_bytes_twice_whatever_the_users_settings(tmp_path):
    save(one_asperity.jkr(), tmp_path / "a.png", tmp_path / "a.pdf")
    with mpl.rc_context({"font.size": 30, "lines.linewidth": 9, "axes.grid": True, "savefig.dpi": 33}):
        save(one_asperity.jkr(), tmp_path / "b.png", tmp_path / "b.pdf")
    for kind in ("png", "pdf"):
        one, two = ((tmp_path / f"{each}.{kind}").read_bytes() for each in "ab")
        assert one == two
        assert b"CreationDate" not in one and len(one) > 5000
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.pdf", "a.png", "b.pdf", "b.png"]


def test_fig1_passes_through_the_known_points():
    axes = one_asperity.jkr(tabor_parameter=3.0).axes[0]
    marks = {text.get_text(): text.xy for text in axes.texts if text.get_text() in "ABC" and text.get_text()}
    assert marks["C"] == pytest.approx((-1.608772, -5 * np.pi / 6), abs=1e-5)
    assert marks["B"] == pytest.approx((-0.773417, -1.5 * np.pi), abs=1e-5)
    assert marks["A"] == pytest.approx(((1 - 2.641 * 3 ** (3 / 7)) / 3, 0), abs=1e-9)


def test_branches_begin_where_the_one_before_ends():
    run = cyclic.run(between=2)
    (_, loading), (_, unloading) = branches(run)
    assert loading["step"].values[-1] == unloading["step"].values[0] and set(unloading["leg"].values) == {0, 1}
    assert loading.sizes["step"] + unloading.sizes["step"] == run.sizes["step"] + 1
    again = xr.concat([run, run.assign(leg=run["leg"] + 2)], "step", data_vars="minimal")
    assert [name for name, _ in branches(again)] == ["loading", "unloading"] * 2
    assert [name for name, _ in branches(small.run())] == ["loading"]


def test_the_state_of_pull_off_can_be_drawn():
    run = cyclic.run(between=2).copy(deep=True)
    run["snapshot_kind"].values[1] = "pull_off"
    run["snapshot_target"].values[1] = 0.0
    run["snapshot_step"].values[1] = run.sizes["step"] - 2
    tree = campaign_tree([(LABELS, run)])
    figure = at_one_load.distributions(tree, study="one", kind="pull_off")
    assert any("pull-off" in axes.get_title(loc="right") for axes in figure.axes)
    assert "Persson" not in legend(figure)


def test_fig3_points_keep_the_probability():
    run = small.run()
    for at, step in enumerate(run["snapshot_step"].values.astype(int)):
        edges = run["gap_bin_edges"].values / float(run["rms_height"])
        u, (density,) = at_one_load.gap_densities([(run, at)])
        assert np.all(np.diff(u) > 0) and np.all(density > 0)
        assert edges[1] < u[0] and u[-1] < edges[-1]
        p, (density,) = at_one_load.pressure_densities([(run, at)])
        width = np.diff(run["pressure_bin_edges"].values) / float(run["contact_modulus"] * run["rms_slope"])
        filled = width[run["pressure_density"].values[at] > 0]
        assert np.sum(density * filled) == pytest.approx(run["contact_area_fraction"].values[step], rel=1e-9)
        assert p.min() < 0, "adhesion pulls at the edges"
    assert at_one_load.pressure_densities([(small.run(material="hertz"), 0)])[0].min() > 0


def test_the_singular_tail_is_that_of_jkr_spots():
    """The JKR pressure at the edge of a spot tends to that of its stress intensity, along its circumference."""
    run = small.run()
    unit = float(run["contact_modulus"]) * float(run["rms_slope"])
    run = run.assign(spot_perimeter=2 * np.pi * run["spot_radius"], resolved_tension=100 * unit)
    p, tail = at_one_load.singular_tail([(run, 0)], -500)
    edges = run["pressure_bin_edges"].values / unit
    middle = -np.sqrt(np.abs(edges[1:] * edges[:-1]))
    # The first bin also counts all lower pressures.
    far = (edges[:-1] > -480) & (edges[1:] < -100)
    expected = np.exp(np.interp(np.log(-middle[far]), np.log(-p), np.log(tail)))
    np.testing.assert_allclose(run["pressure_density"].values[0][far] * unit, expected, rtol=0.02)


def test_fig4_draws_means_of_large_topographies():
    n = 3000
    heights = np.add.outer(np.arange(n) ** 2.0, np.arange(n) * 10.0)
    drawn = average_blocks(heights)
    assert drawn.shape == (1024, 1024) and average_blocks(heights[:7, :7]).shape == (7, 7)
    # A block of nodes from 3000 k/1024 to the next.
    rows, columns = np.arange(2929, 2932), np.arange(1464, 1467)
    assert drawn[1000, 500] == pytest.approx(np.add.outer(rows**2.0, columns * 10.0).mean())


def test_circles_continue_across_borders():
    circles = list(wrap_circles([0.02, 0.5], [0.97, 0.5], [0.1, 0.1], 1.0, "periodic"))
    centres = sorted((round(x, 9), round(y, 9)) for x, y, _ in circles)
    assert centres == [(0.02, -0.03), (0.02, 0.97), (0.5, 0.5), (1.02, -0.03), (1.02, 0.97)]
    # A free square has no opposite border.
    assert len(wrap_circles([0.02, 0.5], [0.97, 0.5], [0.1, 0.1], 1.0, "free")) == 2


def test_fig5_draws_measurements_over_the_curves(tmp_path):
    (tmp_path / "one.csv").write_text("p, a\n1, 0.2\n10, 2\n20, 4\n")
    (tmp_path / "other.csv").write_text("p, a\n1e-3, 3e-3\n1e-2, 3e-2\n2e-2, 5e-2\n")
    known = {"label": "Someone, 2020", "citation": "Someone", "quantities": ["load", "area"]}
    measured = {"columns": {"p": 1e3, "a": 0.01}, "contact_modulus": 5e6, "material": "soft", "rms_slope": 0.2}
    without_slope = {"columns": {"p": 1.0, "a": 1.0}, "material": None, "label": "Another", "citation": "Another"}
    tables = [tmp_path / "one.csv", tmp_path / "other.csv"]
    measurements = read_measurements(tables, [known | measured, known | without_slope])
    figure = against_load.multi_slope(small.tree(), study="slopes", measurements=measurements)
    assert "measurements: Someone, 2020 (Someone); Another (Another)." in caption_of(figure)
    left, right = figure.axes
    found = {line.get_label(): line for line in right.get_lines() if not line.get_label().startswith("_")}
    assert set(found) == {"Someone, 2020", "Another"}
    np.testing.assert_allclose(found["Someone, 2020"].get_xydata(), [(1e-3, 2), (1e-2, 2), (2e-2, 2)])
    np.testing.assert_allclose(found["Another"].get_ydata(), [3, 3, 2.5])
    shifted = [line for line in left.get_lines() if len(line.get_xdata()) == 3]
    assert len(shifted) == 1
    np.testing.assert_allclose(shifted[0].get_xdata(), [2e-4, 2e-3, 4e-3])


def test_fig7_is_the_slope_of_fig2_whatever_the_rms_slope():
    # Without adhesion p* against u/h_rms is one curve for all slopes of a topography, and so is its derivative.
    one, other = (
        dict(zip(*np.round(against_load.STIFFNESS.points(small.run(rms_slope=s, material="hertz")), 12), strict=True))
        for s in (1.0, 0.2)
    )
    common = sorted(set(one) & set(other))
    assert len(common) >= len(small.PRESSURES)
    np.testing.assert_allclose([one[p] for p in common], [other[p] for p in common], rtol=1e-6)


def test_fig8_density_and_counts_of_a_known_distribution():
    # Quantiles of n(A) ~ A^-2 between 1 and 1000, on a nominal area of 50.
    count, nominal = 20000, 50.0
    area = np.sort(1 / (1 - (np.arange(count) + 0.5) / count * (1 - 1e-3)))
    at, (density,) = at_one_load.patch_density([area], nominal)
    exact = count / nominal / (1 - 1e-3) / at**2
    np.testing.assert_allclose(density[at < 100], exact[at < 100], rtol=0.03)
    at, (above,) = at_one_load.patches_above([area], nominal)
    assert at[0] == area[0] and at[-1] == area[-1] and len(at) <= 300
    np.testing.assert_allclose(above * nominal, [np.count_nonzero(area >= a) for a in at])
    for few in ([], [2.0], [1.0, 2.0, 5.0]):
        at, (density,) = at_one_load.patch_density([np.array(few)], 10.0)
        assert len(at) == min(len(few), 1) and np.all(np.isfinite(density))
        at, (above,) = at_one_load.patches_above([np.array(few)], 10.0)
        assert len(at) == len(above) == len(few)


def test_fig9_joins_runs_that_differ_in_range_and_shows_the_adhesionless_one(monkeypatch):
    ranges = {"long": 4e-9, "short": 1e-9, "bare": 2e-9}
    runs = {}
    for name, reach in ranges.items():
        material = icha.Material(25e6, 0.0 if name == "bare" else 0.05, reach)
        path = icha.Path(reduced_pressures=[1e-2], max_step=0.2)
        runs[name] = icha.simulate(small.surface(), material, path, seed=1)
    tree = campaign_tree([(RunLabels("tabor", "asperities", "rough", 1, 1.0, name), run) for name, run in runs.items()])
    left, right = against_parameter.tabor(tree, study="tabor").axes
    for axes, name in ((left, "contact_area_fraction"), (right, "reduced_separation")):
        curve, bare = axes.get_lines()
        expected = [(float(run["tabor_parameter"]), run[name].values[-1]) for run in (runs["long"], runs["short"])]
        np.testing.assert_array_equal(curve.get_xydata(), expected)
        assert set(bare.get_ydata()) == {float(runs["bare"][name].values[-1])}
    assert curve.get_xdata()[1] == pytest.approx(4 * curve.get_xdata()[0])
    monkeypatch.setattr(against_parameter, "_TABOR_SPAN", 3.9)
    assert (left.get_xscale(), against_parameter.tabor(tree, study="tabor").axes[0].get_xscale()) == ("linear", "log")
    both = [RunLabels("tabor", model, "rough", 1, 1.0, "short") for model in ("asperities", "boundary_elements")]
    both = campaign_tree([(both[0], runs["short"]), (both[1], runs["short"])])
    caption = caption_of(against_parameter.tabor(both, study="tabor"))
    assert "asperities; boundary elements of the study are left out" in caption
    assert "Curves are of asperities." in caption_of(left.figure)
    # The range is along the axis, and not in the name.
    assert len(legend(left.figure)) == 2 and not any("range" in name for name in legend(left.figure))
    tree = campaign_tree([(RunLabels("tabor", "asperities", "rough", 1, 1.0, "bare"), runs["bare"])])
    with pytest.raises(ValueError, match="study tabor: no run with adhesion is complete"):
        against_parameter.tabor(tree, study="tabor")


def test_fig2_draws_theories_of_separate_summits_where_there_are_any():
    moments = spectral_moments(small.surface())
    adhesive = {(1.0, "soft"): small.MATERIALS["soft"], (1.0, "other"): icha.Material(1e6, 0.02, 2e-9)}
    references = reference_dataset(small.SPECTRUM, moments, adhesive)
    figure = against_load.area_and_gap(compared.tree_at_finite_range(), references, study="one")
    names = legend(figure)
    assert {"Greenwood & Williamson", "Fuller & Tabor", "Yang & Persson", "boundary elements at finite range"} <= set(
        names
    )
    assert len(names) == len(set(names))
    # Published points are those of another surface.
    assert "GFMD, no adhesion" not in names
    published = icha.SelfAffineSpectrum(period=1e-4, rolloff_wavelength=1e-4, short_wavelength=1e-6, hurst=0.8)
    other = against_load.area_and_gap(small.tree(), reference_dataset(published), study="slopes")
    assert "GFMD, no adhesion" in legend(other)
    for axes, name in zip(figure.axes[:2], ("summit_area_fraction", "reduced_separation"), strict=True):
        drawn = [line for line in axes.get_lines() if line.get_linewidth() == 0.8 and len(line.get_xdata())]
        assert len(drawn) == 2  # Greenwood & Williamson, and Fuller & Tabor of the study's material
        values = references[name if name in references else f"greenwood_williamson_{name}"].values
        load = references["greenwood_williamson_reduced_pressure"].values
        np.testing.assert_array_equal(drawn[0].get_ydata(), values / load if axes is figure.axes[0] else values)
        np.testing.assert_array_equal(drawn[0].get_xdata(), load)
        assert np.all(drawn[1].get_xdata() > 0)
        runs = {line.get_markeredgecolor() for line in axes.get_lines() if line.get_marker() not in ("1", "x", "None")}
        assert drawn[1].get_color() in runs


def labels_of(**materials):
    """Return the labels of materials in one study, from their differences to a half-space without a map."""
    usual = {"contact_modulus": 2e6, "surface_energy": 5e-3, "receding_energy": None, "interaction_range": 5e-10}
    usual |= {"flaw_radius": 0.0, "layer_thickness": np.nan, "layer_poisson_ratio": np.nan, "adhesion_map_kind": ""}
    values = [usual | given for given in materials.values()]
    for each in values:
        each["receding_energy"] = each["receding_energy"] or each["surface_energy"]
    variables = {name: ("material", [each[name] for each in values]) for name in usual}
    found = material_labels(interfaces_of([xr.Dataset(variables, {"material": [*materials]})]))
    return [found[name].replace(r"$E^{\ast}$ = 2 MPa, $\Delta\gamma$ = 5 mJ/m²", "usual") for name in materials]


def layer(thickness, poisson_ratio=0.5, **further):
    return {"layer_thickness": thickness, "layer_poisson_ratio": poisson_ratio, **further}


def test_labels_name_what_distinguishes_materials():
    assert labels_of(half={}) == ["usual"]
    found = labels_of(half={}, thin=layer(1e-5), stiff=layer(1e-5, 0.3), flawed={"flaw_radius": 1e-6})
    expected = ["", ", thickness 10 µm, Poisson ratio 0.5", ", thickness 10 µm, Poisson ratio 0.3"]
    assert found == [f"usual{each}" for each in [*expected, ", flaw radius 1 µm"]]
    found = labels_of(half={}, long={"interaction_range": 2e-9}, directed={"receding_energy": 9e-3})
    assert found == ["usual, range 500 pm", "usual, range 2 nm", "usual, receding = 9 mJ/m²"]
    found = labels_of(one={"adhesion_map_kind": "stripes"}, half={}, another={"adhesion_map_kind": "map"})
    assert found[1] == "usual" and found[0].endswith(r"mean $\Delta\gamma$ = 5 mJ/m² (stripes)")
    assert found[2].endswith("(map)")
    # A map and another map of the same mean have their names, because no number distinguishes them.
    maps = labels_of(wide={"adhesion_map_kind": "map"}, narrow={"adhesion_map_kind": "map"})
    assert [label.rpartition(", ")[2] for label in maps] == ["wide", "narrow"]


def test_labels_of_materials_without_adhesion_have_no_range_of_attraction():
    bare = {"surface_energy": 0.0}
    found = labels_of(**{f"t{thickness:g}": layer(thickness, **bare) for thickness in (3e-6, 1e-5, 1e-4)})
    assert [label.partition("= 0")[2] for label in found] == [f", thickness {each} µm" for each in (3, 10, 100)]


def with_layers(runs):
    """Return the runs as if their material were a layer."""
    return {labels: run.assign(layer_thickness=1e-5, layer_poisson_ratio=0.5) for labels, run in runs.items()}


def test_figures_name_layers_and_draw_theories_of_half_spaces_with_a_sentence():
    runs = {labels: run for labels, run in compared.patches() if labels.seed == 1}
    films = {labels._replace(material=f"{labels.material}_film"): run for labels, run in with_layers(runs).items()}
    tree = campaign_tree([*runs.items(), *films.items()])
    theories = reference_dataset(small.SPECTRUM, spectral_moments(small.surface()), {})
    sentence = "do not hold for runs on a layer"
    for draw in (against_load.area_and_gap, against_load.stiffness):
        assert sentence in caption_of(draw(tree, theories, study="one"))
        assert sentence not in caption_of(draw(campaign_tree(runs.items()), theories, study="one"))
    physical = against_load.area_and_gap(tree, theories, study="one", units="physical")
    assert sentence in caption_of(physical) and "Persson" in legend(physical)
    figure = at_one_load.distributions(tree, study="one")
    names = legend(figure)
    assert sum("thickness 10 µm" in name for name in names) == 2 and "Persson" in names
    assert sentence in caption_of(figure)
    assert sentence not in caption_of(at_one_load.distributions(campaign_tree(films.items()), study="one"))


def test_fig9_draws_a_layer_and_a_half_space_as_two_lines():
    material = icha.Material(25e6, 0.05, 1e-9)
    run = icha.simulate(small.surface(), material, icha.Path(reduced_pressures=[1e-2], max_step=0.2), seed=1)
    labels = RunLabels("tabor", "asperities", "rough", 1, 1.0, "half")
    tree = campaign_tree([(labels, run), *with_layers({labels._replace(material="film"): run}).items()])
    figure = against_parameter.tabor(tree, study="tabor")
    assert len(lines_of(figure.axes[0])) == 2 and sum("thickness" in name for name in legend(figure)) == 1


def test_fig3_shows_boundary_elements_of_the_same_state():
    tree, colours = compared.tree_of_both(), material_colours(compared.tree())
    axes = at_one_load.distributions(tree, study="one", target=3e-3).axes
    (left, *_), (right, *_) = (lines_of(panel, "+") for panel in axes)
    members = [(run, 0) for labels, run in compared.runs().items() if labels.material == "soft"]
    u, densities = at_one_load.gap_densities(members)
    np.testing.assert_allclose(left.get_xydata(), np.transpose([u, densities.mean(axis=0)]), rtol=1e-9)
    assert right.get_xdata().min() < 0 and left.get_color() == right.get_color() == colours["soft"]


def test_fig3_draws_persson_at_the_load_of_each_run():
    """At one area, runs with and without adhesion have different loads; the pressure has the load as its integral."""
    figure = at_one_load.distributions(small.tree(), study="slopes", kind="area_fraction", target=0.015)
    drawn = [points for _, points in figure.recorded if points["curve"] == "Persson"]
    for points in drawn:
        run = small.run(1, points["rms_slope"], points["material"])
        at = int(np.flatnonzero(run["snapshot_kind"] == "area_fraction")[0])
        load = float(run["reduced_pressure"][int(run["snapshot_step"][at])])
        wide = np.linspace(0, 5, 20000)
        density = persson_pressure_density(wide[1:], load)
        assert np.trapezoid(wide[1:] * density, wide[1:]) == pytest.approx(load, rel=1e-3)
        np.testing.assert_allclose(points["y"], persson_pressure_density(points["x"], load), rtol=1e-9)
    assert len({points["material"] for points in drawn}) == 2


def test_steps_without_a_logarithm_are_not_on_logarithmic_axes():
    run = small.run().copy(deep=True)
    run["contact_stiffness"].values[0] *= -1
    run["reduced_pressure"].values[1] = -1e-4
    p, stiffness = against_load.STIFFNESS.points(run)
    assert len(p) == len(stiffness) == run.sizes["step"] - 2
    run = small.run().copy(deep=True)
    run["step_target"][0], run["reduced_pressure"][0] = 0.0, 1e-13
    assert path_steps(run).sizes["step"] == path_steps(small.run()).sizes["step"] - 1


def test_fig4_puts_the_contact_of_boundary_elements_beside_the_spots(surface):
    beside, run = truth(), compared.runs()[LABELS]
    figure = contact_maps.contact_map(compared.tree(), surface, beside, run=LABELS, target=1e-2, kind=KIND)
    assert len(figure.axes) == 5  # four panels and the scale of heights
    area = 1.5 * float(run["contact_area_fraction"].values[-1])
    assert figure.axes[1].get_title(loc="right") == f"boundary elements, $A/A_0$ = {area:.3f}"
    drawn = figure.axes[1].get_images()[1].get_array()[:-1, :-1]
    np.testing.assert_array_equal(drawn, beside["contact_map"].values[1])
    contact = beside["contact_map"].values[1] >= 0.5
    covered = np.roll(contact, -2, axis=1)
    states = figure.axes[3].get_images()[0].get_array()[:-1, :-1]
    asperities, elements, both = (
        np.count_nonzero(np.all(states == to_rgb(colour), axis=-1)) for colour in ((0.9, 0.0, 0.05), "black", "0.72")
    )
    assert (both + asperities, both + elements) == (np.count_nonzero(covered), np.count_nonzero(contact))
    assert figure.axes[3].get_title(loc="right").endswith(f"{jaccard(covered, contact):.2f}")
    # If the path of boundary elements ended before, the spots stand alone.
    ended = contact_maps.contact_map(
        compared.tree(), surface, beside.isel(snapshot=[0]), run=LABELS, target=1e-2, kind=KIND
    )
    assert len(ended.axes) == 3


def test_fig5_marks_boundary_elements_of_the_study_or_of_another():
    runs = [(labels, run) for labels, run in small.runs() if labels.study == "slopes"]
    labels, run = runs[0]
    own = compared.own_patches(run, area=1.5)
    for study, options in (("slopes", {}), ("truth", {"boundary_elements": "truth"})):
        beside = labels._replace(study=study, model="boundary_elements")
        figure = against_load.multi_slope(campaign_tree([*runs, (beside, own)]), study="slopes", **options)
        for axes, factor in zip(figure.axes, (labels.rms_slope, 1.0), strict=True):
            (crosses,) = lines_of(axes, "+")
            np.testing.assert_allclose(crosses.get_xdata(), factor * np.array(small.PRESSURES), rtol=1e-6)
            areas = crosses.get_ydata() * (1.0 if axes is figure.axes[0] else np.array(small.PRESSURES))
            found = np.isclose(areas[:, None], own["contact_area_fraction"].values, rtol=1e-6)
            assert found.any(axis=1).all()
            drawn = {line.get_color() for line in axes.get_lines() if line.get_marker() not in ("+", "None")}
            assert crosses.get_color() in drawn
        words = dict(zip(legend(figure), figure.legends[0].legend_handles, strict=True))
        (name,) = (each for each in words if each.startswith("boundary elements"))
        assert name.endswith(f"= {labels.rms_slope:g}") and words[name].get_marker() == "+"
    for other in ({"surface": "scan"}, {"material": "film"}, {"rms_slope": 0.1}):
        several = campaign_tree([*runs, (beside, own), (beside._replace(**other), own)])
        figure = against_load.multi_slope(several, study="slopes", **options)
        assert [len(lines_of(axes, "+")) for axes in figure.axes] == [1, 1], other
        assert "those of study truth on the same surfaces, slopes and materials" in caption_of(figure)


def test_fig10_shows_means_and_seeds_of_the_errors_in_per_cent():
    left, right = errors.model_error(compared.tree(), compared.errors(), study="one").axes
    expected = 100 * (1 / np.array(list(compared.AREA_FACTORS.values())) - 1)
    (adhesive, _, bars), (bare, _, _) = left.containers
    np.testing.assert_allclose(adhesive.get_ydata(), expected.mean())
    # Three seeds are too few for a confidence interval: the bars are their range.
    for (_, low), (_, high) in bars[0].get_segments():
        assert (low, high) == pytest.approx((expected.min(), expected.max()))
    assert "mean and range, n = 3" in legend(left.figure)
    np.testing.assert_allclose(bare.get_ydata(), -20)
    np.testing.assert_allclose(right.containers[1][0].get_ydata(), 25)
    np.testing.assert_allclose(adhesive.get_xdata(), compared.PRESSURES, rtol=0.03)
    assert any(np.all(np.asarray(line.get_ydata()) == 0) for line in left.get_lines())
    assert adhesive.get_markerfacecolor() != "white" and bare.get_markerfacecolor() == "white"


def test_only_complete_runs_are_drawn(surface):
    runs = [(labels, run) for labels, run in small.runs() if labels.study == "slopes"]
    ended = [(labels, run.assign_attrs(incomplete="no equilibrium at the third stop")) for labels, run in runs]
    tree = campaign_tree([ended[0], *runs[1:]])
    assert {labels for labels, _ in select_runs(tree, "slopes")} == {labels for labels, _ in runs[1:]}
    with pytest.raises(NothingToDraw, match="study slopes: no run is complete"):
        against_load.multi_slope(campaign_tree(ended), study="slopes")
    with pytest.raises(NothingToDraw, match="slopes/rough/seed1/slope1/soft: this run is not complete"):
        contact_maps.contact_map(tree, surface, run=ended[0][0])
    with pytest.raises(NothingToDraw, match="no complete run has material steel; complete runs have material soft"):
        contact_maps.spots_by_slope(small.tree(), study="slopes", material="steel")
    empty = {
        f"/{name}": node.to_dataset().map(lambda each: each * np.nan if each.dtype.kind == "f" else each)
        for name, node in compared.errors().children.items()
    }
    with pytest.raises(NothingToDraw, match="study one: no run that was compared with boundary elements is complete"):
        errors.distribution_error(compared.tree(), xr.DataTree.from_dict(empty), study="one")


# --- ensembles --------------------------------------------------------------------------------------------------


def shaded(axes):
    """The edges of the bands in an axes, lower and upper, by their colour."""
    found = {}
    for band in axes.collections:
        x, y = band.get_paths()[0].vertices.T
        edges = [(y[x == at].min(), y[x == at].max()) for at in np.unique(x)]
        found[to_hex(band.get_facecolor()[0])] = np.transpose(edges)
    return found


def test_fig2_shows_means_with_bands_that_stay_above_zero():
    seeds = campaign_tree((LABELS._replace(study="many", seed=k), small.run(k)) for k in range(1, 6))
    figure = against_load.area_and_gap(seeds, study="many")
    for axes, name in zip(figure.axes[:2], ("contact_area_fraction", "reduced_separation"), strict=True):
        (mean,) = [line for line in axes.get_lines() if len(line.get_xdata()) == len(small.PRESSURES)]
        ratio = axes is figure.axes[0]
        unit = np.array(small.PRESSURES) if ratio else 1.0
        over = ensemble([path_steps(small.run(k))[name].values / unit for k in range(1, 6)])
        np.testing.assert_allclose(mean.get_ydata(), over.mean, rtol=1e-9)
        (edges,) = shaded(axes).values()
        np.testing.assert_allclose(edges, over.band(positive=True), rtol=1e-9)
        assert np.all(edges > 0) and axes.get_yscale() == ("linear" if ratio else "log")
    assert legend(figure).count("mean and 95 % band, n = 5") == 1


def test_few_seeds_have_no_band_and_are_drawn_themselves():
    figure = against_load.area_and_gap(compared.tree(), study="one")
    for axes, name in zip(figure.axes[:2], ("contact_area_fraction", "reduced_separation"), strict=True):
        assert not shaded(axes)
        for material, colour in material_colours(compared.tree()).items():
            own = [run for labels, run in compared.runs().items() if labels.material == material]
            unit = np.array(compared.PRESSURES) if axes is figure.axes[0] else 1.0
            values = [path_steps(run)[name].values / unit for run in own]
            drawn = [line for line in axes.get_lines() if line.get_color() == colour]
            (mean,) = [line for line in drawn if line.get_marker() == "o"]
            np.testing.assert_allclose(mean.get_ydata(), np.mean(values, axis=0), rtol=1e-9)
            single = [line.get_ydata() for line in drawn if line.get_marker() == "None"]
            np.testing.assert_allclose(single, values, rtol=1e-9)
    names = legend(figure)
    assert names.count("single seeds beside their mean, n = 3") == 1 and not any("95" in name for name in names)


def test_fig2_shows_below_what_the_logarithmic_axes_hide():
    figure = against_load.area_and_gap(compared.tree_of_both(area=1.5, separation=0.9), study="one")
    for axes, factor in zip(figure.axes[2:], (1.5, 0.9), strict=True):
        means = lines_of(axes, "o")
        assert len(means) == 2 and "BEM" in axes.get_ylabel() and axes.get_yscale() == "linear"
        for line in means:
            np.testing.assert_allclose(line.get_ydata(), 100 * (1 / factor - 1), rtol=1e-9)
            np.testing.assert_allclose(line.get_xdata(), compared.PRESSURES, rtol=1e-9)
    assert len(against_load.area_and_gap(small.tree(), study="slopes").axes) == 2


def test_fig2_compares_models_at_equal_loads_whatever_their_stops():
    run = compared.runs()[LABELS]
    truth = compared.own_patches(run, area=1.5)
    truth["reduced_pressure"] = 1.1 * truth["reduced_pressure"]
    both = campaign_tree([(LABELS, run), (LABELS._replace(model="boundary_elements"), truth)])
    figure = against_load.area_and_gap(both, study="one")
    (crosses,) = lines_of(figure.axes[0], "+")
    np.testing.assert_allclose(crosses.get_xdata(), 1.1 * np.array(compared.PRESSURES), rtol=1e-9)
    # The lowest load lies below all of boundary elements; between two points logarithms are interpolated linearly.
    (line,) = lines_of(figure.axes[2], "o")
    area = path_steps(run)["contact_area_fraction"].values
    true_area = np.exp(np.interp(np.log(1e-2), np.log(crosses.get_xdata()), np.log(1.5 * area)))
    np.testing.assert_allclose(line.get_xydata(), [(1e-2, 100 * (area[1] / true_area - 1))], rtol=1e-6)


@pytest.mark.parametrize("module", [against_load.area_and_gap, at_one_load.patch_sizes])
def test_figures_of_boundary_elements_alone_call_them_so(module):
    figure = module(campaign_tree(compared.patches()), study="one")
    assert legend(figure).count("boundary elements") == 1 and "asperities" not in legend(figure)
    markers = {line.get_marker() for line in figure.axes[0].get_lines()}
    assert "+" in markers and "o" not in markers


def test_a_material_has_one_colour_and_a_model_one_marker_in_all_figures_of_a_campaign():
    # Another study names the materials in another order.
    first = [
        (RunLabels("first", *labels[1:]), run) for labels, run in compared.runs().items() if labels.material == "hertz"
    ]
    tree = campaign_tree([*first, *compared.runs().items(), *compared.patches(area=1.5)])
    error = compared.errors()
    colours = material_colours(tree)
    assert list(colours) == ["hertz", "soft"] and len(set(colours.values())) == 2
    for figure in (
        against_load.area_and_gap(tree, study="one"),
        at_one_load.patch_sizes(tree, study="one"),
        against_parameter.tabor(tree, study="one"),
        errors.model_error(tree, error, study="one"),
    ):
        adhesive = next(k for k, name in enumerate(legend(figure)) if "= 50 mJ/m²" in name)
        handle = figure.legends[0].legend_handles[adhesive]
        line = handle if hasattr(handle, "get_color") else handle.get_children()[0]
        assert to_hex(np.atleast_1d(line.get_color())[0]) == to_hex(colours["soft"])
        drawn = [line for line in figure.axes[0].get_lines() if line.get_color() == colours["soft"]]
        assert drawn and {line.get_marker() for line in drawn} <= {"o", "+", "1", ".", "_", "None", None}


def test_a_density_of_fewer_than_three_bins_is_not_drawn(monkeypatch):
    monkeypatch.setattr(at_one_load, "_FEWEST_BINS", 3)
    (alone,) = at_one_load.patch_sizes(small.tree(), study="single").axes
    assert alone.get_lines() and "patches larger" in alone.get_ylabel()
    assert "seed" not in alone.get_title(loc="right") and "A_0" in alone.get_title(loc="right")


def caption_of_fig2(tree, study):
    return caption_of(against_load.area_and_gap(tree, study=study))


def test_captions_state_only_what_the_figure_contains():
    tree = small.tree()
    bare = caption_of_fig2(tree, "slopes")
    assert "Results are means" not in bare and "Thin dashed" not in bare and "Theories" not in bare
    assert "Boundary elements" not in bare
    assert "(a) Contact area over load against the reduced pressure. (b) Mean separation against" in bare
    assert "Results are means over the seeds" in caption_of_fig2(tree, "single")
    both = caption_of_fig2(compared.tree_of_both(), "one")
    assert "Panels (c) and (d) show" in both
    assert "in the limit of a short range" in both and "range of attraction of the material" not in both
    finite = caption_of_fig2(compared.tree_at_finite_range(), "one")
    assert "range of attraction of the material, which the grid resolves" in finite


def test_fig2_compares_the_estimate_from_bare_runs_with_adhesive_boundary_elements():
    pressures = np.geomspace(1e-3, 3e-2, 12).tolist()
    path = icha.Path(reduced_pressures=pressures, snapshots=[("reduced_pressure", pressures[-1])])
    runs = {}
    for material in ("soft", "hertz"):
        run = icha.simulate(small.surface(1), small.MATERIALS[material], path, seed=1)
        for model, each in (("asperities", run), ("boundary_elements", compared.own_patches(run))):
            runs[RunLabels("one", model, "rough", 1, 1.0, material)] = each
    fig = against_load.area_and_gap(campaign_tree(runs.items()), study="one")
    names = [text.get_text() for text in fig.legends[0].get_texts()]
    assert "Ciavarella, from runs without adhesion" in names
    areas = [line for line in fig.axes[2].get_lines() if line.get_linewidth() == pytest.approx(0.9)]
    (drawn,) = (line.get_ydata() for line in areas if len(line.get_ydata()))
    # These boundary elements are the states of asperities. Adhesion changes their areas by 6 to 19 %.
    assert len(drawn) > 6 and np.abs(drawn).max() < 8
    layers = against_load.area_and_gap(campaign_tree(with_layers(runs).items()), study="one")
    assert not any("Ciavarella" in name for name in legend(layers)), "the estimate is for half-spaces"


def test_fig2_in_physical_units_has_pressures_and_gaps_with_units():
    references = reference_dataset(small.SPECTRUM, spectral_moments(small.surface()), {})
    left, right = against_load.area_and_gap(small.tree(), references, study="single", units="physical").axes
    assert left.get_xlabel() == label_of("nominal_pressure", "kPa") and right.get_ylabel() == label_of("mean_gap", "µm")
    stops = [path_steps(small.run(seed)) for seed in (1, 2)]
    load, values = stops[0]["nominal_pressure"].values, np.array([each["mean_gap"].values for each in stops])
    (mean,) = (line for line in right.get_lines() if line.get_marker() == "o" and len(line.get_xdata()) == len(load))
    np.testing.assert_allclose(mean.get_xdata(), load * 1e-3, rtol=1e-6)
    np.testing.assert_allclose(mean.get_ydata(), values.mean(axis=0) * 1e6, rtol=1e-6)
    (theory,) = (line for line in left.get_lines() if line.get_label() == "Persson")
    p = theory.get_xdata() * 1e3 / small.MATERIALS["soft"].contact_modulus
    expected = np.interp(p, references["reduced_pressure"], references["persson_area_fraction"])
    np.testing.assert_allclose(theory.get_ydata(), expected, rtol=1e-6)
    several = against_load.area_and_gap(small.tree(), references, study="slopes", units="physical").axes[0]
    assert "Persson" not in [line.get_label() for line in several.get_lines()]
