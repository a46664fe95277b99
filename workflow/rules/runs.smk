# One loading sweep each.

from icha.configuration.settings import run_settings, run_sha256
from icha.planning.resources import sweep_minutes


rule run:
    input:
        surface="<results>/surfaces/{surface}/seed{seed}.nc",
    output:
        "<results>/runs/{study}/<contact>.nc",
    log:
        "<logs>/runs/{study}/<contact>.log",
    benchmark:
        "<benchmarks>/runs/{study}/<contact>.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: lambda wildcards: surface_threads(CAMPAIGN, wildcards.surface)
    resources:
        mem_mb=lambda wildcards: surface_memory(CAMPAIGN, wildcards.surface),
        runtime=lambda wildcards: sweep_minutes(CAMPAIGN, wildcards.study, wildcards.surface),
    params:
        settings=lambda wildcards: run_settings(CAMPAIGN, held(FILES.runs, results.RUN, wildcards)),
        attributes=lambda wildcards: ATTRIBUTES
        | {
            "study": wildcards.study,
            "config_sha256": run_sha256(CAMPAIGN, held(FILES.runs, results.RUN, wildcards)),
        },
        code=code_of("run_sweep.py"),
    message:
        "Sweep {wildcards.study}: {wildcards.surface}, seed {wildcards.seed}, slope {wildcards.slope}, "
        "{wildcards.material}"
    script:
        "../scripts/run_sweep.py"
