"""Press one surface against one material along a loading path."""

import pathlib
import shutil
import traceback

import numpy as np
import scipy
from job import attributes, guarded

from icha.asperity.material import Material
from icha.contact.checkpoints import prepare_checkpoints
from icha.contact.models import DEFAULT_MODEL
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import read_surface
from icha.path.targets import Path
from icha.simulation import ConvergenceError, simulate, empty_run

# What this machine lacks says nothing of the run: its job fails, and the next call tries again.
OF_THE_MACHINE = (OSError, MemoryError, ImportError)


def run_sweep(
    surface, output, *, rms_slope, seed, material, path, attributes, progress, model=DEFAULT_MODEL, kept=None
):
    """Load the surface of the file `surface`, scaled to `rms_slope`, and write the run dataset to `output`.

    Of a run that fails the file holds the stops that were reached, and says why there are no more: the campaign goes
    on, and its verdict lists the run. So do errors of any other kind, for surface, material and path are all that they
    can come from.
    """
    pressed = read_surface(surface).scaled_to_rms_slope(rms_slope), Material(**material), Path(**path)
    try:
        dataset = simulate(*pressed, model=model, seed=seed, progress=progress, kept=kept)
    except ConvergenceError as error:
        dataset = error.dataset
    except OF_THE_MACHINE:
        raise
    except Exception as error:
        if type(error) is RuntimeError:  # of Python itself, which could start no thread
            raise
        reason = f"nothing was computed: {error}"
        if not isinstance(error, ValueError):
            reason = f"{type(error).__name__}, which was not expected: {error}"
            progress(traceback.format_exc())
        dataset = empty_run(*pressed, reason, model=model, seed=seed)
    if "incomplete" in dataset.attrs:
        progress(f"Failed: {dataset.attrs['incomplete']}")
    write_dataset(dataset.assign_attrs(attributes), output)


def _kept(output, asked, inputs):
    """The folder in which equilibria are kept, with nothing in it from another surface, path or code."""
    return prepare_checkpoints(
        pathlib.Path(output).with_suffix(".kept"), f"{asked} {inputs} {np.__version__} {scipy.__version__}"
    )


if "snakemake" in globals():
    with guarded(snakemake) as (asked, inputs):
        kept = _kept(snakemake.output[0], asked, inputs) if snakemake.params.keeps else None
        run_sweep(
            snakemake.input.surface,
            snakemake.output[0],
            **snakemake.params.settings,
            attributes=attributes(snakemake),
            progress=lambda line: print(line, flush=True),
            kept=kept,
        )
        if kept is not None:
            # The run is there. What cannot be removed, of a file system in a network for one, is no reason to lose it.
            shutil.rmtree(kept, ignore_errors=True)
