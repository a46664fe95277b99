# publish/<campaign>-<version>/ and its .zip: everything that a reader needs, with checksums. See docs/howto/publish.md.


def what_is_published(wildcards):
    """The files of a deposit; ends the program where there can be none, before anything is computed."""
    refuse_unpublishable(CONFIGURATION, workflow.basedir)
    return [
        CONFIG_USED,
        *INPUTS,
        DATASET,
        COMPARISON,
        CHECKS,
        VERDICT,
        REPORT,
        *FIGURES,
        *SURFACES,
        *RUNS,
        *REFERENCES,
        *MODEL_ERROR,
    ]


rule deposit:
    input:
        what_is_published,
    output:
        checksums=f"{DEPOSIT}/SHA256SUMS",
        archive=f"{DEPOSIT}.zip",
    log:
        f"{LOGS}/publish.log",
    benchmark:
        f"{BENCHMARKS}/publish.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=500,
        runtime=30,
    params:
        results=RESULTS,
        named_files=as_it_is(NAMED_FILES),
        project=workflow.basedir,
        # The source is part of the deposit, comments and all.
        commit=lambda wildcards: committed_source(workflow.basedir).commit,
    message:
        "Deposit {PUBLICATION.version}"
    script:
        "../scripts/publish.py"
