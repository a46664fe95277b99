# report.html: figures, tables, parameters and checks on one page. The same data always give exactly the same page. The
# times of jobs are in a separate table, run_times.tsv, because times differ between executions.


rule report_page:
    input:
        campaign=FILES.dataset,
        comparison=FILES.comparison,
        checks=FILES.checks,
        model_error=FILES.model_error,
        answers=FILES.answers,
        sensitivity=FILES.sensitivity,
        configuration=FILES.configuration,
        surfaces=list(FILES.surfaces),
        figures=FILES.figures,
    output:
        page=FILES.report,
        times=FILES.run_times,
    log:
        "<logs>/report.log",
    benchmark:
        "<benchmarks>/report.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=4000,
        runtime=10,
    params:
        figures={name: options.studies_of(CAMPAIGN) for name, options in CAMPAIGN.figures.by_name().items()},
        citations=as_it_is([measurement.citation for measurement in CAMPAIGN.measurements.values()]),
        benchmarks=f"{RESULTS}/benchmarks",
        code=code_of("make_report.py", *(sorted({module_name(name) for name in CAMPAIGN.figures.by_name()}))),
    message:
        "Report"
    script:
        "../scripts/make_report.py"
