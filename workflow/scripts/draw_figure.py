"""Draw one figure."""

from job import job_context

from icha.figures.registry import draw_figure

if "snakemake" in globals():
    with job_context(snakemake):
        draw_figure(
            snakemake.wildcards.name,
            snakemake.output.png,
            snakemake.output.pdf,
            snakemake.output.text,
            inputs=dict(snakemake.input.items()),
            arguments=snakemake.params.arguments,
            studies=snakemake.params.studies,
        )
