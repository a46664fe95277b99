"""Press one surface against one material along a loading path."""

import pathlib
import shutil
import traceback

import numpy as np
import scipy
from job import attributes, guarded

from icha.asperity.material import Material
from icha.contact.kept import prepared
from icha.contact.models import ASPERITIES
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import read_surface
from icha.path.targets import Path
from icha.simulation import ConvergenceError, simulate, unfollowed
from icha.support.checksums import sha256_of

# What this machine lacks says nothing of the run: its job fails, and the next call tries again.
OF_THE_MACHINE = (OSError, MemoryError, ImportError)


def run_sweep(surface, output, *, rms_slope, seed, material, path, attributes, progress, model=ASPERITIES, kept=None):
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
        reason = f"nothing was computed: {error}"
        if not isinstance(error, ValueError):
            reason = f"{type(error).__name__}, which was not expected: {error}"
            progress(traceback.format_exc())
        dataset = unfollowed(*pressed, reason, model=model, seed=seed)
    if "incomplete" in dataset.attrs:
        progress(f"Failed: {dataset.attrs['incomplete']}")
    write_dataset(dataset.assign_attrs(attributes), output)


def _kept(snakemake):
    """The folder in which equilibria are kept, if they are, with nothing in it from another surface, path or code."""
    if not snakemake.params.keeps:
        return None
    asked = [snakemake.params.attributes["config_sha256"], snakemake.params.code, np.__version__, scipy.__version__]
    asked.append(sha256_of(pathlib.Path(snakemake.input.surface)))
    return prepared(pathlib.Path(snakemake.output[0]).with_suffix(".kept"), " ".join(asked))


if "snakemake" in globals():
    with guarded(snakemake):
        kept = _kept(snakemake)
        run_sweep(
            snakemake.input.surface,
            snakemake.output[0],
            **snakemake.params.settings,
            attributes=attributes(snakemake),
            progress=lambda line: print(line, flush=True),
            kept=kept,
        )
        if kept is not None:
            shutil.rmtree(kept)
