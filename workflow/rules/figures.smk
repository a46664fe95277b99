# figures/<name>.png and .pdf. A figure depends on the data, on its options and on its own code: it says itself what it
# is drawn from, and with what arguments (icha/figures/fig*.py).

from icha.figures.declaration import ResultFiles
from icha.figures.registry import DECLARATIONS

RESULT_FILES = ResultFiles(RESULTS, CAMPAIGN.name)
# The largest topography of the campaign.
MOST_POINTS = max(points_of(surface) for surface, _ in surface_cases(CAMPAIGN))


wildcard_constraints:
    name="|".join(CAMPAIGN.figures.drawn()) or "none",


rule figure:
    input:
        unpack(lambda wildcards: CAMPAIGN.figures.inputs(wildcards.name, CAMPAIGN, RESULT_FILES)),
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
        mem_mb=lambda wildcards: 2000 + DECLARATIONS[wildcards.name].holds_topography * 16 * MOST_POINTS // 10**6,
        runtime=10,
    params:
        arguments=lambda wildcards: CAMPAIGN.figures.arguments(wildcards.name, CAMPAIGN),
        code=lambda wildcards: code_of("draw_figure.py", f"icha.figures.{wildcards.name}"),
    message:
        "Figure {wildcards.name}"
    script:
        "../scripts/draw_figure.py"
