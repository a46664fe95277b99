"""Runs that a number leaves out: counts, causes, the parameter that separates them, and whether it has an interval."""

import cyclic_campaign as cyclic
import numpy as np
import pytest
from drawn import draw
from sampled_cases import COUNT, sampled

from icha.analysis.checks import check_campaign
from icha.checks.run import attributes_of_failure, check_run
from icha.datasets.campaign import select_run
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.table import tidy_table
from icha.figures import against_parameter, samples
from icha.figures.captions import count_runs
from icha.figures.drawn import shown_runs
from icha.figures.looks import FEWER_SEEDS
from icha.report.answers import answers_of, samples_table
from icha.uncertainty.estimates import estimate_campaign
from icha.uncertainty.left_out import (
    ENDED_EARLY,
    FAILED,
    NOT_COMPUTED,
    NOT_REQUESTED,
    find_left_out,
    left_out_of_study,
    too_few,
)
from icha.uncertainty.sensitivity import left_out_of_samples, sensitivity_of_campaign

ENERGY = 1e-3 * np.array([1, 2, 3, 4, 5, 6, 7, 8, 8.5, 9.3, 10, 11, 12, 13, 14, 15])
WORDS = "9 of 16 cases; 7 failed a check, all with surface energy above 9.2 mJ/m²"


def cases(failed):
    return [FAILED if k in failed else "" for k in range(16)]


def test_the_parameter_that_separates_failed_cases_is_named():
    generator = np.random.default_rng(1)
    parameters = {"hurst": ("1", generator.random(16)), "surface_energy": ("J m^-2", ENERGY)}
    # Seven of the nine stickiest cases failed.
    found = find_left_out("cases", cases(range(9, 16)), parameters)
    assert found.words == WORDS and found.biased and not found.has_interval
    some = find_left_out("cases", cases({9, 10, 12, 13, 15, 7, 14}), parameters)
    assert some.words.endswith("all with surface energy above 7.9 mJ/m²") and some.biased
    weak = find_left_out("cases", cases({0, 1}), parameters)
    assert weak.words.endswith("2 failed a check, all with surface energy below 2.1 mJ/m²") and not weak.has_interval


def test_cases_that_no_parameter_separates_leave_an_interval():
    found = find_left_out("cases", cases({4, 11}), {"surface_energy": ("J m^-2", ENERGY)})
    assert found.sentence == "14 of 16 cases; 2 failed a check" and found.has_interval and not found.biased
    lost = find_left_out("cases", [NOT_COMPUTED if k > 10 else "" for k in range(16)], {"e": ("1", ENERGY)})
    assert lost.words == "11 of 16 cases; 5 not computed" and not lost.biased


def test_ends_by_physics_are_biased_and_a_tenth_may_be_missing():
    one = find_left_out("seeds", [ENDED_EARLY, *[""] * 9, NOT_REQUESTED])
    assert one.sentence == "9 of 10 seeds; 1 ended before this state; biased" and one.has_interval
    two = find_left_out("seeds", [ENDED_EARLY, *[""] * 8])
    assert two.sentence.endswith("; biased, so no interval is stated")
    assert find_left_out("seeds", [""] * 3).sentence == ""
    assert too_few(np.array([10, 9, 8]), 10).tolist() == [False, False, True]


@pytest.fixture(scope="module")
def without_the_stickiest():
    """The sampled cases, of which the stickiest quarter failed a check."""
    runs, samples = sampled()
    energy = np.array(samples[1]["surface_energy"][4])
    limit = np.quantile(energy, 0.75)
    runs = [
        (labels, run.assign_attrs(failed_checks="residual: 1e-3") if energy[k] > limit else run)
        for k, (labels, run) in enumerate(runs)
    ]
    return sensitivity_of_campaign(campaign_tree(runs), {"one": samples})


def test_sampled_cases_state_what_they_leave_out(without_the_stickiest):
    data = without_the_stickiest["one"].to_dataset()
    used = COUNT * 3 // 4
    for _, cases, middle, interval, *shares in samples_table(data).rows:
        assert cases == str(used) and interval == "not stated" and middle.endswith("(biased)")
        assert not any("±" in share for share in shares)
    assert np.isnan(data["low"]).all() and np.isnan(data["first_order_half_width"]).all()
    (line,) = left_out_of_samples(data)
    assert line.startswith(f"all results: {used} of {COUNT} cases; 16 failed a check, all with surface energy above ")
    caption = count_runs({"sensitivity": without_the_stickiest}, ["one"])
    assert caption.startswith(f"all results: {used} of {COUNT} cases") and "no interval is stated" in caption
    for module in (samples.sensitivity, samples.parameters):
        assert module(without_the_stickiest, study="one").axes


# --- failed checks of the loss ----------------------------------------------------------------------------------


def loops(gains=()):
    """Loops of five seeds; in some of them, unions gain energy."""

    def gain(seed, run):
        if seed not in gains:
            return run
        run = run.assign(dissipated_by_coalescence=run["dissipated_by_coalescence"] - 0.05 * run["work"].max())
        attributes = attributes_of_failure(check_run(run))
        assert list(attributes) == ["failed_loss_checks"]
        return run.assign_attrs(attributes)

    return campaign_tree(cyclic.pulls(range(1, 6), gain))


def test_a_failed_check_of_the_loss_leaves_pull_off_and_areas():
    tree, whole, second = loops(gains=(2, 3)), loops(), cyclic.PULL._replace(seed=2)
    answers, before = (
        {a.quantity: a for a in answers_of(estimate_campaign(t)["pull"].to_dataset())} for t in (tree, whole)
    )
    assert answers["pull-off pressure"].number == before["pull-off pressure"].number
    loss = answers["hysteresis loss"]
    assert loss.note.startswith("; 3 of 5 seeds of boundary elements; 2 failed a check of the loss; biased, so no")
    assert "±" not in loss.number and "from" not in loss.number and np.isnan(loss.low)
    # The run is reported as failed, and its loss is in no table and no figure.
    run = select_run(tree, second)
    assert "pull_off_pressure" in run and "hysteresis_loss" not in run
    assert run.attrs["failed_loss_checks"].startswith("unions lose energy: 0.05")
    failed = {check.subject for check in check_campaign(tree) if not check.passed and "/" in check.subject}
    assert failed == {str(second), str(cyclic.PULL._replace(seed=3))}
    table = tidy_table(tree)
    table = table[table.seed == 2]
    assert table.filter(like="hysteresis_loss").isna().all(axis=None) and set(table.status) == {"failed_loss_checks"}
    assert table["pull_off_pressure"].notna().all()
    assert left_out_of_study(tree["pull"].to_dataset()).words == ""
    for module, crossed in ((against_parameter.pull_off, False), (against_parameter.loss, True)):
        labels = [line.get_label() for line in draw(module, tree, "pull").axes[0].get_lines()]
        assert (FEWER_SEEDS in labels) == crossed


def test_the_caption_of_a_figure_of_losses_counts_the_loops_without_a_loss():
    data = {"campaign": loops(gains=(2, 3))}
    assert count_runs(data, ["pull"]) == ""
    figure = against_parameter.loss(data["campaign"], studies=["pull"])
    caption = count_runs(data, ["pull"], shown=shown_runs(figure))
    assert caption.startswith("The figure shows 3 of 5 runs; 2 failed a check of the loss; the others are a biased")
