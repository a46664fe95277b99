"""Load and unload one surface against one material, with boundary elements at a finite range."""

from job import attributes, job_context

from icha.asperity.material import Material
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import read_scaled_surface
from icha.references.finite_range_loops import finite_range_loop


def follow_boundary_elements(surface, output, *, rms_slope, material, attributes, rms_height=None, **settings):
    """Compute and write a cycle of loading and unloading; arguments are those of `solve_boundary_elements`."""
    scaled = read_scaled_surface(surface, rms_slope, rms_height)
    write_dataset(finite_range_loop(scaled, Material(**material), **settings).assign_attrs(attributes), output)


if "snakemake" in globals():
    with job_context(snakemake):
        follow_boundary_elements(
            snakemake.input.surface,
            snakemake.output[0],
            **snakemake.params.settings,
            attributes=attributes(snakemake),
            progress=lambda line: print(line, flush=True),
        )
