# report.html: statements, answers, checks, figures and parameters on one page. The same data always give exactly the
# same page.


rule report_page:
    input:
        campaign=FILES.dataset,
        table=FILES.table,
        comparison=FILES.comparison,
        checks=FILES.checks,
        model_error=FILES.model_error,
        answers=FILES.answers,
        sensitivity=FILES.sensitivity,
        configuration=FILES.configuration,
        figures=FILES.figures,
    output:
        page=FILES.report,
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
        surfaces=as_it_is(LongList(FILES.surfaces)),
        citations=as_it_is([measurement.citation for measurement in CAMPAIGN.measurements.values()]),
        code=code_of("make_report.py"),
    message:
        "Report"
    script:
        "../scripts/make_report.py"
