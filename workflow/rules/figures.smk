# figures/<name>.png, .pdf, .txt (the caption) and .csv (what is drawn). A figure depends on the data, on its options and
# on its code. Its request names the inputs and the arguments (icha/configuration/figures.py). One job draws a batch of
# figures.

from icha.configuration.figures import drawing
from icha.datasets.results import FIGURE, FIGURE_ENDINGS, ResultFiles
from icha.figures.registry import module_name
from icha.planning.batches import figure_batches, largest_grid
from icha.support.scripts import modules_of

FIGURES = CAMPAIGN.figures.by_name()
# Nodes of the topography that a figure holds in memory; arguments of `icha.figures.registry.draw_figure` for each figure,
# without the paths of its files.
NODES = {name: each.holds_topography * largest_grid(CAMPAIGN) ** 2 for name, each in FIGURES.items()}
DRAWINGS = {name: drawing(CAMPAIGN, name, ResultFiles(CAMPAIGN.name, RESULTS)) for name in FIGURES}


def figure_files(name):
    """Return the files of a figure; the report of Snakemake contains picture and caption."""
    paths = {ending: f"{RESULTS}/{FIGURE.format(name=name, ending=ending)}" for ending in FIGURE_ENDINGS}
    for ending, kind in {"png": "figure", "txt": "caption"}.items():
        paths[ending] = report(paths[ending], category="Figures", labels={"figure": name, "file": kind})
    return list(paths.values())


def input_files(name):
    """Return the input files of a figure."""
    return [
        file for given in DRAWINGS[name]["inputs"].values() for file in ([given] if isinstance(given, str) else given)
    ]


def given_files(name):
    """Return the files of the user that a figure needs: tables of measurements, or a script with its modules."""
    inputs = DRAWINGS[name]["inputs"]
    scripts = [inputs["script"]] if "script" in inputs else []
    return [*inputs.get("tables", ()), *scripts, *(file for script in scripts for file in modules_of(script))]


for batch in figure_batches(NODES):

    rule:
        name:
            f"draw_{batch.name}"
        input:
            list(dict.fromkeys(file for name in batch.files for file in input_files(name))),
        output:
            [figure_files(name) for name in batch.files],
        log:
            f"<logs>/figures/{batch.name}.log",
        benchmark:
            f"<benchmarks>/figures/{batch.name}.jsonl"
        localrule: True
        conda:
            "../envs/icha.yaml"
        resources:
            mem_mb=batch.memory,
            runtime=batch.minutes,
        params:
            figures=as_it_is(LongList(DRAWINGS[name] for name in batch.files)),
            # These files are compared by content, not by time.
            sha256=as_it_is([sha256_of(Path(file)) for name in batch.files for file in given_files(name)]),
            code=code_of("draw_figures.py", *map(module_name, batch.files)),
            names=", ".join(batch.files),
        message:
            "Figures {params.names}"
        script:
            "../scripts/draw_figures.py"
