"""Find where the error of the model comes from, on one surface with one material."""

from job import attributes, guarded

from icha.asperity.material import Material
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import read_surface
from icha.references.error_sources.variants import error_sources


def find_error_sources(surface, output, *, rms_slope, material, attributes, **settings):
    """Solve all variants for the surface of the file `surface`, scaled to `rms_slope`, and write them to `output`."""
    scaled = read_surface(surface).scaled_to_rms_slope(rms_slope)
    write_dataset(error_sources(scaled, Material(**material), **settings).assign_attrs(attributes), output)


if "snakemake" in globals():
    with guarded(snakemake):
        find_error_sources(
            snakemake.input.surface,
            snakemake.output[0],
            **snakemake.params.settings,
            attributes=attributes(snakemake),
            progress=lambda line: print(line, flush=True),
        )
