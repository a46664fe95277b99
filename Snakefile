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


# Jobs end with this process, however it does: see workflow/scripts/job.py.
os.environ["ICHA_SNAKEMAKE"] = str(os.getpid())

if workflow.is_main_process:
    here = before_jobs.Campaign(RESULTS, dry_run=workflow.output_settings.dryrun)


onstart:
    here.refuse_second()
    here.refuse_unwritable()


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


# What is lost or set aside is made again when it is asked for: a target asks for all that it is made of.
rule all:
    default_target: True
    input:
        CONFIG_USED,
        list(COPIED),
        SURFACES,
        RUNS,
        REFERENCES,
        DATASET,
        COMPARISON,
        MODEL_ERROR,
        CHECKS,
        VERDICT,
        FIGURES,
        REPORT,


rule surfaces:
    input:
        SURFACES,


rule runs:
    input:
        SURFACES,
        RUNS,


rule references:
    input:
        SURFACES,
        REFERENCES,


rule dataset:
    input:
        rules.runs.input,
        DATASET,
        COMPARISON,
        MODEL_ERROR,
        CHECKS,
        VERDICT,


rule figures:
    input:
        FIGURES,


rule report:
    input:
        REPORT,


rule publish:
    input:
        rules.all.input,
        f"{DEPOSIT}/SHA256SUMS",
        f"{DEPOSIT}.zip",
