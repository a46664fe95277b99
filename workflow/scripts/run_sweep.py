"""Press one surface against one material along a loading path."""

from job import attributes, guarded

from icha.asperity.material import Material
from icha.contact.models import ASPERITIES
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import read_surface
from icha.path.targets import Path
from icha.simulation import ConvergenceError, simulate


def run_sweep(surface, output, *, rms_slope, seed, material, path, attributes, progress, model=ASPERITIES):
    """Load the surface of the file `surface`, scaled to `rms_slope`, and write the run dataset to `output`.

    Of a run that fails the file holds the stops that were reached, and says why there are no more: the campaign goes
    on, and its verdict lists the run.
    """
    scaled = read_surface(surface).scaled_to_rms_slope(rms_slope)
    try:
        dataset = simulate(scaled, Material(**material), Path(**path), model=model, seed=seed, progress=progress)
    except ConvergenceError as error:
        dataset = error.dataset
        progress(f"Failed: {dataset.attrs['incomplete']}")
    write_dataset(dataset.assign_attrs(attributes), output)


if "snakemake" in globals():
    with guarded(snakemake):
        run_sweep(
            snakemake.input.surface,
            snakemake.output[0],
            **snakemake.params.settings,
            attributes=attributes(snakemake),
            progress=lambda line: print(line, flush=True),
        )
