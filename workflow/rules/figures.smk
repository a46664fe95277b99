# figures/<name>.png, .pdf and .txt, the caption. A figure depends on the data, on its options and on its code. The module of a figure
# declares the inputs and the arguments (icha/figures/fig*.py). One job draws a batch of figures.

from icha.datasets.results import FIGURE, FIGURE_ENDINGS, ResultFiles
from icha.figures.own_figure import modules_of
from icha.figures.registry import declaration_of, module_name
from icha.planning.batches import figure_batches
from icha.planning.requirements import figure_memory

FIGURES = CAMPAIGN.figures.by_name()
# Input files of each figure. The keys are the arguments of the function that draws the figure.
FIGURE_INPUTS = {
    name: declaration_of(name).inputs(CAMPAIGN, options, ResultFiles(CAMPAIGN.name, RESULTS))
    for name, options in FIGURES.items()
}


def figure_files(name):
    """Return the files of a figure; the report of Snakemake contains picture and caption."""
    paths = {ending: f"{RESULTS}/{FIGURE.format(name=name, ending=ending)}" for ending in FIGURE_ENDINGS}
    for ending, kind in {"png": "figure", "txt": "caption"}.items():
        paths[ending] = report(paths[ending], category="Figures", labels={"figure": name, "file": kind})
    return list(paths.values())


def input_files(name):
    """Return the input files of a figure."""
    return [file for given in FIGURE_INPUTS[name].values() for file in ([given] if isinstance(given, str) else given)]


def given_files(name):
    """Return the files of the user that a figure needs: tables of measurements, or a script with its modules."""
    scripts = [FIGURE_INPUTS[name]["script"]] if "script" in FIGURE_INPUTS[name] else []
    return [
        *FIGURE_INPUTS[name].get("tables", ()),
        *scripts,
        *(file for script in scripts for file in modules_of(script)),
    ]


def drawing(name):
    """Return the arguments of `icha.figures.registry.draw_figure` for a figure, without the paths of its files."""
    options = FIGURES[name]
    arguments, studies = options.arguments(CAMPAIGN), options.studies_of(CAMPAIGN)
    return {"name": name, "inputs": FIGURE_INPUTS[name], "arguments": arguments, "studies": studies}


for number, names in enumerate(figure_batches(FIGURES)):
    declarations = [declaration_of(name) for name in names]

    rule:
        name:
            f"draw_figures_{number}"
        input:
            list(dict.fromkeys(file for name in names for file in input_files(name))),
        output:
            [figure_files(name) for name in names],
        log:
            f"<logs>/figures/figures_{number}.log",
        benchmark:
            f"<benchmarks>/figures/figures_{number}.jsonl"
        localrule: True
        conda:
            "../envs/icha.yaml"
        resources:
            mem_mb=max(figure_memory(CAMPAIGN, holds_topography=each.holds_topography) for each in declarations),
            runtime=10,
        params:
            figures=as_it_is(LongList(drawing(name) for name in names)),
            # These files are compared by content, not by time.
            sha256=as_it_is([sha256_of(Path(file)) for name in names for file in given_files(name)]),
            code=code_of("draw_figures.py", *map(module_name, names)),
            names=", ".join(names),
        message:
            "Figures {params.names}"
        script:
            "../scripts/draw_figures.py"
