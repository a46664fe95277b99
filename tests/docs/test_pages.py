"""Numbers of the pages on the model's error and its sources are those of the datasets."""

import compared_campaign as compared
import numpy as np
import pytest
import xarray as xr
from pages import error_sources, one_asperity, validation
from pages.tables import Table, means
from write_pages import render

import icha
from icha.analysis.model_error import model_error
from icha.references.error_sources.variants import error_sources as sources_of
from icha.references.one_asperity import hertz_asperity
from icha.references.one_asperity import one_asperity as compare_asperity


def datasets(tree):
    return {name: entry.to_dataset() for name, entry in tree.children.items()}


def test_means_and_deviations():
    assert means([np.array([1.0, 2.0]), np.array([3.0, 2.0])], "{:+.1f}") == ["+2.0 ± 1.4", "+2.0 ± 0.0"]
    assert means([np.array([-0.004, -1.0])], "{:+.2f}") == ["+0.00", "-1.00"]
    assert str(Table(["a", "b"], [["1", "2"]])) == "| a | b |\n| --- | --- |\n| 1 | 2 |"


def test_errors_are_in_per_cent_with_their_scatter():
    errors = compared.errors()["adhesive"].to_dataset()
    head, (row,) = validation.errors(errors, "area_error")
    assert head == ["surface", "p\\* = 0.003", "p\\* = 0.01"]
    each = [100 * (1 / factor - 1) for factor in compared.AREA_FACTORS.values()]
    expected = f"{np.mean(each):+.1f} ± {np.std(each, ddof=1):.1f}"
    assert row == ["`rough`", expected, expected]
    _, (row,) = validation.errors(compared.errors()["bare"].to_dataset(), "separation_error")
    assert row[1:] == ["+25.0 ± 0.0"] * 2


def test_solutions_of_the_runs_own_states_are_at_no_distance():
    _, rows = validation.distances(compared.errors()["bare"].to_dataset())
    assert [row[2] for row in rows] == ["0.000 ± 0.000", "0.000 ± 0.000", "1.000 ± 0.000"]


def test_grids_are_compared_where_both_are():
    def bare(entry, seeds, area):
        return compared.solutions(
            entry, lambda labels: labels.material == "hertz" and labels.seed in seeds, area=lambda labels: area
        )

    tree = model_error(compared.tree(), [*bare("usual", (1, 2, 3), 1.25), *bare("fine", (2,), 1.30)])
    _, (areas, gaps) = validation.own_error(datasets(tree), {"usual": "2 cells", "fine": "4 cells"})
    assert areas == ["4 cells instead of 2 cells: area, %", "+4.00", "+4.00"]
    assert gaps[1:] == ["+0.00", "+0.00"]


def test_effect_of_the_range_is_over_the_same_surfaces_without_adhesion():
    _, rows = validation.effect_of_range(datasets(compared.errors()), "bare", ["adhesive"])
    by_name = {row[1]: row[2] for row in rows}
    runs = compared.errors()
    own = runs["adhesive"]["contact_area_fraction"].values / runs["bare"]["contact_area_fraction"].values
    first = own[..., 0].ravel()
    assert by_name["A, ICHA"] == f"{first.mean():.3f} ± {first.std(ddof=1):.3f}"
    factors = np.array(list(compared.AREA_FACTORS.values()))
    truth = first * factors / 1.25
    assert by_name["A, boundary elements, zero gap"] == f"{truth.mean():.3f} ± {truth.std(ddof=1):.3f}"
    energetic = truth * 1.2
    assert by_name["A, boundary elements, energetic"] == f"{energetic.mean():.3f} ± {energetic.std(ddof=1):.3f}"


def test_a_summary_has_the_median_and_the_range_of_the_means():
    entries = datasets(compared.errors())
    bare, adhesive = validation.summary(entries["bare"]), validation.summary(entries["adhesive"])
    assert bare["area"] == "-20.0 % (-20.0 to -20.0 %)" and bare["separation"] == "+25.0 % (+25.0 to +25.0 %)"
    assert bare["states"] == 6 and not bare["adhesive"] and adhesive["adhesive"]
    each = [100 * (1 / factor - 1) for factor in compared.AREA_FACTORS.values()]
    assert float(adhesive["area"].split()[0]) == pytest.approx(np.mean(each), abs=0.05)


def test_what_is_known_stands_below_what_bounded_it():
    errors = compared.short_range_errors()
    _, rows = validation.known_now(
        validation.of_energy(errors["one"].to_dataset(), True), errors["adhesive"].to_dataset()
    )
    each = np.array([100 * (1 / factor - 1) for factor in compared.AREA_FACTORS.values()])
    energetic = (each + 100) / 1.2 - 100
    known = 100 * (1 / 1.5 - 1)
    for row, values in zip(rows, (each, energetic, np.full(3, known)), strict=True):
        assert row[2:] == [f"{np.mean(values):+.1f} ± {np.std(values, ddof=1):.1f}"] * 2


def test_both_kinds_of_boundary_elements_are_compared_without_adhesion():
    errors = compared.short_range_errors()
    bare = validation.of_energy(errors["one"].to_dataset(), False)
    assert bare["material"].values.tolist() == ["hertz"]
    _, (areas, gaps) = validation.both_truths(bare, errors["bare"].to_dataset())
    # 1.5 over 1.25 of the runs' area, 0.9 over 0.8 of their gap.
    assert areas[2:] == ["+20.00 ± 0.00"] * 2 and gaps[2:] == ["+12.50 ± 0.00"] * 2


# Sources of the error.

PRESSURES = [2e-3, 1e-2]


@pytest.fixture(scope="module")
def sources():
    spectrum = icha.SelfAffineSpectrum(
        period=1.0, rolloff_wavelength=0.4, short_wavelength=0.15, hurst=0.8, rms_slope=0.5
    )
    hard = icha.Material(contact_modulus=2.0, surface_energy=0.0, interaction_range=1e-3)
    return sources_of(spectrum.realise(grid=32, seed=3), hard, PRESSURES, seed=3)


def test_ratios_have_means_and_deviations_of_the_datasets(sources):
    factor = xr.where(sources["variant"] == "icha", 1.1, 1.0)
    other = sources.assign(seed=4, contact_area_fraction=sources["contact_area_fraction"] * factor)
    area = sources["contact_area_fraction"].isel(reduced_pressure=0)
    ratio = float(area.sel(variant="icha") / area.sel(variant="boundary_elements"))
    _, (row, *_) = error_sources.ratios([sources, other], "contact_area_fraction")
    assert row[:2] == ["ICHA", f"{1.05 * ratio:.3f} ± {0.1 * ratio / np.sqrt(2):.3f}"]
    assert error_sources.surfaces([sources, other])["seeds"] == "3, 4"


def test_table_of_the_split_has_the_whole_load(sources):
    _, rows = error_sources.split([sources])
    loads = np.array([[cell.split("/") for cell in row[1:]] for row in rows if "load" in row[0]], dtype=float)
    assert loads.sum(axis=0) == pytest.approx(np.full((len(PRESSURES), 2), 100), abs=0.3)


def test_steps_add_up_to_the_error_of_the_area(sources):
    area = sources["contact_area_fraction"]
    whole = 100 * np.log(area.sel(variant="icha") / area.sel(variant="boundary_elements")).values
    _, (*steps, total) = error_sources.steps([sources])
    assert [float(cell) for cell in total[1:]] == pytest.approx(whole, abs=0.051)
    assert np.sum([[float(cell) for cell in row[1:]] for row in steps], axis=0) == pytest.approx(whole, abs=0.3)


# One asperity.


def at(tabor_parameter, approaches=(3.0, 1.5)):
    return compare_asperity(tabor_parameter, approaches=list(approaches), period=10.0)


@pytest.fixture(scope="module")
def long_ranges():
    return [at(1.25), at(2.0)]


def test_there_is_a_row_for_every_tabor_parameter(long_ranges):
    head, rows = one_asperity.errors(long_ranges[::-1])
    assert [row[0] for row in rows] == ["1.25", "2"]
    for row, one in zip(rows, long_ranges, strict=True):
        cells = dict(zip(head, row, strict=True))
        assert cells["n"] == f"{int(one.grid)}"
        least, largest = (100 * float(end) for end in (one.force_error.min(), one.force_error.max()))
        assert cells["force, same approach"] == f"{least:+.1f} to {largest:+.1f}"
        assert cells["pull-off force"] == f"{100 * float(one.pull_off_error):+.1f}"
    assert one_asperity.cell(long_ranges) == {"period": "10", "approaches": ["3", "1.5"]}


@pytest.fixture(scope="module")
def hertzian():
    return hertz_asperity(grid=128, period=10.0)


def test_without_adhesion_the_range_of_radii_is_told(hertzian):
    bare = one_asperity.without_adhesion(hertzian)
    assert (bare["least"], bare["most"], bare["grid"]) == ("0.5", "1", 128)


def test_like_is_compared_with_like(long_ranges):
    with pytest.raises(ValueError, match="periods and approaches are not the same for all"):
        one_asperity.cell([long_ranges[0], at(1.25, approaches=[2.0])])


# The words around them.


def test_pages_can_be_written_of_their_datasets(sources, long_ranges, hertzian):
    def truth(entry, material, seeds=(1, 2, 3)):
        return compared.solutions(entry, lambda labels: labels.material == material and labels.seed in seeds)

    grids = [*truth("adhesionless", "hertz"), *truth("coarse", "hertz", (2,)), *truth("fine", "hertz", (2,))]
    ranges = [*truth("adhesive", "soft"), *truth("ranges", "soft"), *truth("shortest_range", "soft", (1,))]
    errors = datasets(model_error(compared.tree(), [*grids, *ranges], runs=compared.patches()))
    errors["short_range"] = errors.pop("one")
    ways = {"campaign": compared.tree(), "loops": {}}
    pages = {
        "validation": {"model_error": errors, "hertz": hertzian, "adhesive": long_ranges, **ways},
        "error_sources": {"adhesionless": [sources], "adhesive": [sources.assign(surface_energy=1.0)]},
    }
    for page, given in pages.items():
        text = render(page, command="some command", **given)
        assert text.startswith("# ") and "`some command`" in text and "](images/fig1" in text
        assert "nan" not in text and "{" not in text
