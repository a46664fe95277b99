"""What is said of whether the model holds: numbers that are those of the validation, and what the data say."""

import math
import re

import compared_campaign as compared
import numpy as np
import pytest
import small_campaign as small
from conftest import REPOSITORY

from icha.analysis.model_error import model_error
from icha.datasets.campaign_file import campaign_tree
from icha.planning.statements import VALIDATION, Case, statements
from icha.report.validity import _range, measured_errors, statements_on_dataset
from icha.surfaces.resolution import Resolution


@pytest.mark.parametrize("adhesive", [False, True])
def test_the_errors_are_those_of_the_page_of_the_validation(adhesive):
    table = (REPOSITORY / "docs/tables/validation_summary.md").read_text().splitlines()
    (row,) = (line.split(" | ") for line in table if line.startswith(f"| {'with' if adhesive else 'without'} adhesion"))
    assert row[1:3] == ["105 of 7 surfaces", "0.001 to 0.1"]
    columns = [column.strip(" |") for column in table[0].split(" | ")]
    for quantity, (low, high) in VALIDATION[adhesive].items():
        found = re.search(r"\((\S+) to (\S+)\)", row[columns.index(f"{quantity}, %")])
        assert [float(number) for number in found.groups()] == [low, high]
        # The words say that they are too small.
        assert low < high < 0


INSIDE = {
    "slope_anisotropy": 1.0,
    "height_skewness": 0.0,
    "height_kurtosis": 3.0,
    "nayak_parameter": 14.0,
    "unsupported_summits": 0.0,
    "nodes_per_short_wave": 8.0,
    "free_edges": 0.0,
    "full_contact_energy_ratio": 140.0,
}
BARE = {**INSIDE, "full_contact_energy_ratio": math.inf}


def case(facts, surface="rough", model="asperities", material="soft", cells=8.0):
    return Case(model, surface, material, facts, Resolution(cells))


def told(*arguments):
    return {statement.about: (statement.text, statement.good) for statement in statements(*arguments)}


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("slope_anisotropy", math.inf, "slopes inf, validated: 1 to 1.2"),
        ("height_skewness", -0.7, "heights -0.7, validated: -0.2 to 0.2"),
        ("nodes_per_short_wave", 3.2, "wave 3.2, validated: 6.9 and more"),
        ("free_edges", 1.0, "`boundary: window`"),
    ],
)
def test_no_accuracy_is_quoted_of_surfaces_outside_the_validation(name, value, reason):
    other = {**INSIDE, name: value}
    text, good = told({}, [case(other, "scan")])["accuracy"]
    assert not good and "%" not in text and "scan: " in text and reason in text
    text, _ = told({}, [case(other, "scan"), case(BARE)])["accuracy"]
    assert "5 to 22 %" in text and "of the other runs is unknown (scan: " in text


def test_sticky_materials_are_named():
    sticky = {**INSIDE, "full_contact_energy_ratio": 0.138}
    found = told({}, [case(sticky, material="pdms"), case(INSIDE), case(sticky, model="boundary_elements")])
    assert "(pdms on rough: U_full/dgamma 0.138, validated: 76 and more)" in found["accuracy"][0]
    text, good = found["adhesion"]
    assert not good and "about 0.138 or more (pdms on rough)" in text
    assert text.endswith("the asperity model is applicable up to the contact area A/A0 = 0.0028")
    text, good = told({}, [case(INSIDE), case({**INSIDE, "full_contact_energy_ratio": 20.0})])["adhesion"]
    assert good and "about 20 or more (soft on rough)" in text and "applicable" not in text


def test_the_data_say_where_spots_lay_outside_and_which_runs_are_marked():
    found = {each.about: each for each in statements_on_dataset(small.tree())}
    assert found["models"].text == "asperities in slopes, single"
    assert "cells per shortest wave" in found["accuracy"].text and not found["accuracy"].good
    least = min(float(run["full_contact_energy_ratio"]) for _, run in small.runs())
    assert f"U_full/dgamma is about {least:.3g} or more (soft on rough)" in found["adhesion"].text
    assert found["jump-in"].good and found["jump-in"].text.endswith("; all runs are in this range")
    sticky = [float(run["stickiness"]) for labels, run in small.runs() if labels.material == "soft"]
    said = f"soft on rough (stickiness {max(sticky):.2g})"
    assert (said in found["sticky"].text) if max(sticky) > 1 else "sticky" not in found
    assert "applicability" not in found
    runs = [
        (labels, run.assign(outside_wu_fraction=0.4 + 0 * run["residual"]) if labels.material == "soft" else run)
        for labels, run in small.runs()
    ]
    marked = [labels for labels, _ in runs if labels.seed == 1]
    reasons = {labels: {"applicability": f"{labels.material} surface"} for labels in marked}
    runs = [(labels, run.assign_attrs(reasons.get(labels, {}))) for labels, run in runs]
    found = {each.about: each for each in statements_on_dataset(campaign_tree(runs, attrs=small.tree().attrs))}
    said = found["applicability"]
    assert not said.good and said.text.startswith(f"a model is not applicable to {len(marked)} runs: ")
    assert all(f"{labels.material} surface" in said.text for labels in marked)
    assert found["jump-in"].text.endswith("; outside this range: soft on rough (40 % of single spots)")
    assert not found["jump-in"].good


def test_the_error_of_each_study_is_stated_with_its_range_and_its_size():
    truths = compared.patches(area=1.25, separation=0.8)
    errors = model_error(compared.tree_of_both(), truths)
    (statement,) = measured_errors(errors).values()
    assert statement.about == "error" and statement.text == (
        "of the asperity model in study one: contact area 20 to 20 % too small, mean separation 25 to 25 % too large "
        "(3 seeds, 2 loads, boundary elements)"
    )
    for values, words in (
        ([-0.18, -0.11, np.nan], "11 to 18 % too small"),
        ([0.02, 0.05], "2 to 5 % too large"),
        ([-0.03, 0.05], "from 3 % too small to 5 % too large"),
    ):
        assert _range(np.array(values)) == words
