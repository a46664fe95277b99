"""Draw one figure."""

from job import guarded

from icha.figures.registry import draw_figure

if "snakemake" in globals():
    with guarded(snakemake):
        draw_figure(
            snakemake.wildcards.name,
            snakemake.output.png,
            snakemake.output.pdf,
            inputs=dict(snakemake.input.items()),
            arguments=snakemake.params.arguments,
        )
