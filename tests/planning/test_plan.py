"""The plan contains every file with its cost, and names what the machine lacks."""

import numpy as np
import pytest
import yaml
from conftest import REPOSITORY

from icha.configuration.load import load_configuration
from icha.planning import requirements
from icha.planning.costs import WORKFLOW, Cost
from icha.planning.plan import DONE, TO_DO, Item, memory_on, plan, start_up, time_on
from icha.planning.results import campaign_files
from icha.planning.validity import surface_facts
from icha.surfaces.measured.topography import prepared_topography
from icha.surfaces.summits import find_summits

GB = 1e9
CAMPAIGN = """
name: scanned
title: Scanned
summary: For tests.
license: CC0-1.0
confirmed: [surfaces.scan.grid, surfaces.map.path]
surfaces:
  rough: {kind: self_affine, period: 100 um, rolloff_wavelength: 40 um, short_wavelength: 14.3 um, hurst: 0.8, grid: 32}
  scan: {kind: measured, path: scan.npy, size: 50 um, height_unit: um, boundary: window}
  map: {kind: file, path: map.npy, period: 50 um, height_unit: um}
materials:
  bare: {contact_modulus: 25 MPa, surface_energy: 0 mJ/m^2, interaction_range: 2 nm}
  soft: {contact_modulus: 25 MPa, surface_energy: 50 mJ/m^2, interaction_range: 2 nm}
studies:
  load:
    surfaces: [rough, scan, map]
    seeds: [1]
    rms_slopes: [1.0]
    materials: [bare, soft]
    targets: {reduced_pressures: [1.0e-3, 1.0e-2]}
figures:
  fig2_area_and_gap: {study: load}
"""


@pytest.fixture
def campaign(tmp_path):
    heights = np.random.default_rng(1).normal(size=(40, 40))
    np.save(tmp_path / "scan.npy", heights)
    np.save(tmp_path / "map.npy", heights[:30, :30])
    (tmp_path / "scanned.yaml").write_text(CAMPAIGN)
    return load_configuration(tmp_path / "scanned.yaml").campaign


def test_tensile_targets_have_a_cost(tmp_path):
    text = CAMPAIGN.replace("[rough, scan, map]", "[rough]").replace("[bare, soft]", "[soft]")
    text = text.replace("reduced_pressures: [1.0e-3, 1.0e-2]", "pressures: [-10 kPa]").replace("map.npy", "scan.npy")
    (tmp_path / "scanned.yaml").write_text(text)
    np.save(tmp_path / "scan.npy", np.random.default_rng(1).normal(size=(40, 40)))
    items = plan(load_configuration(tmp_path / "scanned.yaml").campaign, tmp_path)
    assert all(item.cost.seconds > 0 for item in items if item.is_run)


def test_the_summits_of_a_measured_surface_are_counted_in_its_file(campaign):
    section = campaign.surfaces["scan"]
    surface = prepared_topography(section.path, section.preparation).surface
    counted = surface_facts(campaign, "scan")["summits"]
    assert counted == len(find_summits(surface))
    assert surface_facts(campaign, "map")["summits"] != pytest.approx(counted, rel=0.1)


def test_every_file_that_costs_something_is_planned(campaign, tmp_path):
    planned = {item.path for item in plan(campaign, tmp_path)}
    files = campaign_files(campaign)
    # PDF and caption of a figure come from the job of its PNG; a verdict is one line.
    assert planned == {path for path in files.computed if not path.endswith((".pdf", ".txt"))}


def test_files_derived_from_new_files_are_made_again(campaign, tmp_path):
    files = campaign_files(campaign)
    for path in (*files.surfaces, files.dataset, files.comparison, files.checks, *files.figures, files.report):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text("made of other runs")
    states = {item.path: item.state for item in plan(campaign, tmp_path)}
    assert all(states[path] == DONE for path in files.surfaces)
    assert all(states[path] == TO_DO for path in (*files.runs, files.dataset, files.checks, files.report))
    assert states[files.figures[0]] == TO_DO


def item(name, seconds=1.0, memory=1 * GB, stage=0, state=TO_DO, threads=1):
    return Item("part", "run", name, state, Cost(seconds, memory, 5 * GB), threads, stage=stage)


def test_time_is_that_of_the_start_and_of_one_stage_after_the_other():
    jobs = [item("a", 10), item("b", 2), item("c", 4, stage=1)]
    start, job = start_up(jobs), WORKFLOW.job
    assert start > WORKFLOW.start
    assert time_on(jobs, 1) == pytest.approx(start + 16 + 3 * job)
    assert time_on(jobs, 10**6) == pytest.approx(start + 10 + 4)
    assert time_on([item("a", state=DONE)], 1) == 0


def test_memory_is_that_of_parallel_jobs_and_of_snakemake():
    jobs = [item("a", memory=3 * GB), item("b", memory=2 * GB), item("c", memory=1 * GB)]
    around = WORKFLOW.memory
    assert [memory_on(jobs, cores) - around for cores in (1, 2, 4)] == pytest.approx([3 * GB, 5 * GB, 6 * GB])
    assert memory_on([item("a", state=DONE)], 2) == 0


def test_a_lack_of_memory_is_reported_with_a_sufficient_number_of_cores(monkeypatch, tmp_path):
    jobs = [item(name, memory=20 * GB) for name in "abc"]
    monkeypatch.setattr(requirements, "memory_of_machine", lambda: 24 * GB)
    monkeypatch.setattr(requirements, "free_disk", lambda folder: 100 * GB)
    (said,) = requirements.find_shortages(jobs, 2, tmp_path, {})
    assert said.startswith(
        "jobs on 2 cores need about 40.3 GB of memory, but this machine has 24 GB; --cores 1 needs 20"
    )
    assert requirements.find_shortages(jobs, 1, tmp_path, {}) == []
    # Snakemake limits the memory of parallel jobs.
    assert requirements.find_shortages(jobs, 2, tmp_path, {"executor": "icha", "resources": ["mem_mb=23000"]}) == []
    # On a cluster the memory of this machine does not matter.
    assert requirements.find_shortages(jobs, 2, tmp_path, {"executor": "slurm-batches"}) == []
    (said,) = requirements.find_shortages([item("a", memory=30 * GB)], 2, tmp_path, {"resources": ["mem_mb=14000"]})
    assert said.startswith("jobs on 2 cores need about 30.3 GB of memory") and "--cores" not in said


def test_a_lack_of_disk_space_is_reported_with_the_free_space(monkeypatch, tmp_path):
    monkeypatch.setattr(requirements, "free_disk", lambda folder: 9 * GB)
    (said,) = requirements.find_shortages([item("a"), item("b")], 2, tmp_path, {})
    assert said.startswith(f"{tmp_path} needs about 10 GB of disk space, but only 9 GB are free")
    assert requirements.find_shortages([item("a"), item("b", state=DONE)], 2, tmp_path, {}) == []


def test_runs_of_both_models_at_given_loads_are_compared(tmp_path):
    content = yaml.safe_load((REPOSITORY / "config/campaigns/smoke.yaml").read_text(encoding="utf-8"))
    del content["figures"]
    for study in ("challenge", "multi_slope"):  # at given loads, and at given areas
        content["studies"][study]["models"] = ["asperities", "boundary_elements"]
    (tmp_path / "both.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    files = campaign_files(load_configuration(tmp_path / "both.yaml").campaign)
    assert files.model_error == ["aggregated/model_error.nc"]
    assert {case.study for case in files.compared.values()} == {"challenge"}
    assert set(files.compared) < set(files.runs) and all("/boundary_elements/" in file for file in files.compared)
