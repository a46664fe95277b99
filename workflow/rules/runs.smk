# Runs. One job computes a batch of short runs or one long run. A failed run does not fail its batch.

from icha.planning.requirements import run_memory, run_minutes, run_threads

for batch in run_batches(CAMPAIGN, FILES.runs):
    cases = {FILES.runs[path]._replace(seed=0) for path in batch.files}

    rule:
        name:
            f"run_{batch.name}"
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

    register(f"run_{batch.name}")
