"""Checks of results pass on true runs and catch each kind of damage."""

from functools import partial

import cyclic_campaign as cyclic
import numpy as np
import pytest
import small_campaign as small

import icha
from icha.analysis.checks import check_campaign, read_checks, refuse_unknown_failures, write_checks
from icha.checks.findings import Check
from icha.checks.run import check_run
from icha.datasets.campaign import run_labels
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import RunLabels
from validation.surfaces import paraboloid


def failed(run):
    return {check.name for check in check_run(run) if not check.passed}


@pytest.mark.parametrize("material", ["soft", "hertz"])
def test_true_runs_pass(material):
    run, loop = small.run(material=material), cyclic.run(material=material, between=2)
    assert failed(run) == failed(loop) == set()
    assert len(check_run(run)) >= 12 and {check.subject for check in check_run(run, "a run")} == {"a run"}
    names = {check.name for check in check_run(loop)}
    assert {"events", "loss adds up", "loss is the work", "pull-off pressure", "separated: spots"} <= names
    # With adhesion a loop has an area.
    assert ("loop closes" in names) == (material == "hertz")
    assert float(loop["hysteresis_loss"]) > 0 or material == "hertz"


def scaled(name, factor, index=...):
    def damage(run):
        run[name].values[index] *= factor

    return damage


def written(name, value, index=...):
    def damage(run):
        run[name].values[index] = value

    return damage


def risen(*, united):
    """The surfaces further apart at a step, where spots have united or where nothing has happened."""

    def damage(run):
        run["jump_in_count"].values[...] = 0
        run["coalescence_count"].values[...] = [0] * 4 + [united] * (run.sizes["step"] - 4)
        run["mean_separation"].values[4] *= 1.5

    return damage


DAMAGES = {
    "residual": written("residual", 1e-6, 2),
    "converged": written("converged", 0, 1),
    "targets": scaled("step_target", 1 + 1e-6, 3),
    "area rises": scaled("contact_area_fraction", 0.3, 4),
    "pressure rises": scaled("nominal_pressure", 0.1, 4),
    "separation falls": risen(united=0),
    "separation falls where spots unite": risen(united=1),
    "area from P(p)": scaled("pressure_density", 1 + 1e-6),
    "load from P(p)": scaled("pressure_bin_mean", 1 + 1e-6),
    "P(u) complete": scaled("gap_density", 1 + 1e-6),
    "area of spots": scaled("spot_area", 1 + 1e-6, 0),
    "load of spots": scaled("spot_force", -1, 0),
    "finite": written("gap_density", np.nan, (0, 5)),
    "stiffness": written("contact_stiffness", -1.0, 2),
}


@pytest.mark.parametrize(
    ("kind", "area", "fails"),
    [("area_fraction", 1.1, False), ("area_fraction", 0.9, True), ("reduced_pressure", 1.1, True)],
)
@pytest.mark.parametrize("model", ["asperities", "boundary_elements"])
def test_surfaces_may_move_apart_only_where_an_area_is_asked_for_and_has_jumped_past(model, kind, area, fails):
    run = small.run(material="soft").copy(deep=True)
    run.attrs |= {"contact_model": model, "attraction": "short range"}
    run["coalescence_count"].values[...] = 0
    run["jump_in_count"].values[4:] = 1
    run["step_kind"].values[4] = kind
    run["mean_separation"].values[4] = 1.1 * run["mean_separation"].values[3]
    run["contact_area_fraction"].values[4] = area * run["contact_area_fraction"].values[3]
    assert ("separation falls" in failed(run)) == fails


def test_a_path_that_ends_in_contact_may_have_gained_energy_in_its_jumps():
    """Where the range is long the jump into contact is uphill; the jump off it, which loses more, is still to come."""
    turns = [("reduced_pressure", 5e-4), ("reduced_pressure", 1e-3)]
    material, path = icha.Material(1.0, 1.0, 1.0), icha.Path([1e-3], turning_points=turns)
    run = icha.simulate(paraboloid(32, 16.0), material, path)
    assert float(run["dissipated_by_jump_in"][-1]) < 0
    assert failed(run) == set()


CYCLE_DAMAGES = {
    "targets": scaled("mean_separation", 1 + 1e-6, -1),
    "finite": written("work", np.nan, 3),
    "events": written("split_count", 1, -1),
    "jumps lose energy": written("dissipated_by_jump_off", -1.0, -1),
    "jumps off lose energy": written("dissipated_by_jump_off", -1.0, -1),
    "unions lose energy": written("dissipated_by_coalescence", -1.0, -1),
    "load jumps lose energy": written("dissipated_by_load_jump", -1.0, -1),
    "loop loses energy": written("hysteresis_loss", -1.0),
    "loss adds up": written("loss_unattributed", 1.0),
    "loss is the work": scaled("work", 1 + 1e-6, -1),
    "separated: spots": written("spot_count", 1, -1),
    "separated: pressure": written("nominal_pressure", -1e-3, -1),
    "pull-off pressure": scaled("pull_off_pressure", 1 + 1e-6),
}
RUNS = {"loading": partial(small.run, material="hertz"), "cycle": partial(cyclic.run, between=2)}


@pytest.mark.parametrize(
    ("run", "name", "damage"),
    [("loading", *each) for each in DAMAGES.items()] + [("cycle", *each) for each in CYCLE_DAMAGES.items()],
)
def test_each_kind_of_damage_is_caught_by_its_check(run, name, damage):
    run = RUNS[run]().copy(deep=True).assign(uphill_jump_in_count=0)
    damage(run)
    assert name in failed(run)


def test_no_tolerance_covers_more_than_a_hundredth_of_the_work():
    run = cyclic.run(between=2).copy(deep=True)
    run["contact_stiffness"].values[...] *= 1e6
    run["dissipated_by_jump_in"].values[-1] = 1.0
    limits = {
        check.name: check.limit for check in check_run(run) if check.name.endswith(("lose energy", "loses energy"))
    }
    assert limits and max(limits.values()) <= 1e-2


def test_a_loop_without_adhesion_must_close_unless_spots_have_united():
    run = cyclic.run(material="hertz").copy(deep=True)
    largest = float(np.abs(run["work"]).max())
    for name in ("hysteresis_loss", "loss_by_coalescence"):
        run[name].values[...] += 1e-4 * largest
    run["work"].values[-1] += 1e-4 * largest
    assert failed(run) == {"loop closes"}
    run["coalescence_count"].values[-1] = 1
    run["event_kind"].values[-1] = 2
    run["jump_off_count"].values[-1] -= 1
    assert failed(run) == set()


def test_a_union_may_take_load_from_a_step_but_not_from_a_stop():
    run = cyclic.run(material="hertz", between=2).copy(deep=True)
    between = int(np.flatnonzero(run["step_kind"].values == "path")[0])
    unions = run["coalescence_count"].values
    for name in ("nominal_pressure", "contact_area_fraction"):
        run[name].values[between] = 0.99 * run[name].values[between - 1]
    assert {"pressure rises", "area rises"} <= failed(run)
    unions[between:] = 1
    assert {"pressure rises", "area rises"}.isdisjoint(failed(run))
    stop = int(np.flatnonzero(run["leg"].values == 0)[-1])
    unions[stop:] = 2
    run["nominal_pressure"].values[stop] = 0.99 * run["nominal_pressure"].values[between - 1]
    assert "pressure rises" in failed(run) and "area rises" not in failed(run)


def test_a_run_without_steps_fails():
    run = small.run().isel(step=slice(0, 0), snapshot=slice(0, 0), spot=slice(0, 0))
    assert failed(run) == {"steps"}


@pytest.mark.parametrize("tree", [small.tree, cyclic.tree])
def test_campaigns_pass_and_name_their_runs(tree):
    checks = check_campaign(tree())
    assert all(check.passed for check in checks)
    assert {str(labels) for labels in run_labels(tree())} <= {check.subject for check in checks}


def test_missing_runs_fail_unless_nobody_asked_for_them():
    runs = [(labels, run) for labels, run in small.runs() if labels.study == "slopes"]
    asked = [labels for labels, _ in runs]
    tree = campaign_tree(runs[:-1], design=asked)
    (lacking,) = (check for check in check_campaign(tree) if not check.passed)
    assert lacking.name == "no run missing"
    assert lacking.subject == str(RunLabels("slopes", "asperities", "rough", 1, 0.2, "hertz"))
    assert all(check.passed for check in check_campaign(campaign_tree(runs[:-1])))


def test_failed_runs_have_one_check_with_their_reason():
    """Also one that has not reached a single stop; nothing of what is left of it is checked."""
    runs = {labels: run for labels, run in small.runs() if labels.study == "slopes"}
    one, other, *_ = runs
    nothing = {"step": slice(0, 0), "snapshot": slice(0, 0), "spot": slice(0, 0)}
    runs[one] = runs[one].isel(nothing).assign_attrs(incomplete="the path ends before it begins")
    runs[other] = runs[other].assign_attrs(failed_checks="converged: 2 (steps)")
    checks = check_campaign(campaign_tree(runs.items()))
    failed = {check.subject: (check.name, check.description) for check in checks if not check.passed}
    assert failed == {
        str(one): ("completed", "the path ends before it begins"),
        str(other): ("completed", "converged: 2 (steps)"),
    }
    assert sum(check.subject in failed for check in checks) == 2
    assert sum(check.name == "completed" and check.passed for check in checks) == 2


def test_only_failures_that_are_known_are_let_through():
    checks = [Check("a", 2.0, 1.0, False, "what a is", "x"), Check("a", 0.0, 1.0, True, "what a is", "y")]
    refuse_unknown_failures(checks, ["x"])
    refuse_unknown_failures(checks[1:], [])
    for known, reason in (
        ([], "x: a: 2"),
        (["x", "y"], "y: is listed as a known failure"),
        (["x", "z"], "z: is listed as a known failure"),
    ):
        with pytest.raises(ValueError, match=f"^{reason}"):
            refuse_unknown_failures(checks, known)


def test_findings_can_be_kept_also_of_values_that_are_not_finite(tmp_path):
    run = small.run().copy(deep=True)
    run["residual"].values[0] = np.nan
    checks = [*check_campaign(small.tree()), *check_run(run)]
    write_checks(checks, tmp_path / "checks.json")
    found = read_checks(tmp_path / "checks.json")
    assert found[: -len(check_run(run))] == check_campaign(small.tree())
    assert {"finite", "residual"} <= {check.name for check in found if not check.passed}


def test_spots_that_reach_over_the_edge_of_a_free_square_keep_the_identities():
    spectrum = icha.SelfAffineSpectrum(
        period=100e-6, rolloff_wavelength=50e-6, short_wavelength=12.5e-6, hurst=0.8, rms_slope=1.0
    )
    surface = icha.Surface(spectrum.realise(grid=64, seed=1).heights, 100e-6, boundary="free")
    material = icha.Material(contact_modulus=25e6, surface_energy=0.0, interaction_range=20e-9)
    run = icha.simulate(surface, material, icha.Path(area_fractions=[0.02, 0.1]))
    assert float(run["area_beyond_edges"].max()) > 1e-6  # or the test says nothing
    assert failed(run) == set()
