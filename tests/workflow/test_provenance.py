"""The jobs that made the results, from the records of Snakemake."""

from pathlib import Path

import pytest
from snakemake.persistence import MetadataRecord
from snakemake.persistence.file import FilePersistence

WORKFLOW = Path(__file__).parents[2] / "workflow"
RESULTS = "results/mine"
SURFACE = f"{RESULTS}/surfaces/a/seed1.nc"
RUN = f"{RESULTS}/runs/load/{'long-' * 40}name/seed1/slope0.5/soft.nc"
FIGURE = [f"{RESULTS}/figures/fig.png", f"{RESULTS}/figures/fig.pdf"]
USED = f"{RESULTS}/config.used.yaml"
SCAN = "/somewhere/scan 1.npy"
MADE = {name: name.removeprefix(f"{RESULTS}/") for name in (SURFACE, RUN, *FIGURE)}
GIVEN = {USED: "config.used.yaml", SCAN: "inputs/scan 1.npy"}
SETTINGS = {
    "material": {"contact_modulus": 2e6, "label": "soft", "tint": None},
    "seed": 1,
    "path": "/somewhere/scan 1.npy",
}


@pytest.fixture
def recorded_jobs(monkeypatch):
    monkeypatch.syspath_prepend(str(WORKFLOW))
    from provenance import recorded_jobs

    return recorded_jobs


def recorded(folder, start=0.0):
    """Write records of three jobs and of a job of another campaign with Snakemake's own code; return their folder."""
    persistence = FilePersistence(path=folder / ".snakemake")

    def record(rule, script, inputs, outputs, params, campaign="mine", begun=start):
        for output in outputs:
            entry = MetadataRecord(
                rule=rule,
                input=inputs,
                log=[f"results/{campaign}/logs/{rule}.log"],
                params=[repr(value) for value in params],
                code=f'        "../scripts/{script}.py"\n',
                starttime=begun,
                endtime=begun + 1,
                incomplete=False,
            )
            persistence._write_record(output, entry)

    record("surface", "make_surface", [SCAN], [SURFACE], ["0123456789abcdef", {"kind": "measured"}])
    record("run", "run_sweep", [SURFACE], [RUN], ["f" * 16, SETTINGS, {"campaign": "mine", "license": "CC0-1.0"}])
    record("figure", "draw_figure", [RUN, USED], FIGURE, [[], {"study": "load"}], begun=-start)
    record("run", "run_sweep", ["results/other/a.nc"], ["results/other/b.nc"], [], campaign="other")
    return folder / ".snakemake/metadata"


def test_jobs_do_not_depend_on_the_times_of_the_records(recorded_jobs, tmp_path):
    found = recorded_jobs(recorded(tmp_path, 1e9), MADE, GIVEN, scripts=WORKFLOW / "scripts")
    figure, run, surface = found
    assert (figure.rule, run.rule, surface.rule) == ("figure", "run", "surface")
    assert surface.inputs == ("inputs/scan 1.npy",) and surface.outputs == (MADE[SURFACE],)
    assert run.inputs == (MADE[SURFACE],) and run.outputs == (MADE[RUN],)
    assert figure.inputs == tuple(sorted((MADE[RUN], "config.used.yaml")))
    assert figure.outputs == ("figures/fig.pdf", "figures/fig.png")  # one job
    assert run.script == "source/workflow/scripts/run_sweep.py"
    assert (WORKFLOW / "scripts/run_sweep.py").read_text().startswith(f'"""{run.description}')
    # Settings have names; paths of this machine are omitted.
    assert run.parameters == (("material.contact_modulus", "2000000.0"), ("material.label", "soft"), ("seed", "1"))
    assert figure.parameters == (("study", "load"),) and surface.parameters == (("kind", "measured"),)
    reverse = dict(reversed(MADE.items()))
    assert recorded_jobs(recorded(tmp_path / "again", -1e9), reverse, GIVEN, scripts=WORKFLOW / "scripts") == found


def test_a_result_without_a_record_is_named_with_the_command_to_use(recorded_jobs, tmp_path):
    records = recorded(tmp_path)
    unknown = f"{RESULTS}/report.html"
    with pytest.raises(ValueError, match=rf"^{unknown}: its record in .* is missing, .*-- --touch --forceall"):
        recorded_jobs(records, MADE | {unknown: "report.html"}, GIVEN, scripts=WORKFLOW / "scripts")
    with pytest.raises(ValueError, match=r"(surfaces/a/seed1.nc|fig.pdf): its record in .* is missing"):
        recorded_jobs(tmp_path / "nothing", MADE, GIVEN, scripts=WORKFLOW / "scripts")
    FilePersistence(path=tmp_path / ".snakemake")._write_record(SURFACE, MetadataRecord(incomplete=True))
    with pytest.raises(ValueError, match=r"seed1.nc: its record in .* is incomplete"):
        recorded_jobs(records, MADE, GIVEN, scripts=WORKFLOW / "scripts")
    for file in records.iterdir():
        if file.is_file():
            file.write_text("{")
    with pytest.raises(ValueError, match=r": its record in .* cannot be read"):
        recorded_jobs(records, MADE, GIVEN, scripts=WORKFLOW / "scripts")


def test_inputs_of_results_must_be_in_the_deposit(recorded_jobs, tmp_path):
    without = {USED: GIVEN[USED]}
    with pytest.raises(ValueError, match=rf"^{SCAN}: {SURFACE} was made from this file"):
        recorded_jobs(recorded(tmp_path), MADE, without, scripts=WORKFLOW / "scripts")
