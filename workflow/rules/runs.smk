# Runs. One job computes a batch of short runs or one long run. A failed run does not fail its batch.

from icha.configuration.cases import run_settings
from icha.datasets.results import SURFACE
from icha.planning.requirements import is_resumable, run_memory, run_minutes, run_threads


def surface_of(case):
    """Return the path of the surface of a run."""
    return f"{RESULTS}/{SURFACE}".format(surface=case.surface, seed=case.seed)


def run_arguments(path):
    """Return the arguments of the task that computes a run."""
    case = FILES.runs[path]
    return run_settings(CAMPAIGN, case) | {
        "surface": surface_of(case),
        "attributes": ATTRIBUTES | {"study": case.study} | STAMPS[path],
        "resumable": is_resumable(CAMPAIGN, case),
    }


for batch in run_batches(CAMPAIGN, FILES.runs):
    cases = [FILES.runs[path] for path in batch.files]

    rule:
        name:
            rule_name("run", batch)
        input:
            surfaces_for({path: surface_of(FILES.runs[path]) for path in batch.files}),
        output:
            [update(path) for path in batch.files],
        log:
            f"<logs>/runs/{batch.name}.log",
        benchmark:
            f"<benchmarks>/runs/{batch.name}.jsonl"
        # Long batches start first; otherwise, at the end, one long run could occupy one core while others are idle.
        priority: int(batch.seconds)
        conda:
            "../envs/icha.yaml"
        threads: max(run_threads(CAMPAIGN, case) for case in cases)
        resources:
            mem_mb=max(run_memory(CAMPAIGN, case) for case in cases),
            runtime=max(run_minutes(CAMPAIGN, case) for case in cases),
        params:
            files=as_it_is(LongList(map(run_arguments, batch.files))),
            label=batch.name,
            number=len(batch.files),
        message:
            "Runs {params.label}, {params.number} runs"
        script:
            "../scripts/run_batch.py"
