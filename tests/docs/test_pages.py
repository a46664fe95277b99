"""The page on the model's error says what the datasets say."""

import re

import compared_campaign as compared
import numpy as np
import pytest
from pages import validation
from pages.tables import means, table

from icha.analysis.model_error import model_error


def rows(text):
    """Cells of the rows of a Markdown table."""
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]


def test_means_and_deviations():
    assert means([np.array([1.0, 2.0]), np.array([3.0, 2.0])], "{:+.1f}") == ["+2.0 ± 1.4", "+2.0 ± 0.0"]
    assert means([np.array([-0.004, -1.0])], "{:+.2f}") == ["+0.00", "-1.00"]
    assert rows(table(["a", "b"], [["1", "2"]])) == [["a", "b"], ["---", "---"], ["1", "2"]]


def test_errors_are_in_per_cent_with_their_scatter():
    errors = compared.errors()["adhesive"].to_dataset()
    head, _, row = rows(validation.error_table(errors, "area_error"))
    assert head == ["surface", "p\\* = 0.003", "p\\* = 0.01"]
    each = [100 * (1 / factor - 1) for factor in compared.AREA_FACTORS.values()]
    expected = f"{np.mean(each):+.1f} ± {np.std(each, ddof=1):.1f}"
    assert row == ["`rough`", expected, expected]
    (*_, row) = rows(validation.error_table(compared.errors()["bare"].to_dataset(), "separation_error"))
    assert row[1:] == ["+25.0 ± 0.0"] * 2


def test_solutions_of_the_runs_own_states_are_at_no_distance():
    text = validation.distances(compared.errors()["bare"].to_dataset())
    assert [row[2] for row in rows(text)[2:]] == ["0.000 ± 0.000", "0.000 ± 0.000", "1.000 ± 0.000"]


def test_grids_are_compared_where_both_are():
    def bare(entry, seeds, area):
        return compared.solutions(
            entry, lambda labels: labels.material == "hertz" and labels.seed in seeds, area=lambda labels: area
        )

    tree = model_error(compared.tree(), [*bare("usual", (1, 2, 3), 1.25), *bare("fine", (2,), 1.30)])
    text = validation.own_error(tree, {"usual": "2 cells", "fine": "4 cells"})
    areas, gaps = rows(text)[2:]
    assert areas == ["4 cells instead of 2 cells: area, %", "+4.00", "+4.00"]
    assert gaps[1:] == ["+0.00", "+0.00"]


def test_effect_of_the_range_is_over_the_same_surfaces_without_adhesion():
    text = validation.effect_of_range(compared.errors(), "bare", ["adhesive"])
    by_name = {row[1]: row[2] for row in rows(text)[2:]}
    runs = compared.errors()
    own = runs["adhesive"]["contact_area_fraction"].values / runs["bare"]["contact_area_fraction"].values
    first = own[..., 0].ravel()
    assert by_name["A, ICHA"] == f"{first.mean():.3f} ± {first.std(ddof=1):.3f}"
    factors = np.array(list(compared.AREA_FACTORS.values()))
    truth = first * factors / 1.25
    assert by_name["A, boundary elements, zero gap"] == f"{truth.mean():.3f} ± {truth.std(ddof=1):.3f}"
    energetic = truth * 1.2
    assert by_name["A, boundary elements, energetic"] == f"{energetic.mean():.3f} ± {energetic.std(ddof=1):.3f}"


def test_the_page_names_its_command_and_its_medians():
    fine = compared.solutions("fine", lambda labels: labels.material == "hertz")
    tree = model_error(compared.tree(), [*compared.solutions_of_errors(), *fine])
    page = validation.page(
        tree,
        entries={"bare": "Without adhesion", "adhesive": "With adhesion"},
        grids={"bare": "2 cells", "fine": "4 cells"},
        ranges={"bare": ["adhesive"]},
        figures={"images/a.png": "Errors"},
        command="make it",
    )
    assert "`make it`" in page and "![Errors](images/a.png)" in page
    assert "contact area -20.0 % (-20.0 to -20.0 %); mean separation +25.0 %" in page
    (median,) = re.findall(r"\*\*With adhesion\*\*.*?contact area (\S+) %", page)
    each = [100 * (1 / factor - 1) for factor in compared.AREA_FACTORS.values()]
    assert float(median) == pytest.approx(np.mean(each), abs=0.05)
