# ICHA: adhesive rough contact by interacting and coalescing asperities.
# One configuration file is one campaign: config/config.yaml, or that of --configfile. See config/README.md.

from snakemake.utils import min_version

min_version("9.9")


include: "workflow/rules/common.smk"
include: "workflow/rules/surfaces.smk"
include: "workflow/rules/runs.smk"
include: "workflow/rules/references.smk"
include: "workflow/rules/dataset.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/publish.smk"


# On a cluster these are run where Snakemake runs, and not submitted: targets, and what is soon done.
localrules:
    all,
    surfaces,
    runs,
    references,
    dataset,
    figures,
    report,
    publish,
    configuration,
    campaign_dataset,
    comparison,
    model_error,
    checks,
    verdict,
    figure,
    report_page,
    deposit,


rule all:
    default_target: True
    input:
        CONFIG_USED,
        REFERENCES,
        FIGURES,
        DATASET,
        VERDICT,
        REPORT,


rule surfaces:
    input:
        SURFACES,


rule runs:
    input:
        RUNS,


rule references:
    input:
        REFERENCES,


rule dataset:
    input:
        DATASET,
        COMPARISON,
        VERDICT,
        MODEL_ERROR,


rule figures:
    input:
        FIGURES,


rule report:
    input:
        REPORT,


rule publish:
    input:
        f"{DEPOSIT}/SHA256SUMS",
        f"{DEPOSIT}.zip",
