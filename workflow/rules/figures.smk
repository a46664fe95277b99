# figures/<name>.png and .pdf. A figure depends on the data, on its options and on its own code.


rule figure:
    input:
        unpack(lambda wildcards: figure_data(wildcards.name)),
    output:
        png=f"{RESULTS}/figures/{{name}}.png",
        pdf=f"{RESULTS}/figures/{{name}}.pdf",
    log:
        f"{LOGS}/figures/{{name}}.log",
    benchmark:
        f"{BENCHMARKS}/figures/{{name}}.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=lambda wildcards: figure_memory(wildcards.name),
        runtime=10,
    params:
        options=lambda wildcards: figure_options(wildcards.name),
        measurements=lambda wildcards: measurements_of(wildcards.name),
        code=lambda wildcards: code_of("draw_figure.py", f"icha.figures.{wildcards.name}"),
    message:
        "Figure {wildcards.name}"
    script:
        "../scripts/draw_figure.py"
