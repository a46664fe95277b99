"""The plan contains every file with its cost, and names what the machine lacks."""

import pytest
import yaml
from conftest import REPOSITORY
from demo_configuration import file_surface, measured_surface

from icha.configuration.load import load_configuration
from icha.planning.batches import figure_batches, is_resumable, run_batches
from icha.planning.costs import BATCH, JOB, START, WORKFLOW_MEMORY, Cost
from icha.planning.plan import DONE, RUNS, TO_DO, Item, find_shortages, memory_on, needed_for, plan, time_on
from icha.planning.results import campaign_files, needed_files
from icha.planning.run_costs import run_costs
from icha.planning.validity import surface_facts
from icha.surfaces.measured.topography import prepared_topography
from icha.surfaces.summits import find_summits

GB = 1e9
# Surfaces of all kinds with two materials, in one study and a figure.
CHANGES = {
    "confirmed": ["surfaces.scan.grid", "surfaces.map.path"],
    "surfaces.scan": measured_surface(path="scan.npy", size="50 um", height_unit="um"),
    "surfaces.map": file_surface("map.npy") | {"period": "50 um"},
    "materials.bare": {"contact_modulus": "25 MPa", "surface_energy": "0 mJ/m^2"},
    "studies.one": {
        "surfaces": ["rough", "scan", "map"],
        "seeds": [1],
        "rms_slopes": [1.0],
        "materials": ["bare", "soft"],
        "targets": {"reduced_pressures": [1e-3, 1e-2]},
    },
    "figures": {"fig2_area_and_gap": {"study": "one"}},
}
# The study of the random surface alone.
ROUGH = CHANGES | {"confirmed": [], "studies.one.surfaces": ["rough"], "figures": {}}


def test_tensile_targets_have_a_cost(read, tmp_path):
    campaign = read(ROUGH | {"studies.one.materials": ["soft"], "studies.one.targets": {"pressures": ["-10 kPa"]}})
    assert all(item.cost.seconds > 0 for item in plan(campaign, tmp_path) if item.part == RUNS)


def test_the_summits_of_a_measured_surface_are_counted_in_its_file(campaign):
    section = campaign.surfaces["scan"]
    surface = prepared_topography(section.path, section.preparation).surface
    counted = surface_facts(campaign, "scan")["summits"]
    assert counted == len(find_summits(surface))
    assert surface_facts(campaign, "map")["summits"] != pytest.approx(counted, rel=0.1)


def test_every_file_that_costs_something_is_planned(campaign, tmp_path):
    planned, files = {item.path: item for item in plan(campaign, tmp_path)}, campaign_files(campaign)
    # The other files of a figure come from the job of its PNG; a verdict is one line.
    without_cost = {files.verdict, *(path for path in files.figures if not path.endswith(".png"))}
    assert planned.keys() == set(files.computed) - without_cost
    # Files share the start of their job.
    cost = planned[next(iter(files.runs))].cost
    assert cost.work == pytest.approx(cost.seconds * (1 + JOB / BATCH))


def test_targets_need_a_part_of_the_files(campaign, tmp_path):
    items, files = plan(campaign, tmp_path), campaign_files(campaign)
    assert {item.path for item in needed_for(["runs", "--forceall"], items)} == {*files.surfaces, *files.runs}
    assert files.dataset in {item.path for item in needed_for(["dataset"], items)}
    assert [item.path for item in needed_for([f"results/demo/{files.report}"], items)] == [files.report]
    assert needed_files(files, ["surfaces"]) == {*files.surfaces}
    assert needed_files(files, ["references", "runs"]) == {*files.surfaces, *files.runs, *files.theories}
    for targets in ([], ["all"], ["surfaces", files.report]):
        assert needed_files(files, targets) == {*files.surfaces, *files.runs, *files.theories}
    assert needed_for([], items) == needed_for(["--forceall"], items) == needed_for(["runs", "all"], items) == items


def test_new_seeds_at_the_end_change_only_the_last_batch(read):
    before = []
    for seeds in (3, 40, 41, 400):
        campaign = read(ROUGH | {"studies.one.seeds": f"1..{seeds}"})
        batches = run_batches(campaign, campaign_files(campaign).runs)
        assert batches[: len(before) - 1] == before[:-1] and all(batch.seconds <= BATCH for batch in batches)
        assert sum(len(batch.files) for batch in batches) == 2 * seeds
        before = batches
    # Several cores share a small group.
    assert before[0].seconds <= BATCH / 5 < before[-2].seconds


def test_figures_are_drawn_in_batches_and_own_figures_alone():
    names = [f"fig{k}_one" for k in range(1, 8)] + ["mine", "other"]
    batches = [batch.files for batch in figure_batches(dict.fromkeys(names, 0))]
    assert [name for batch in batches for name in batch] == names and batches[-2:] == [["mine"], ["other"]]
    assert len(batches) == 3 + 2


def test_times_of_finished_runs_correct_the_times_of_their_study(campaign, tmp_path):
    def seconds():
        return {item.path: item.cost.seconds for item in plan(campaign, tmp_path) if item.part == RUNS}

    before, path = seconds(), next(iter(campaign_files(campaign).runs))
    log = tmp_path / "logs/runs/one_asperities_0.log"
    log.parent.mkdir(parents=True)
    log.write_text(f"{campaign.name}/{path.removesuffix('.nc')}: computed in {4 * before[path]} s\n")
    assert seconds() == pytest.approx({path: 2 * each for path, each in before.items()})


def item(name, seconds=1.0, memory=1 * GB, state=TO_DO):
    return Item("part", "group", name, state, "", Cost(seconds, memory, 5 * GB))


def test_time_is_that_of_the_start_and_of_the_work_or_the_longest_job():
    jobs = [item("a", 10), item("b", 2), item("c", 4)]
    assert time_on(jobs, 1) == pytest.approx(START + 16 * (1 + JOB / BATCH))
    assert time_on(jobs, 10**6) == pytest.approx(START + 10)
    assert time_on([item("a", state=DONE)], 1) == 0


def test_memory_is_that_of_parallel_jobs_and_of_snakemake():
    jobs = [item("a", memory=3 * GB), item("b", memory=2 * GB), item("c", memory=1 * GB)]
    used = [memory_on(jobs, cores) - WORKFLOW_MEMORY for cores in (1, 2, 4)]
    assert used == pytest.approx([3 * GB, 5 * GB, 6 * GB])
    # Snakemake limits the memory of parallel jobs.
    large = [item(name, memory=13 * GB) for name in "ab"]
    assert memory_on(large, 2) - WORKFLOW_MEMORY == pytest.approx(14 * GB)
    assert memory_on([item("a", state=DONE)], 2) == 0


def test_a_lack_of_memory_or_disk_space_is_reported(monkeypatch, tmp_path):
    jobs = [item(name, memory=12 * GB) for name in "ab"]
    monkeypatch.setattr("icha.planning.plan.memory_of_machine", lambda: 13 * GB)
    monkeypatch.setattr("icha.planning.plan.free_disk", lambda folder: 100 * GB)
    (said,) = find_shortages(jobs, 2, tmp_path)
    assert said.startswith("jobs on 2 cores need about 14.3 GB of memory, but this machine has 13 GB")
    assert find_shortages(jobs, 1, tmp_path) == []
    # On a cluster the memory of this machine does not matter.
    assert find_shortages(jobs, 2, tmp_path, local=False) == []
    monkeypatch.setattr("icha.planning.plan.free_disk", lambda folder: 9 * GB)
    (said,) = find_shortages(jobs, 1, tmp_path)
    assert said.startswith(f"{tmp_path} needs about 10 GB of disk space, but only 9 GB are free")
    assert find_shortages([item("a"), item("b", state=DONE)], 1, tmp_path) == []


def test_boundary_elements_use_one_core_and_save_checkpoints_on_large_grids(read):
    both = {"studies.one.models": ["asperities", "boundary_elements"]}
    campaign = read(ROUGH | both | {"surfaces.rough.grid": 2048})
    threads = {case.model: cost.threads for case, cost in run_costs(campaign).items()}
    resumable = {case.model: is_resumable(campaign, case) for case in campaign_files(campaign).runs.values()}
    assert threads == {"asperities": 2, "boundary_elements": 1}
    assert resumable == {"asperities": False, "boundary_elements": True}


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
