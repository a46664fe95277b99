"""Make one surface."""

from job import job_context

from icha.tasks.surface import make_surface

if "snakemake" in globals():
    with job_context(snakemake):
        make_surface(
            snakemake.output[0],
            name=snakemake.wildcards.surface,
            seed=int(snakemake.wildcards.seed),
            settings=snakemake.params.settings,
            height_map=snakemake.input.get("height_map"),
            sha256=snakemake.params.sha256,
            attributes=snakemake.params.attributes,
        )
