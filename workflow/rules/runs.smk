# runs/<study>/<surface>/seed<k>/slope<g>/<material>.nc: one loading sweep each.


rule run:
    input:
        surface=f"{RESULTS}/surfaces/{{surface}}/seed{{seed}}.nc",
    output:
        f"{RESULTS}/runs/{{study}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}.nc",
    log:
        f"{LOGS}/runs/{{study}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}.log",
    benchmark:
        f"{BENCHMARKS}/runs/{{study}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: lambda wildcards: threads_of(wildcards.surface)
    resources:
        mem_mb=lambda wildcards: memory_of(wildcards.surface),
        runtime=minutes_of,
    params:
        settings=settings_of,
        attributes=lambda wildcards: ATTRIBUTES
        | {
            "study": wildcards.study,
            "config_sha256": run_sha256(CAMPAIGN, case_of(wildcards)),
        },
        code=code_of("run_sweep.py"),
    message:
        "Sweep {wildcards.study}: {wildcards.surface}, seed {wildcards.seed}, slope {wildcards.slope}, "
        "{wildcards.material}"
    script:
        "../scripts/run_sweep.py"
