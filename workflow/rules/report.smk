# report.html: figures, tables, parameters and checks on one page. Times differ from one execution to the next, so
# they stand in a table of their own, run_times.tsv, and the page has the same bytes for the same data.


rule report_page:
    input:
        campaign=DATASET,
        comparison=COMPARISON,
        checks=CHECKS,
        model_error=MODEL_ERROR,
        configuration=CONFIG_USED,
        surfaces=SURFACES,
        figures=FIGURES,
    output:
        page=REPORT,
        times=RUN_TIMES,
    log:
        f"{LOGS}/report.log",
    benchmark:
        f"{BENCHMARKS}/report.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=4000,
        runtime=10,
    params:
        figures=list(CAMPAIGN.figures.drawn()),
        citations=as_it_is([measurement.citation for measurement in CAMPAIGN.measurements.values()]),
        benchmarks=BENCHMARKS,
        code=code_of("make_report.py", *(f"icha.figures.{name}" for name in CAMPAIGN.figures.drawn())),
    message:
        "Report"
    script:
        "../scripts/make_report.py"
