"""Draw the figures of a batch."""

from job import job_context

from icha.datasets.results import FIGURE_ENDINGS
from icha.figures.registry import draw_figure

if "snakemake" in globals():
    with job_context(snakemake):
        count = len(FIGURE_ENDINGS)
        for number, each in enumerate(snakemake.params.figures):
            print(each["name"], flush=True)
            draw_figure(each.pop("name"), *snakemake.output[number * count : (number + 1) * count], **each)
