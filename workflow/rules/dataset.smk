# config.used.yaml: what was asked for; dataset/<campaign>.nc: all runs in one file, a group per study; aggregated/<campaign>.nc: the runs of every
# study at common loads; aggregated/model_error.nc: the runs against boundary elements; checks.json: what every result
# must satisfy.


rule configuration:
    input:
        as_it_is(list(COPIED.values())),
    output:
        CONFIG_USED,
        list(COPIED),
    log:
        f"{LOGS}/configuration.log",
    benchmark:
        f"{BENCHMARKS}/configuration.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=200,
        runtime=2,
    params:
        text=as_it_is(CONFIG_TEXT),
        code=code_of("write_configuration.py"),
    message:
        "Writing the configuration as used"
    script:
        "../scripts/write_configuration.py"


rule campaign_dataset:
    input:
        RUNS,
    output:
        DATASET,
    log:
        f"{LOGS}/dataset.log",
    benchmark:
        f"{BENCHMARKS}/dataset.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        labels=LABELS,
        size=len(RUNS),
        attributes=as_it_is(
            ATTRIBUTES
            | discovery_attributes(PUBLICATION)
            | {"title": CAMPAIGN.title, "summary": CAMPAIGN.summary, "config_sha256": campaign_sha256(CAMPAIGN)}
        ),
        code=code_of("make_dataset.py"),
    message:
        "Campaign dataset of {params.size} runs"
    script:
        "../scripts/make_dataset.py"


rule comparison:
    input:
        DATASET,
    output:
        COMPARISON,
    log:
        f"{LOGS}/aggregated.log",
    benchmark:
        f"{BENCHMARKS}/aggregated.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
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
        campaign=DATASET,
        solutions=SOLUTIONS,
    output:
        f"{RESULTS}/aggregated/model_error.nc",
    log:
        f"{LOGS}/model_error.log",
    benchmark:
        f"{BENCHMARKS}/model_error.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=4000,
        runtime=30,
    params:
        labels=SOLUTION_LABELS,
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("measure_model_error.py"),
    message:
        "Error of the model against boundary elements"
    script:
        "../scripts/measure_model_error.py"


rule checks:
    input:
        dataset=DATASET,
        solutions=SOLUTIONS,
    output:
        CHECKS,
    log:
        f"{LOGS}/checks.log",
    benchmark:
        f"{BENCHMARKS}/checks.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=4000,
        runtime=30,
    params:
        labels=LABELS,
        solution_labels=SOLUTION_LABELS,
        code=code_of("check_results.py"),
    message:
        "Checks of the results"
    script:
        "../scripts/check_results.py"


# A failed check stops the campaign here; the report, which shows all checks, is made nevertheless.
rule verdict:
    input:
        CHECKS,
    output:
        VERDICT,
    log:
        f"{LOGS}/verdict.log",
    benchmark:
        f"{BENCHMARKS}/verdict.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
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
