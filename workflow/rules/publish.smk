# publish/<campaign>-<version>/ and its .zip: everything that a reader needs, with checksums. See docs/howto/publish.md.

from publishable import publishable_source

# Looked at once, when the deposit is asked for, and before anything is computed.
SOURCE = cache(lambda: publishable_source(CONFIGURATION, ROOT, RESULTS))


rule deposit:
    input:
        lambda wildcards: SOURCE() and [FILES.configuration, *INPUTS, *FILES.computed],
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
        named_files=as_it_is(NAMED_FILES),
        project=as_it_is(ROOT),
        # The source is part of the deposit, comments and all.
        revision=lambda wildcards: SOURCE().revision,
    message:
        "Deposit {PUBLICATION.version}"
    script:
        "../scripts/publish.py"
