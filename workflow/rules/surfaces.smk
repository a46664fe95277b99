# surfaces/<surface>/seed<k>.nc: topographies at rms slope 1, shared by all slopes and materials.


rule surface:
    input:
        unpack(height_map),
    output:
        f"{RESULTS}/surfaces/{{surface}}/seed{{seed}}.nc",
    log:
        f"{LOGS}/surfaces/{{surface}}/seed{{seed}}.log",
    benchmark:
        f"{BENCHMARKS}/surfaces/{{surface}}/seed{{seed}}.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: lambda wildcards: threads_of(wildcards.surface)
    resources:
        mem_mb=lambda wildcards: memory_of(wildcards.surface),
        runtime=30,
    params:
        settings=lambda wildcards: surface_settings(CAMPAIGN, wildcards.surface),
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("make_surface.py"),
    message:
        "Surface {wildcards.surface}, seed {wildcards.seed}"
    script:
        "../scripts/make_surface.py"
