"""Load one surface against one material along a path."""

import pathlib
import shutil
import traceback

import numpy as np
import scipy

from icha.asperity.material import Material
from icha.contact.checkpoints import prepare_checkpoints
from icha.contact.models import DEFAULT_MODEL
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import read_scaled_surface
from icha.path.targets import Path
from icha.simulation import ConvergenceError, empty_run, simulate

# Errors of the machine, not of the run: the job fails, and the next call repeats the job.
MACHINE_ERRORS = (OSError, MemoryError, ImportError)


def compute_run(
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
    resumable=False,
):
    """Compute a run and write its dataset.

    The file of a failed run contains the states at the targets that were reached, and the reason for the failure. The
    campaign continues, and its verdict lists the run. The campaign also continues after an unexpected error, because
    only the surface, the material and the path of this run can be the cause.

    Parameters
    ----------
    surface : file of the surface; its heights are scaled to `rms_height`, or to `rms_slope` without an `rms_height`.
    rms_slope, rms_height, seed, material, path, model : settings of the run, in SI units.
    attributes : attributes of the file, with the stamp (`icha.datasets.stamp`).
    resumable : if true, save checkpoints beside `output`, and resume from checkpoints with the same stamp.
    """
    folder = _checkpoints(output, attributes) if resumable else None
    contact = read_scaled_surface(surface, rms_slope, rms_height), Material(**material), Path(**path)
    try:
        dataset = simulate(*contact, model=model, seed=seed, progress=progress, kept=folder)
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
    if folder is not None:
        # The run is complete, even if a network file system does not remove the folder.
        shutil.rmtree(folder, ignore_errors=True)


def _checkpoints(output, stamp):
    """Return the folder of checkpoints; checkpoints of another surface, path or program are removed from the folder."""
    identity = [stamp["config_sha256"], stamp["program_sha256"], np.__version__, scipy.__version__]
    return prepare_checkpoints(pathlib.Path(output).with_suffix(".kept"), " ".join(identity))
