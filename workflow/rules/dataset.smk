# Rules for the configuration as used, the campaign dataset (all runs, one group for each study), the comparison of the
# runs at common loads, the error of the asperity model, estimates with intervals, sampled parameters, checks and verdict.

from icha.configuration.cases import campaign_sha256
from icha.configuration.design import sampled_parameters, varied_values
from icha.deposit.metadata import discovery_attributes
from icha.support.checksums import LongText, sha256_of


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
        text=as_it_is(LongText(CONFIG_TEXT)),
        # Copied files are compared by content, not by time.
        sha256=lambda wildcards: [sha256_of(Path(file)) for file in COPIED.values()],
        code=code_of("write_configuration.py"),
    message:
        "Writing the configuration as used"
    script:
        "../scripts/write_configuration.py"


rule campaign_dataset:
    input:
        list(FILES.runs),
    output:
        FILES.dataset,
    log:
        "<logs>/dataset.log",
    benchmark:
        "<benchmarks>/dataset.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        labels=[tuple(labels) for labels in FILES.runs.values()],
        varied=as_it_is(varied_values(CAMPAIGN)),
        stamps=[STAMPS[file] for file in FILES.runs],
        size=len(FILES.runs),
        attributes=as_it_is(
            ATTRIBUTES
            | discovery_attributes(PUBLICATION)
            | {
                "title": CAMPAIGN.title,
                "summary": CAMPAIGN.summary,
                "config_sha256": campaign_sha256(CAMPAIGN, SHA256_OF_RUN),
            }
        ),
        code=code_of("make_dataset.py"),
    message:
        "Campaign dataset of {params.size} runs"
    script:
        "../scripts/make_dataset.py"


rule table:
    input:
        FILES.dataset,
    output:
        FILES.table,
    log:
        "<logs>/table.log",
    benchmark:
        "<benchmarks>/table.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=4000,
        runtime=30,
    params:
        code=code_of("make_table.py"),
    message:
        "Table of the campaign"
    script:
        "../scripts/make_table.py"


rule comparison:
    input:
        FILES.dataset,
    output:
        FILES.comparison,
    log:
        "<logs>/aggregated.log",
    benchmark:
        "<benchmarks>/aggregated.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=4000,
        runtime=30,
    params:
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("compare_runs.py"),
    message:
        "Comparison of the runs"
    script:
        "../scripts/compare_runs.py"


rule model_error:
    input:
        campaign=FILES.dataset,
        runs=list(FILES.compared),
    output:
        "<results>/aggregated/model_error.nc",
    log:
        "<logs>/model_error.log",
    benchmark:
        "<benchmarks>/model_error.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=4000,
        runtime=30,
    params:
        labels=[tuple(labels) for labels in FILES.compared.values()],
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("measure_model_error.py"),
    message:
        "Error of the model, compared with boundary elements"
    script:
        "../scripts/measure_model_error.py"


rule answers:
    input:
        FILES.dataset,
    output:
        "<results>/aggregated/answers.nc",
    log:
        "<logs>/answers.log",
    benchmark:
        "<benchmarks>/answers.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=4000,
        runtime=30,
    params:
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("estimate_answers.py"),
    message:
        "Estimates with intervals"
    script:
        "../scripts/estimate_answers.py"


rule sensitivity:
    input:
        FILES.dataset,
    output:
        "<results>/aggregated/sensitivity.nc",
    log:
        "<logs>/sensitivity.log",
    benchmark:
        "<benchmarks>/sensitivity.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=4000,
        runtime=30,
    params:
        samples=as_it_is(sampled_parameters(CAMPAIGN)),
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("analyse_samples.py"),
    message:
        "Sensitivity of the results to sampled parameters"
    script:
        "../scripts/analyse_samples.py"


rule checks:
    input:
        FILES.dataset,
    output:
        FILES.checks,
    log:
        "<logs>/checks.log",
    benchmark:
        "<benchmarks>/checks.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=4000,
        runtime=30,
    params:
        labels=[tuple(labels) for labels in FILES.runs.values()],
        code=code_of("check_results.py"),
    message:
        "Checks of the results"
    script:
        "../scripts/check_results.py"


# A failed check stops the campaign here. The report, which shows all checks, is written in any case.
rule verdict:
    input:
        FILES.checks,
    output:
        FILES.verdict,
    log:
        "<logs>/verdict.log",
    benchmark:
        "<benchmarks>/verdict.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=200,
        runtime=5,
    params:
        known=as_it_is({failure.run: failure.reason for failure in PUBLICATION.known_failures}),
        code=code_of("judge_results.py"),
    message:
        "Verdict on the checks"
    script:
        "../scripts/judge_results.py"
