# publish/<campaign>-<version>/ and its .zip: everything that a reader needs, with checksums. See docs/howto/publish.md.


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
        results=as_it_is(RESULTS),
        named_files=as_it_is(NAMED_FILES),
        project=as_it_is(workflow.basedir),
        # The source is part of the deposit, comments and all.
        commit=lambda wildcards: committed_source(workflow.basedir).commit,
    message:
        "Deposit {PUBLICATION.version}"
    script:
        "../scripts/publish.py"
