"""Figures of means over fewer seeds than requested show it, and captions count the missing runs."""

import warnings

import compared_campaign as compared
import cyclic_campaign as cyclic
import numpy as np
import pytest
import small_campaign as small
import xarray as xr
from drawn import draw, legend, lines_of

from icha.analysis.model_error import model_error
from icha.contact.attraction import SHORT_RANGE
from icha.datasets.campaign import NoSnapshot
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import RunLabels
from icha.datasets.variables.run import LOOP
from icha.figures import against_load, against_parameter, at_one_load, contact_maps, errors, loops
from icha.figures.captions import count_runs
from icha.figures.drawn import Name, caption_of, shown_runs, table_of
from icha.figures.ensembles import draw_members, draw_points
from icha.figures.looks import FEWER_SEEDS
from icha.figures.select import NOT_APPLICABLE
from icha.figures.style import new_figure

SEEDS = range(1, 6)
LABELS = RunLabels("five", "asperities", "rough", 1, 1.0, "soft")
REASON = "asperity model not applicable: 40 % of the load is on summits that no node supports"


def campaign(failed=None, checks=None, pale=(), lacking=(), run=small.run):
    """Five seeds of two materials, of which some runs of the soft one failed, lack or are not applicable."""
    runs = []
    for material in ("soft", "hertz"):
        for seed in SEEDS:
            own = run(seed=seed, material=material)
            if material == "soft":
                own = own.isel(step=slice(0, (failed or {}).get(seed)))
                attrs = {"incomplete": "no equilibrium"} if seed in (failed or {}) else {}
                attrs |= {"failed_checks": "loss below zero"} if seed in (checks or ()) else {}
                attrs |= {"applicability": REASON} if seed in pale else {}
                own = own.assign_attrs(attrs)
            runs.append((RunLabels("five", "asperities", "rough", seed, 1.0, material), own))
    design = [labels for labels, _ in runs]
    return campaign_tree(
        [(labels, own) for labels, own in runs if (labels.material, labels.seed) not in {("soft", k) for k in lacking}],
        design=design,
    )


def crossed(axes):
    return [line for line in axes.get_lines() if line.get_label() == FEWER_SEEDS]


@pytest.mark.parametrize("module", [against_load.area_and_gap, against_parameter.loss])
def test_means_over_fewer_seeds_are_crossed_and_runs_not_applicable_are_pale(module):
    run = cyclic.run if module is against_parameter.loss else small.run
    figure = draw(module, campaign(lacking=(2,), checks=(4,), pale=(5,), run=run), "five")
    axes = figure.axes[0]
    assert crossed(axes) and not crossed(draw(module, campaign(run=run), "five").axes[0])
    for cross in crossed(axes):
        marked = [line for line in lines_of(axes) if line.get_marker() != "x"]
        assert any(np.isin(cross.get_xdata(), line.get_xdata()).all() for line in marked)
    assert legend(figure).count(FEWER_SEEDS) == legend(figure).count(f"pale: {NOT_APPLICABLE}") == 1
    if module is against_parameter.loss:
        pale = draw(module, campaign(pale=SEEDS, run=run), "five")
        assert sum("= 50 mJ/m²" in name for name in legend(pale)) == 1, "a pale line alone has an entry too"
        assert f"pale: {NOT_APPLICABLE}" in legend(draw(loops.loops, campaign(pale=(1,), run=run), "five"))


def test_captions_count_the_seeds_of_pale_means_beside_boundary_elements():
    runs = []
    for seed in range(1, 4):
        labels, run = RunLabels("both", "asperities", "rough", seed, 1.0, "soft"), small.run(seed)
        runs.append((labels, run.assign_attrs({"applicability": REASON} if seed == 3 else {})))
        model = "boundary_elements"
        runs.append((labels._replace(model=model), run.assign_attrs(contact_model=model, attraction=SHORT_RANGE)))
    caption = caption_of(against_load.area_and_gap(campaign_tree(runs), study="both"))
    assert "Means of boundary elements are over 3 of the topographies, and those beside them over 1 or 2, so" in caption


def test_runs_that_failed_at_different_steps_are_in_no_mean():
    tree = campaign(failed={2: 2, 4: 3})
    (cross,) = crossed(against_load.area_and_gap(tree, study="five").axes[0])
    own = [
        small.run(k)["contact_area_fraction"].sel(step=small.run(k)["step_kind"] == "reduced_pressure")
        for k in (1, 3, 5)
    ]
    np.testing.assert_allclose(cross.get_ydata() * cross.get_xdata(), np.mean(own, axis=0), rtol=1e-9)


def segments(line):
    """The ends of the segments of a line that are drawn, as pairs of x."""
    x, y = line.get_data()
    return [(a, b) for a, b, c, d in zip(x, x[1:], y, y[1:], strict=False) if np.isfinite([a, b, c, d]).all()]


@pytest.mark.parametrize("few", [draw_members, draw_points])
def test_no_line_joins_means_over_different_seeds(few):
    members = np.arange(1.0, 21.0).reshape(5, 4)
    members[1, 2:], members[3, 1:] = np.nan, np.nan
    axes = new_figure(3, 3).subplots()
    look = {"color": "#0072B2", "mec": "#0072B2", "mfc": "#0072B2", "marker": "o", "ms": 4, "ls": "-"}
    few(axes, np.arange(4.0), members, look, positive=False, name=Name("mean"), asked=5)
    (mean,) = [line for line in axes.get_lines() if line.get_linestyle() == "-" and line.get_marker() == "o"]
    assert segments(mean) == [(2.0, 3.0)]
    (cross,) = crossed(axes)
    assert cross.get_xdata()[np.isfinite(cross.get_ydata())].tolist() == [1, 2, 3]


def test_figures_of_one_run_say_that_the_model_is_not_applicable(surface):
    tree = campaign(pale=(1,))
    figure = contact_maps.contact_map(tree, surface, run=("five", "asperities", "rough", 1, 1.0, "soft"))
    assert NOT_APPLICABLE in figure.get_suptitle()
    assert NOT_APPLICABLE in legend(contact_maps.spots_by_slope(tree, study="five"))[0]


def test_captions_count_what_is_missing():
    assert count_runs({"campaign": campaign()}, ["five"]) == ""
    tree = campaign(lacking=(2,), failed={3: 2}, checks=(4,), pale=(1, 5))
    assert count_runs({"campaign": tree}, ["five"]) == (
        "The figure shows 7 of 10 runs; 1 not computed, 1 did not finish, 1 failed a check. Means over too few of the "
        f"requested seeds have no intervals. The report lists the reasons. Note on 2 runs: {REASON}."
    )


def test_captions_name_a_material_whose_runs_ended_before_their_first_target():
    reason = "the path ends near full contact"
    ended = [(labels, own.isel(step=slice(0, 0)).assign_attrs(beyond_model=reason)) for labels, own in small.runs()[:1]]
    tree = campaign_tree([*ended, *small.runs()[1:2]])
    assert "soft" not in legend(against_load.area_and_gap(tree, study="slopes"))
    caption = count_runs({"campaign": tree}, ["slopes"])
    assert "The figure shows 1 of 2 runs; 1 ended before the first target" in caption
    assert f"Without a curve: soft with asperities (1 ended before the first target: {reason})." in caption


# --- runs that physics ended before their last target -----------------------------------------------------------


def ended(labels, run, step):
    """Return a run that ended before a step, without the snapshots and the values of the loop that it did not reach."""
    reached = np.flatnonzero(run["snapshot_step"].values < step)
    spots = np.isin(run["spot_snapshot"].values, reached)
    run = run.drop_vars([name for name in LOOP if name in run])
    run = run.isel(step=slice(0, step), snapshot=reached, spot=spots)
    if "event_step" in run:
        run = run.isel(event=run["event_step"].values < step)
    return labels, run.assign_attrs(beyond_model="near full contact")


@pytest.mark.parametrize("figure", [14, 15, 3, 8, 9, 13])
def test_captions_and_crosses_show_seeds_that_ended_before_the_state_of_a_figure(figure):
    of_loop = figure > 9
    runs = [(LABELS._replace(seed=seed), (cyclic.run if of_loop else small.run)(seed)) for seed in SEEDS]
    short = [4] if of_loop else [int(run["snapshot_step"].max()) for _, run in runs]
    runs = [ended(*each, short[k % len(short)]) if k in (1, 3) else each for k, each in enumerate(runs)]
    tree = campaign_tree(runs)
    module, further = {
        3: (at_one_load.distributions, {"kind": "area_fraction"}),
        8: (at_one_load.patch_sizes, {"kind": "area_fraction"}),
        9: (against_parameter.tabor, {"kind": "area_fraction"}),
        13: (loops.loops, {}),
        14: (against_parameter.pull_off, {}),
        15: (against_parameter.loss, {}),
    }[figure]
    study = {"studies": ["five"]} if figure == 15 else {"study": "five"}
    drawn = module(tree, **study, **further)
    caption = count_runs({"campaign": tree}, ["five"], shown=shown_runs(drawn))
    if figure == 13:  # a figure of one seed, which is complete
        assert caption == ""
        return
    assert caption.startswith("The figure shows 3 of 5 runs; 2 ended before this state; the others are a biased sel")
    assert FEWER_SEEDS in legend(drawn)
    whole = campaign_tree((labels, (cyclic.run if of_loop else small.run)(labels.seed)) for labels, _ in runs)
    assert count_runs({"campaign": whole}, ["five"], shown=shown_runs(module(whole, **study, **further))) == ""


def test_captions_name_a_material_whose_runs_all_ended_before_the_state_of_a_figure():
    runs = [(LABELS, small.run()), (LABELS._replace(material="hertz"), small.run(material="hertz"))]
    tree = campaign_tree([runs[0], ended(*runs[1], int(runs[1][1]["snapshot_step"].max()))])
    figure = at_one_load.distributions(tree, study="five", kind="area_fraction")
    caption = count_runs({"campaign": tree}, ["five"], shown=shown_runs(figure))
    assert "Without a curve: hertz with asperities (1 ended before this state: near full contact)." in caption


def test_spots_by_slope_leave_out_slopes_without_a_state_and_say_so():
    runs = [(labels, run) for labels, run in small.runs() if labels.study == "slopes" and labels.material == "soft"]
    (labels, run), other = runs
    tree = campaign_tree([ended(labels, run, int(run["snapshot_step"].max())), other])
    figure = contact_maps.spots_by_slope(tree, study="slopes")
    assert len(legend(figure)) == 1
    caption = count_runs({"campaign": tree}, ["slopes"], shown=shown_runs(figure))
    assert caption.startswith("The figure shows 1 of 2 runs; 1 ended before this state, with rms slope above 0.9; the")


def test_spots_by_slope_name_their_material_if_the_study_has_several():
    tree = campaign_tree([(labels, run) for labels, run in small.runs() if labels.study == "slopes"])
    caption = caption_of(contact_maps.spots_by_slope(tree, study="slopes", material="soft"))
    assert "The material has E* = 25 MPa, Δγ = 50 mJ/m²." in caption


def test_captions_of_errors_count_seeds_that_ended_before_the_largest_load():
    truths = dict(compared.patches())
    runs = [
        ended(labels, run, int(run["snapshot_step"].max())) if labels.seed == 2 else (labels, run)
        for labels, run in compared.runs().items()
        if labels.material == "soft"
    ]
    tree = campaign_tree([*runs, *((labels, run) for labels, run in truths.items() if labels.material == "soft")])
    found = model_error(tree, [(labels, run) for labels, run in truths.items() if labels.material == "soft"])
    figure = errors.model_error(tree, found, study="one")
    assert FEWER_SEEDS in [line.get_label() for line in figure.axes[0].get_lines()]
    caption = count_runs({"campaign": tree}, ["one"], shown=shown_runs(figure))
    assert caption.startswith("The figure shows 5 of 6 runs; 1 ended before this state; the others are a biased")


def test_a_snapshot_that_a_run_reached_before_its_end_is_drawn(surface):
    labels, run = ended(LABELS, small.run(), int(small.run()["snapshot_step"].max()))
    figure = contact_maps.contact_map(campaign_tree([(labels, run)]), surface, run=labels, kind="relative_load")
    assert figure.axes[0].get_images()
    assert "The run ended before its last target: near full contact." in caption_of(figure)
    with pytest.raises(NoSnapshot, match="no snapshot of area_fraction"):
        contact_maps.contact_map(campaign_tree([(labels, run)]), surface, run=labels, kind="area_fraction")


def test_fig2_draws_seeds_of_other_loads_with_a_separation_below_zero():
    second = small.run(2)
    second = second.isel(step=second["reduced_pressure"].values < second["reduced_pressure"].values.max())
    last = xr.DataArray(np.arange(second.sizes["step"]) == second.sizes["step"] - 1, dims="step")
    second["reduced_separation"] = second["reduced_separation"].where(~last, -0.01)
    second = second.assign_attrs(beyond_model="near full contact")
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        figure = against_load.area_and_gap(
            campaign_tree([(LABELS, small.run()), (LABELS._replace(seed=2), second)]), study="five"
        )
    assert table_of(figure).panel.isin(["b"]).any()
