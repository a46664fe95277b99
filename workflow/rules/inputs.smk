# The configuration as used, topographies at rms slope 1 (shared by all slopes and materials), and theories.

from icha.planning.requirements import surface_memory, surface_threads


rule configuration:
    input:
        as_it_is(list(COPIED.values())),
    output:
        FILES.configuration,
        list(COPIED),
    log:
        "<logs>/configuration.log",
    benchmark:
        "<benchmarks>/configuration.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=200,
        runtime=2,
    params:
        # A dry run prints a checksum, not the text.
        text=as_it_is(LongList([CONFIG_TEXT])),
        # Copied files are compared by content, not by time.
        sha256=lambda wildcards: [sha256_of(Path(file)) for file in COPIED.values()],
        code=code_of("write_configuration.py"),
    message:
        "Writing the configuration as used"
    script:
        "../scripts/write_configuration.py"


# One rule for each batch. With `update`, a batch keeps the files that exist with the expected stamps. Files of the user
# are compared by content, not by time, because the stamp contains their checksums.
for batch in surface_batches(CAMPAIGN, FILES.surfaces):
    names = dict.fromkeys(FILES.surfaces[path][0] for path in batch.files)

    rule:
        name:
            f"make_{batch.name}"
        input:
            ancient([CAMPAIGN.surfaces[name].path for name in names if CAMPAIGN.surfaces[name].from_file]),
        output:
            [update(path) for path in batch.files],
        log:
            f"<logs>/surfaces/{batch.name}.log",
        benchmark:
            f"<benchmarks>/surfaces/{batch.name}.jsonl"
        conda:
            "../envs/icha.yaml"
        threads: max(surface_threads(CAMPAIGN, name) for name in names)
        resources:
            mem_mb=max(surface_memory(CAMPAIGN, name) for name in names),
            runtime=30,
        params:
            files=as_it_is(LongList(map(surface_arguments, batch.files))),
            number=len(batch.files),
        message:
            "Surfaces, {params.number} realisations"
        script:
            "../scripts/make_surfaces.py"

    register(f"make_{batch.name}")


for batch in theory_batches(FILES.theories):

    rule:
        name:
            f"compute_{batch.name}"
        input:
            surfaces_for({path: FIRST_SURFACES[FILES.theories[path]] for path in batch.files}),
        output:
            [update(path) for path in batch.files],
        log:
            f"<logs>/references/{batch.name}.log",
        benchmark:
            f"<benchmarks>/references/{batch.name}.jsonl"
        conda:
            "../envs/icha.yaml"
        resources:
            mem_mb=600,
            runtime=10,
        params:
            files=as_it_is(LongList(map(theory_arguments, batch.files))),
            number=len(batch.files),
        message:
            "Theories and literature for {params.number} surfaces"
        script:
            "../scripts/make_references.py"

    register(f"compute_{batch.name}")
