"""Solve one surface against one material at one load, with boundary elements at a finite range."""

from job import attributes, job_context

from icha.asperity.material import Material
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import read_scaled_surface
from icha.references.finite_range import finite_range_solution


def solve_boundary_elements(surface, output, *, rms_slope, material, attributes, rms_height=None, **settings):
    """Compute and write the solution for a surface whose heights are scaled to `rms_slope`, or to `rms_height`."""
    scaled = read_scaled_surface(surface, rms_slope, rms_height)
    solution = finite_range_solution(scaled, Material(**material), **settings)
    write_dataset(solution.assign_attrs(attributes), output)


if "snakemake" in globals():
    with job_context(snakemake):
        solve_boundary_elements(
            snakemake.input.surface,
            snakemake.output[0],
            **snakemake.params.settings,
            attributes=attributes(snakemake),
            progress=lambda line: print(line, flush=True),
        )
