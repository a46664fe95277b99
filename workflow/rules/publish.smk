# publish/<campaign>-<version>/ and its .zip: results, source and metadata, with checksums. See docs/howto/publish.md.

from publishable import publishable_source

# The source is evaluated once, before anything is computed, and only if the deposit is requested.
SOURCE = cache(lambda: publishable_source(CONFIGURATION, ROOT))


rule deposit:
    input:
        results=lambda wildcards: SOURCE() and [FILES.configuration, *INPUTS, *FILES.computed],
        checksums=FILES.checksums,
    output:
        checksums=f"{FILES.deposit}/SHA256SUMS",
        archive=f"{FILES.deposit}.zip",
    log:
        "<logs>/publish.log",
    benchmark:
        "<benchmarks>/publish.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=500,
        runtime=30,
    params:
        results=as_it_is(RESULTS),
        project=as_it_is(ROOT),
        # The deposit contains the source, including comments.
        revision=lambda wildcards: SOURCE().revision,
    message:
        "Deposit {PUBLICATION.version}"
    script:
        "../scripts/publish.py"
