"""Figures of means over fewer seeds than requested show it, and captions count the missing runs."""

import cyclic_campaign as cyclic
import numpy as np
import pytest
import small_campaign as small
from drawn import draw, legend, lines_of

from icha.contact.attraction import SHORT_RANGE
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import RunLabels
from icha.figures import against_load, against_parameter, contact_maps, loops
from icha.figures.captions import count_runs
from icha.figures.drawn import Name, caption_of
from icha.figures.ensembles import draw_members, draw_points
from icha.figures.looks import FEWER_SEEDS
from icha.figures.select import NOT_APPLICABLE
from icha.figures.style import new_figure

SEEDS = range(1, 6)
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
