"""Load one surface against one material along a path."""

import pathlib
import shutil
import traceback

import numpy as np
import scipy
from job import attributes, job_context

from icha.asperity.material import Material
from icha.contact.checkpoints import prepare_checkpoints
from icha.contact.models import DEFAULT_MODEL
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import read_scaled_surface
from icha.path.targets import Path
from icha.simulation import ConvergenceError, empty_run, simulate

# Errors of the machine, not of the run: the job fails, and the next call repeats the job.
MACHINE_ERRORS = (OSError, MemoryError, ImportError)


def run_sweep(
    surface,
    output,
    *,
    rms_slope,
    seed,
    material,
    path,
    attributes,
    progress,
    rms_height=None,
    model=DEFAULT_MODEL,
    kept=None,
):
    """Compute a run and write its dataset.

    The file of a failed run contains the states at the targets that were reached, and the reason for the failure. The
    campaign continues, and its verdict lists the run. The campaign also continues after an unexpected error, because
    only the surface, the material and the path of this run can be the cause.

    Parameters
    ----------
    surface : file of the surface; its heights are scaled to `rms_height`, or to `rms_slope` without an `rms_height`.
    output : file to write.
    rms_slope, rms_height, seed, material, path, model : settings of the run, in SI units.
    attributes : attributes of the dataset.
    progress : function that prints a line of progress.
    kept : folder of checkpoints; None for a run without checkpoints.
    """
    contact = read_scaled_surface(surface, rms_slope, rms_height), Material(**material), Path(**path)
    try:
        dataset = simulate(*contact, model=model, seed=seed, progress=progress, kept=kept)
    except ConvergenceError as error:
        dataset = error.dataset
    except MACHINE_ERRORS:
        raise
    except Exception as error:
        if type(error) is RuntimeError:  # Python could not start a thread
            raise
        reason = f"nothing was computed: {error}"
        if not isinstance(error, ValueError):
            reason = f"{type(error).__name__}, unexpected: {error}"
            progress(traceback.format_exc())
        dataset = empty_run(*contact, reason, model=model, seed=seed)
    if "incomplete" in dataset.attrs:
        progress(f"Failed: {dataset.attrs['incomplete']}")
    elif "beyond_model" in dataset.attrs:
        progress(f"Ended by physics: {dataset.attrs['beyond_model']}")
    write_dataset(dataset.assign_attrs(attributes), output)


def _checkpoints(output, asked, inputs):
    """Return the folder of checkpoints; checkpoints of another surface, path or code are removed from the folder."""
    versions = f"{np.__version__} {scipy.__version__}"
    return prepare_checkpoints(pathlib.Path(output).with_suffix(".kept"), f"{asked} {inputs} {versions}")


if "snakemake" in globals():
    with job_context(snakemake) as (asked, inputs):
        folder = _checkpoints(snakemake.output[0], asked, inputs) if snakemake.params.resumable else None
        run_sweep(
            snakemake.input.surface,
            snakemake.output[0],
            **snakemake.params.settings,
            attributes=attributes(snakemake),
            progress=lambda line: print(line, flush=True),
            kept=folder,
        )
        if folder is not None:
            # The run is complete, even if a network file system does not remove the folder.
            shutil.rmtree(folder, ignore_errors=True)
