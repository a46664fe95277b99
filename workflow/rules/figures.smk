# figures/<name>.png, .pdf and .txt, the caption. A figure depends on the data, on its options and on its code. The module of a figure
# declares the inputs and the arguments (icha/figures/fig*.py).

from icha.datasets.results import ResultFiles
from icha.figures.own_figure import modules_of
from icha.figures.registry import declaration_of, module_name
from icha.planning.requirements import figure_memory

RESULT_FILES = ResultFiles(CAMPAIGN.name, RESULTS)
FIGURES = CAMPAIGN.figures.by_name()
# Input files of each figure. The keys are the arguments of the function that draws the figure.
FIGURE_INPUTS = {
    name: declaration_of(name).inputs(CAMPAIGN, options, RESULT_FILES) for name, options in FIGURES.items()
}


# Files of the user that a figure needs: tables of measurements, and the script of an own figure with its modules.
GIVEN_FILES = {
    name: [
        *inputs.get("tables", ()),
        *(file for script in filter(None, [inputs.get("script")]) for file in (script, *modules_of(script))),
    ]
    for name, inputs in FIGURE_INPUTS.items()
}


wildcard_constraints:
    name="|".join(FIGURES) or "none",


rule figure:
    input:
        unpack(lambda wildcards: FIGURE_INPUTS[wildcards.name]),
    output:
        png=report("<results>/figures/{name}.png", category="Figures", labels={"figure": "{name}", "file": "figure"}),
        pdf="<results>/figures/{name}.pdf",
        text=report("<results>/figures/{name}.txt", category="Figures", labels={"figure": "{name}", "file": "caption"}),
    log:
        "<logs>/figures/{name}.log",
    benchmark:
        "<benchmarks>/figures/{name}.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=lambda wildcards: figure_memory(
            CAMPAIGN, holds_topography=declaration_of(wildcards.name).holds_topography
        ),
        runtime=10,
    params:
        arguments=lambda wildcards: FIGURES[wildcards.name].arguments(CAMPAIGN),
        studies=lambda wildcards: FIGURES[wildcards.name].studies_of(CAMPAIGN),
        # These files are compared by content, not by time.
        sha256=lambda wildcards: [sha256_of(Path(file)) for file in GIVEN_FILES[wildcards.name]],
        code=lambda wildcards: code_of("draw_figure.py", module_name(wildcards.name)),
    message:
        "Figure {wildcards.name}"
    script:
        "../scripts/draw_figure.py"
