# publish/<campaign>-<version>/ and its .zip: everything that a reader needs, with checksums. See docs/howto/publish.md.

from icha.publication.source import committed_source
from publishable import refuse_unpublishable


rule deposit:
    input:
        lambda wildcards: published(),
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
        project=as_it_is(workflow.basedir),
        # The source is part of the deposit, comments and all.
        commit=lambda wildcards: committed_source(workflow.basedir).commit,
    message:
        "Deposit {PUBLICATION.version}"
    script:
        "../scripts/publish.py"


def published():
    """The files of a deposit; ends the program where there can be none, before anything is computed."""
    refuse_unpublishable(CONFIGURATION, workflow.basedir)
    return [
        FILES.configuration,
        *INPUTS,
        *FILES.surfaces,
        *FILES.runs,
        *FILES.references,
        FILES.dataset,
        FILES.comparison,
        *FILES.model_error,
        FILES.checks,
        FILES.verdict,
        *FILES.figures,
        FILES.report,
    ]
