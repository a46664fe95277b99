"""The page of the benchmarks says what the results say; nothing is measured here."""

import importlib.util
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[2] / "benchmarks" / "page.py"


@pytest.fixture(scope="module")
def page():
    spec = importlib.util.spec_from_file_location("benchmarks_page", PAGE)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def sweep(code, *, adhesion=False, control="load", processor=1.0, area=0.1, gap=1e-6, outcome="complete", stops=1):
    stop = {"pressure": 1e5, "area_fraction": area, "mean_gap": gap, "seconds": processor, "residual": 1e-11}
    return {
        "code": code,
        "grid": 1024,
        "adhesion": adhesion,
        "control": control,
        "threads": 1,
        "limit": 600.0,
        "wall": processor,
        "processor": processor,
        "peak": 2**27,
        "outcome": outcome,
        "last_words": "ModuleNotFoundError: none" if outcome == "failed" else "",
        "version": "1.2",
        "settings": "as usual",
        "stops": [stop] * stops,
    }


def scaling(patches, spots, time):
    stop = {"seconds": time, "spots": spots, "area_fraction": 0.1, "residual": 1e-11, "peak": 2**20 * (100 + spots)}
    about = {"patches": patches, "adhesion": False, "threads": 1, "outcome": "complete", "last_words": ""}
    return about | {"asperities": 2 * spots, "memory_before": 2**20 * 100, "stops": [stop]}


def stages(surface, *, threads=2, wall=100.0, digest="a", stops=20):
    return {
        "surface": surface,
        "adhesion": False,
        "threads": threads,
        "wall": wall,
        "peak": 2**30,
        "outcome": "complete",
        "last_words": "",
        "asperities": 10,
        "stops": stops,
        "stops_asked": 20,
        "spots": 5,
        "area_fraction": 0.1,
        "residual": 1e-11,
        "seconds": {"surface": 1.0, "path": 2.0},
        "peaks": {"surface": 2**20, "path": 2**21},
        "counts": {"equilibria": 7},
        "digest": digest,
        "failure": "",
    }


@pytest.fixture
def results():
    machine = {"processor": "Abacus", "cores": 2, "memory": 2**34, "system": "Linux", "python": "3.11", "versions": {}}
    task = {"grid": 1024, "short_wavelength": 1e-6, "rms_height": 1e-6, "interaction_range": 3e-8}
    return {
        "machine": machine,
        "task-1024": task | {"tabor_parameter": 0.4},
        "sweep-icha-hard-load-1024-1": sweep("icha"),
        "sweep-aspher-hard-load-1024-1": sweep("aspher", processor=31.0, area=0.125, gap=1.1e-6),
        "sweep-tamaas-hard-load-1024-1": sweep("tamaas", processor=100.0),
        "sweep-icha-adhesion-load-1024-1": sweep("icha", adhesion=True, processor=2.0),
        "sweep-adhesion-adhesion-load-1024-1": sweep("adhesion", adhesion=True, processor=100.0, outcome="over time"),
        "scaling-hard-1": scaling(1, 1000, 1.0),
        "scaling-hard-2": scaling(2, 4000, 8.0),
        "scaling-hard-3": scaling(3, 16000, 64.0),
        "stages-512-hard-1": stages("512", threads=1),
        "stages-512-hard-2": stages("512"),
        "stages-challenge-hard-2": stages("challenge"),
    }


def verdict(page, results, start):
    (found,) = [v for v in page.verdicts(results) if v.target.startswith(start)]
    return found


def test_the_fastest_other_code_decides(page, results):
    found = verdict(page, results, "at 1024², without adhesion")
    assert found.reached and "31.0 times (aspher)" in found.measured
    results["sweep-aspher-hard-load-1024-1"]["processor"] = 29.0
    assert verdict(page, results, "at 1024², without adhesion").reached is False


def test_a_code_stopped_at_its_limit_gives_a_lower_bound(page, results):
    found = verdict(page, results, "at 1024², with adhesion")
    assert found.reached is False and found.measured == "more than 50.0 times (adhesion)"
    assert "> 100 s" in page.page(results)


def test_differences_are_taken_from_the_other_code(page, results):
    row = next(row for row in page.sweep_rows(results, 1024, False) if row[0] == "aspher")
    assert row[-2].startswith("-20.0 %") and row[-1].startswith("gap -0.100")


def test_a_code_that_failed_is_named_with_its_reason_and_not_compared(page, results):
    results["sweep-aspher-hard-load-1024-1"] = sweep("aspher", outcome="failed", stops=0)
    assert "failed: ModuleNotFoundError: none" in page.page(results)
    assert "tamaas" in verdict(page, results, "at 1024², without adhesion").measured


def test_exponent_is_that_of_a_power_law(page, results):
    assert page.exponent(results, False, 1) == pytest.approx(1.5)
    assert page.exponent(results, False, 2) == pytest.approx(1.0)
    assert verdict(page, results, "time over number of spots, without").reached is False


def test_what_was_not_measured_is_not_reached(page, results):
    assert verdict(page, results, "full challenge surface by asperities, with adhesion").reached is None
    assert verdict(page, results, "full challenge surface by asperities, without adhesion").reached
    results["stages-challenge-hard-2"]["stops"] = 19
    assert verdict(page, results, "full challenge surface by asperities, without adhesion").reached is False


def test_bytes_that_depend_on_threads_are_seen(page, results):
    assert verdict(page, results, "the number of threads").reached
    results["stages-512-hard-2"]["digest"] = "b"
    assert verdict(page, results, "the number of threads").reached is False


def test_page_and_figures_are_written_alike_from_the_same_results(page, results, tmp_path):
    for name in ("one", "two"):
        page.write(results, tmp_path / name)
    files = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*.*"))
    assert [str(path) for path in files] == [
        "benchmarks.md",
        "images/benchmark_scaling.png",
        "images/benchmark_sweep.png",
    ]
    for path in files:
        assert (tmp_path / "one" / path).read_bytes() == (tmp_path / "two" / path).read_bytes()


def test_a_campaign_spends_its_time_in_the_solver_or_not(page):
    runs = {"grid": 128, "runs": 1000, "seconds_a_run": 0.3, "cores": 2, "whole": {"wall": 250.0}}
    plan = {"runs": 10000, "wall": 16.0, "peak": 2**29, "outcome": "complete"}
    assert page.solver_share(runs) == pytest.approx(0.6)
    rows = [verdict.row() for verdict in page.verdicts({"campaign-runs-128": runs, "campaign-plan": plan})]
    (share,) = [row for row in rows if row[0].startswith("1 000 runs at 128²")]
    (planned,) = [row for row in rows if row[0].startswith("plan of a campaign")]
    assert share[1:] == ["60% at 128²", "reached"]
    assert planned[1] == "16 s, 0.5 GiB" and planned[2] != "reached"


def test_what_people_wait_for_is_held_against_processor_times(page):
    call = {"wall": 9.0, "peak": 2**27, "outcome": "complete"}
    results = {
        "start-help": call | {"processor": 0.1},
        "start-show": call | {"processor": 1.5},
        "start-simulate": {"first": 1.2, "again": 0.2, "overhead": 1.0},
    }
    rows = {verdict.target: verdict.row()[1:] for verdict in page.verdicts(results)}
    assert rows["`icha --help`: at most 0.3 s of processor time"] == ["0.10 s", "reached"]
    assert rows["`icha show` of a run: at most 1 s of processor time"] == ["1.50 s", "**not reached**"]
    (first,) = [row for target, row in rows.items() if "first `icha.simulate`" in target]
    assert first == ["1.00 s", "reached"]


def test_dataset_and_checks_have_one_target_together(page):
    parts = {f"dataset-{part}-10000": {"wall": 59.0, "outcome": "complete"} for part in ("write", "check")}
    (found,) = [verdict for verdict in page.verdicts(parts) if verdict.target.startswith("campaign dataset")]
    assert found.reached and found.measured == "59 s and 59 s"
    parts["dataset-check-10000"]["wall"] = 62.0
    assert verdict(page, parts, "campaign dataset").reached is False


def test_own_boundary_elements_are_no_other_code_and_have_targets_of_their_own(page, results):
    results["sweep-icha-boundary-elements-adhesion-load-1024-1"] = sweep(
        "icha-boundary-elements", adhesion=True, processor=3.0
    )
    assert page.fastest(results, 1024, True)[1] != "icha-boundary-elements"
    assert page.rival(results, results["sweep-icha-boundary-elements-adhesion-load-1024-1"])["code"] == "icha"
    targets = {verdict.target: verdict for verdict in page.verdicts(results)}
    own = "20 loads at 1024² by ICHA's boundary elements, with adhesion: at most 60 s on one core"
    assert targets[own].reached and targets[own].measured == "3.00 s"
    slow = sweep("icha-boundary-elements", adhesion=True, processor=61.0)
    results["sweep-icha-boundary-elements-adhesion-load-1024-1"] = slow
    assert {verdict.target: verdict for verdict in page.verdicts(results)}[own].reached is False


def test_the_full_surface_by_boundary_elements_has_a_target_and_a_table(page, results):
    stop = {"mean_separation": 1e-6, "reduced_pressure": 0.02, "contact_area_fraction": 0.05, "spot_count": 99.0}
    stop |= {"residual": 1e-12, "front_residual": 2e-9}
    results["truth"] = {"wall": 5300.0, "peak": 2**32, "cores": 2, "failure": "", "stops": [stop] * 20}
    found = verdict(page, results, "20 areas of the full challenge surface by ICHA's boundary elements")
    assert found.reached and found.measured == "88 min, 4.0 GiB"
    assert "| 1.00 µm | 0.02 | 5.000 % | 99 |" in page.page(results)
    for worse in ({"wall": 5500.0}, {"peak": 11 * 2**30}, {"failure": "no equilibrium"}):
        slow = results | {"truth": results["truth"] | worse}
        assert verdict(page, slow, found.target).reached is False
