# references/<surface>.nc: what theories say of a surface, and published points.


rule reference:
    output:
        f"{RESULTS}/references/{{surface}}.nc",
    log:
        f"{LOGS}/references/{{surface}}.log",
    benchmark:
        f"{BENCHMARKS}/references/{{surface}}.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=600,
        runtime=10,
    params:
        settings=lambda wildcards: surface_settings(CAMPAIGN, wildcards.surface),
        attributes=ATTRIBUTES,
        code=code_of("make_references.py"),
    message:
        "Theories and literature for surface {wildcards.surface}"
    script:
        "../scripts/make_references.py"
