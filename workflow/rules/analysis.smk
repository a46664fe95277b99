# Analysis of all runs: the campaign dataset (one group for each study), its table, the comparison of runs at common
# loads, the error of the asperity model, estimates with intervals, sampled parameters, and checks. Then the verdict.
# The verdict and the report read surfaces, too. They come after the analysis, which needs all surfaces and runs, so they
# need not list those: Snakemake's time for planning is proportional to the number of all inputs.

from icha.configuration.cases import campaign_sha256
from icha.configuration.design import sampled_parameters, varied_values

CONFIG_SHA256 = {case: STAMPS[path]["config_sha256"] for path, case in FILES.runs.items()}


rule analyse:
    input:
        as_outputs(FILES.surfaces),
        as_outputs(FILES.runs),
    output:
        dataset=FILES.dataset,
        table=FILES.table,
        comparison=FILES.comparison,
        model_error=FILES.model_error,
        answers=FILES.answers,
        sensitivity=FILES.sensitivity,
        checks=FILES.checks,
    log:
        "<logs>/analyse.log",
    benchmark:
        "<benchmarks>/analyse.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=4000,
        runtime=60,
    params:
        runs=as_it_is(LongList((path, *case) for path, case in FILES.runs.items())),
        stamps=as_it_is(LongList(STAMPS[path] for path in FILES.runs)),
        compared=as_it_is(LongList(FILES.compared)),
        varied=as_it_is(varied_values(CAMPAIGN)),
        samples=as_it_is(sampled_parameters(CAMPAIGN)),
        number=len(FILES.runs),
        attributes=as_it_is({"campaign": CAMPAIGN.name, "license": PUBLICATION.license}),
        described=as_it_is(
            {
                "title": CAMPAIGN.title,
                "summary": CAMPAIGN.summary,
                "config_sha256": campaign_sha256(CAMPAIGN, CONFIG_SHA256.get),
            }
        ),
        code=code_of("analyse.py"),
    message:
        "Campaign dataset of {params.number} runs, comparisons and checks"
    script:
        "../scripts/analyse.py"


# A failed check stops the campaign here. The report, which shows all checks, is written in any case.
rule verdict:
    input:
        FILES.checks,
        as_outputs(FILES.theories),
    output:
        verdict=FILES.verdict,
        checksums=FILES.checksums,
    log:
        "<logs>/verdict.log",
    benchmark:
        "<benchmarks>/verdict.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=200,
        runtime=30,
    params:
        results=as_it_is(RESULTS),
        files=as_it_is(LongList(FILES.verified)),
        known=as_it_is({failure.run: failure.reason for failure in PUBLICATION.known_failures}),
        code=code_of("judge_results.py"),
    message:
        "Verdict on the checks, and checksums of the results"
    script:
        "../scripts/judge_results.py"
