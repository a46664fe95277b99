# Surfaces at rms slope 1 (shared by all slopes and materials), theories, and runs: one rule for each batch. With
# `update`, a batch keeps the files that exist with the expected stamps. A failed run does not fail its batch.

from itertools import chain


def surface_rules():
    """Yield name of the rule, folder, batch, inputs and function for arguments."""
    for batch in surface_batches(CAMPAIGN, FILES.surfaces):
        names = dict.fromkeys(FILES.surfaces[path][0] for path in batch.files)
        # Files of the user are compared by content, not by time, because the stamp contains their checksums.
        files = ancient([CAMPAIGN.surfaces[name].path for name in names if CAMPAIGN.surfaces[name].from_file])
        yield f"make_{batch.name}", "surfaces", batch, files, surface_arguments


def theory_rules():
    """Yield the same for batches of theories."""
    for batch in theory_batches(FILES.theories):
        surfaces = surfaces_for({path: FIRST_SURFACES[FILES.theories[path]] for path in batch.files})
        yield f"compute_{batch.name}", "references", batch, surfaces, theory_arguments


def run_rules():
    """Yield the same for batches of runs."""
    for batch in run_batches(CAMPAIGN, FILES.runs):
        surfaces = surfaces_for({path: surface_of(FILES.runs[path]) for path in batch.files})
        yield f"run_{batch.name}", "runs", batch, surfaces, run_arguments


for name, folder, batch, inputs, arguments in chain(surface_rules(), theory_rules(), run_rules()):

    rule:
        name:
            name
        input:
            inputs,
        output:
            [update(path) for path in batch.files],
        log:
            f"<logs>/{folder}/{batch.name}.log",
        benchmark:
            f"<benchmarks>/{folder}/{batch.name}.jsonl"
        # Long batches of runs start first; otherwise, at the end, one long run could occupy one core while others are
        # idle.
        priority: int(batch.seconds) if folder == "runs" else 0
        conda:
            "../envs/icha.yaml"
        threads: batch.threads
        resources:
            mem_mb=batch.memory,
            runtime=batch.minutes,
        params:
            files=as_it_is(LongList(map(arguments, batch.files))),
            kind=folder,
            label=batch.name,
            number=len(batch.files),
        message:
            "Batch {params.label}, {params.number} files"
        script:
            "../scripts/compute_batch.py"

    MADE.update((str(path), path) for path in getattr(rules, name).output)
