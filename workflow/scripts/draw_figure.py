"""Draw one figure."""

from job import job_context

from icha.figures.registry import draw_figure

if "snakemake" in globals():
    with job_context(snakemake):
        draw_figure(
            snakemake.wildcards.name,
            snakemake.output.png,
            snakemake.output.pdf,
            inputs=dict(snakemake.input.items()),
            arguments=snakemake.params.arguments,
        )
