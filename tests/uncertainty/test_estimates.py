"""Answers of a study: the levels of a campaign dataset, and the answers in words."""

import csv
import io
import math

import compared_campaign as compared
import cyclic_campaign as cyclic
import numpy as np
import pytest
import xarray as xr
from scipy import stats
from typer.testing import CliRunner

from icha.cli import app
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import write_dataset
from icha.datasets.labels import coarse_study
from icha.report.answers import answers_of, answers_table, sentences
from icha.uncertainty import control_variates
from icha.uncertainty.estimates import estimate_campaign

COARSE, FINE = 1.3, 1.25


def levels():
    """Asperities for three seeds; boundary elements with more area on half the grid (three) and the grid (two)."""
    fine = compared.patches(lambda labels: labels.seed < 3, area=FINE)
    coarse = [(each._replace(study=coarse_study(each.study)), run) for each, run in compared.patches(area=COARSE)]
    return campaign_tree([*compared.runs().items(), *fine, *coarse])


@pytest.fixture(scope="module")
def answers():
    """Return answers with geometric means, although three seeds of this campaign scatter by more than 0.25."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(control_variates, "_MOST_SCATTER", 1.0)
        return estimate_campaign(levels())


def test_estimates_have_the_mean_of_all_seeds_and_the_level_of_the_fine_grid(answers):
    assert list(answers.children) == ["one"]
    study = answers["one"].to_dataset()
    areas = {
        seed: [float(run["contact_area_fraction"][k]) for k in (0, 1)]
        for (_, _, _, seed, _, material), run in compared.runs().items()
        if material == "soft"
    }
    here = study.where((study["quantity"] == "contact_area_fraction") & (study["material"] == "soft"), drop=True)
    np.testing.assert_allclose(here["stop_target"], compared.PRESSURES)
    mean = np.exp(np.mean([np.log(areas[seed]) for seed in (1, 2, 3)], axis=0))
    np.testing.assert_allclose(here["estimate"], FINE * mean, rtol=1e-9)
    # All seeds have the same ratio of the levels, so only the scatter and the error of the grid widen the interval.
    np.testing.assert_allclose(here["share_model"], 0, atol=1e-9)
    np.testing.assert_allclose(here["share_refinement"], 0, atol=1e-9)
    np.testing.assert_allclose(here["share_grid"], math.log(COARSE / FINE) / (2**0.9 - 1))
    np.testing.assert_allclose(
        np.log(here["estimate_high"] / here["estimate"]), np.hypot(here["share_seeds"], here["share_grid"])
    )
    assert here[["asperity_seeds", "coarse_seeds", "fine_seeds"]].to_array().values.T.tolist() == [[0, 3, 2]] * 2
    assert "nominal_pressure" not in study["quantity"].values  # the targets prescribe it


def test_seeds_that_scatter_much_have_arithmetic_means():
    study = estimate_campaign(levels())["one"].to_dataset()
    row = study.isel(answer=((study["quantity"] == "contact_area_fraction") & (study["material"] == "soft")).values)
    row = row.isel(answer=0)
    assert not row["geometric"]
    areas = np.array(
        [float(run["contact_area_fraction"][0]) for labels, run in compared.runs().items() if labels.material == "soft"]
    )
    # With three coarse seeds, the coefficient is 1.
    expected = (FINE - COARSE) * areas[:2].mean() + COARSE * areas.mean()
    assert float(row["estimate"]) == pytest.approx(expected)
    shares = [float(row[f"share_{name}"]) for name in ("seeds", "model", "refinement", "grid")]
    assert float(row["estimate_high"] / row["estimate"]) == pytest.approx(1 + math.hypot(*shares))
    assert float(row["estimate_low"] / row["estimate"]) == pytest.approx(max(0, 1 - math.hypot(*shares)))


def test_seeds_with_full_contact_count_and_are_named():
    """One of three seeds has no gap: the mean contains it, and the infinite stiffness has no estimate."""

    def closed(labels, run):
        if labels.seed > 1:
            return run
        ones = xr.ones_like(run["contact_area_fraction"])
        return run.assign(contact_area_fraction=ones, mean_gap=0 * ones, contact_stiffness=ones / 0)

    runs = [(labels, closed(labels, run)) for labels, run in compared.patches()]
    study = estimate_campaign(campaign_tree(runs))["one"].to_dataset()
    assert "contact_stiffness" not in study["quantity"].values
    rows = study.isel(answer=((study["quantity"] == "mean_gap") & (study["material"] == "soft")).values)
    gaps = [float(run["mean_gap"][0]) for labels, run in runs if labels.material == "soft"]
    assert float(rows["estimate"][0]) == pytest.approx(np.mean(gaps)) and gaps[0] == 0
    assert rows["full_contact_seeds"].values.tolist() == [1, 1]
    assert float(rows["estimate_low"].min()) >= 0
    areas = study["estimate_high"].values[study["quantity"] == "contact_area_fraction"]
    assert areas.max() <= 1
    gap = next(each for each in answers_of(study) if each.quantity == "mean gap")
    assert gap.number.endswith("; full contact in 1 of 3 seeds") and ", from " in gap.number


def test_pull_off_and_loss_of_loops_are_positive_means():
    runs = dict(cyclic.pulls((1, 2, 3)))
    study = estimate_campaign(campaign_tree(runs.items()))["pull"].to_dataset()
    for name in ("pull_off_pressure", "hysteresis_loss"):
        row = study.isel(answer=(study["quantity"] == name).values).isel(answer=0)
        values = [float(run[name]) for run in runs.values()]
        assert min(values) > 0
        expected = np.exp(np.mean(np.log(values))) if row["geometric"] else np.mean(values)
        assert float(row["estimate"]) == pytest.approx(expected)
        assert 0 <= row["estimate_low"] < row["estimate"] < row["estimate_high"]


def test_answers_of_a_lens_are_forces_radii_and_works_of_adhesion():
    def lens(seed, run):
        """The run as one of a free square with a shape; the last one has no fit."""
        area = float(run["period"]) ** 2
        of_steps = {
            "force": (run["nominal_pressure"] * area, "N"),
            "contact_radius": ((run["contact_area_fraction"] * area / np.pi) ** 0.5, "m"),
            "stiffness": (run["contact_stiffness"] * area, "N m^-1"),
            "pull_off_force": (run["pull_off_pressure"] * area, "N"),
            "work_of_adhesion_retraction": (run["surface_energy"] * 0.9, "J m^-2"),
        }
        added = {name: value.assign_attrs(units=unit, long_name=name) for name, (value, unit) in of_steps.items()}
        return run.assign({name: each for name, each in added.items() if seed < 4 or "work" not in name})

    runs = cyclic.pulls((1, 2, 3, 4), lens)
    rows = answers_of(estimate_campaign(campaign_tree(runs))["pull"].to_dataset())
    expected = (
        "contact radius, force, stiffness, number of contact patches, pull-off force, work of adhesion on retraction"
    )
    assert {each.quantity for each in rows} == {*expected.split(", ")}
    (work,) = (each for each in rows if "work" in each.quantity)
    assert "3 of 4 seeds of boundary elements; 1 without a fit of JKR; biased" in work.note
    assert work.unit == "mJ/m²" and work.value == pytest.approx(900 * float(runs[0][1]["surface_energy"]))
    assert all(each.unit.endswith("N") for each in rows if each.quantity == "pull-off force")


def test_the_asperity_model_for_the_same_seeds_has_no_effect():
    study = estimate_campaign(campaign_tree([*compared.runs().items(), *compared.patches()]))["one"].to_dataset()
    row = study.isel(answer=(study["quantity"] == "mean_gap").values).isel(answer=0)
    runs = [run for labels, run in compared.patches() if labels.material == row["material"]]
    gaps = np.log([float(run["mean_gap"][0]) for run in runs])
    mean, half = np.mean(gaps), stats.t.ppf(0.95, 2) * stats.sem(gaps)
    assert row["geometric"] and row["asperity_seeds"] == 0
    assert float(row["estimate"]) == pytest.approx(math.exp(mean))
    assert float(row["estimate_high"]) == pytest.approx(math.exp(mean + half))


@pytest.mark.parametrize("lost", [1, 3])
def test_an_asperity_model_that_is_not_applicable_does_not_discard_boundary_elements(lost):
    """If the lost seed has boundary elements, they count, and the estimate does without the asperity model."""

    def broken(labels, run):
        bad = labels.seed == lost and labels.model == "asperities" and labels.material == "soft"
        return run.assign_attrs(applicability="the model is not applicable") if bad else run

    fine = compared.patches(lambda labels: labels.seed < 3)
    runs = [(labels, broken(labels, run)) for labels, run in [*compared.runs().items(), *fine]]
    study = estimate_campaign(campaign_tree(runs))["one"].to_dataset()
    found = {name: study[f"{name}_seeds"].values[study["material"].values == "soft"] for name in ("asperity", "fine")}
    # Without the third seed, the model has only the seeds of boundary elements.
    assert set(found["asperity"]) == {0} and set(found["fine"]) == {2}
    assert set(study["asperity_seeds"].values[study["material"].values == "hertz"]) == {3}
    said = study["left_out"].values[study["material"].values == "soft"][0]
    words = "it has no value for 1 seed of boundary elements (outside the range of the model)"
    assert (words in said) == (lost == 1)
    assert ("2 of 3 seeds of the asperity model" in said) == (lost == 3)


def test_a_study_without_several_seeds_of_boundary_elements_has_no_answers():
    assert not estimate_campaign(compared.tree()).children
    one = compared.patches(lambda labels: labels.seed == 1)
    assert not estimate_campaign(campaign_tree([*compared.runs().items(), *one])).children


def test_words_tables_and_latex_state_the_same_numbers(answers, tmp_path):
    rows = answers_of(answers["one"].to_dataset())
    (area,) = (a for a in rows if a.quantity == "contact area" and a.state == "p* = 0.01" and a.contact[:4] == "soft")
    assert area.unit == "%" and f"contact area {area.number}" in " ".join(sentences(rows))
    assert area.number.startswith(f"{area.value:.1f}"[:3])
    write_dataset(answers, tmp_path / "aggregated/answers.nc")

    def icha(*options):
        done = CliRunner().invoke(app, ["answer", str(tmp_path), *options])
        assert done.exit_code == 0, done.output
        return done.output

    table = list(csv.DictReader(io.StringIO(icha("--csv"))))
    assert len(table) == len(rows) == answers["one"].sizes["answer"]
    wanted = {"quantity": "contact_area_fraction", "material": "soft", "stop_target": "0.01"}
    (line,) = (line for line in table if wanted.items() <= line.items())
    assert 100 * float(line["estimate"]) == pytest.approx(area.value, rel=1e-8)
    assert sum(r"\\" in line for line in icha("--latex").splitlines()) == len(rows) + 1
    assert "\n".join(sentences(rows)) in icha() and all(each.number in icha() for each in rows)


def test_tensile_forces_have_their_lower_end_first(answers):
    """Texts and the table for LaTeX state a mean force of -58 µN as one of 58 µN, but with a sign."""

    def force(low, high):
        values = {"quantity": "force", "units": "N", "estimate": -58e-6, "estimate_low": low, "estimate_high": high}
        values |= {"share_seeds": 0.2, "share_grid": math.nan}
        row = answers["one"].to_dataset().isel(answer=[0])
        return row.assign({name: ("answer", [value]) for name, value in values.items()})

    narrow = force(-63e-6, -53e-6)
    (answer,) = answers_of(narrow)
    assert answer.estimate == "-58.0 µN ± 5.0 µN"
    assert answer.shares["seeds"] == pytest.approx(11.6)
    assert answers_of(force(-84e-6, -32e-6))[0].estimate == "-58 µN, from -84 to -32 µN"
    latex = answers_table([answer]).as_latex()
    assert r"$-$58.0 µN $\pm$ 5.0 µN" in latex
