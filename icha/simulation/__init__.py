"""Simulate the contact of one surface and one material along a path; the result is an xarray dataset."""

import importlib
import logging
import pathlib
import warnings
from collections.abc import Callable

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from icha.asperity.material import Material
from icha.checks.applicability import reasons_of_edges
from icha.checks.run import attributes_of_failure, check_run
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.datasets.build import describe_variables
from icha.datasets.variables.run import INDENTER, LOOP
from icha.path.energy_balance import summarise_loop
from icha.path.targets import Path
from icha.references.indenter_runs import loop_values
from icha.references.limits import doubts
from icha.simulation.arguments import check_arguments, describe_unusual, pressure_units
from icha.simulation.record import PathRecord, count_uphill_jumps_in, record_path
from icha.simulation.run_dataset import run_dataset
from icha.support.rules import IntegerRange
from icha.support.usual import IchaWarning
from icha.surfaces.summits import SummitCoverage, locate_summits
from icha.surfaces.surface import Surface

_LOGGER = logging.getLogger("icha")


class ConvergenceError(RuntimeError):
    """Error: the path could not be computed to its end, for example because it leaves the range of the model.

    `dataset` contains the targets that were reached; its attribute `incomplete` or `beyond_model` states the reason.
    """

    def __init__(self, message: str, dataset: xr.Dataset):
        """Store the message, and the dataset of the targets that were reached."""
        super().__init__(message)
        self.dataset = dataset

    def __reduce__(self):
        """Return the class and the arguments from which pickle restores the error with its dataset."""
        return type(self), (self.args[0], self.dataset)


def simulate(
    surface: Surface,
    material: Material,
    path: Path,
    *,
    model: str = DEFAULT_MODEL,
    seed: int = -1,
    progress: Callable[[str], None] | None = None,
    kept: pathlib.Path | None = None,
) -> xr.Dataset:
    """Simulate the contact of a surface and an elastic half-space along a path; return a dataset of all states.

    Parameters
    ----------
    surface : rough surface, scaled to its final rms slope.
    material : contact modulus, work of adhesion, range of attraction and largest flaw of the interface.
    path : loads, areas or separations to reach; at some of these targets, spots and distributions are stored.
    model : "asperities" or "boundary_elements". Boundary elements are slower; where the grid does not resolve the range
        of attraction, they use the limit of a short range.
    seed : seed of the surface, for the record in the dataset; -1 for a surface without a seed.
    progress : function that is called with a line of text at every target, and in a long path also between targets.
        Default: messages of level INFO of the logger "icha".
    kept : folder of checkpoints (`icha.contact.checkpoints`), only with boundary elements. If a call was interrupted, a
        call with the same arguments resumes from the checkpoints.

    Returns
    -------
    xarray.Dataset with dimensions step, snapshot, gap_bin, pressure_bin and spot; every variable has units and a long
    name. If the path continues after the first loading, every equilibrium is a step, and the dataset has a dimension
    event (jumps, coalescence and splitting of spots). Runs with boundary elements also have dimensions row and column.
    Attributes: `contact_model` names the model. `applicability` states why the model is not applicable, or is empty.
    `failed_checks` lists the checks that the run fails (`icha.checks.run.check_run`), and is absent if all checks pass.

    Warns
    -----
    IchaWarning
        If an argument is unusual, mostly because of a wrong unit. If unloading does not have the state of a snapshot.
        If the model is not applicable, or the run fails
        checks: the numbers of this run must not be used.

    Raises
    ------
    ValueError
        If an argument has the wrong type, the model is unknown, a target is out of range on this surface, the surface
        has no summits, or the model is not available for the surface.
    ConvergenceError
        If an equilibrium is not found, a target cannot be reached, or the path leaves the range of the model. The
        attribute `dataset` of the error contains the targets that were reached.
    """
    if model not in tuple(MODELS):
        raise ValueError(f"model: {model!r} must be one of {', '.join(MODELS)}")
    check_arguments(surface, material, path, MODELS[model].by_summits)
    if kept is not None and not MODELS[model].resumable:
        raise ValueError(f"kept: the model {model} has no checkpoints; expected None")
    # Only the chosen model is imported, because the fingerprint of a run must not depend on other models.
    solver = importlib.import_module(MODELS[model].module)
    seed = IntegerRange(-1).validate("seed", seed)
    if progress is None and _LOGGER.isEnabledFor(logging.INFO):
        progress = _LOGGER.info
    for text in (*describe_unusual(surface, material), *doubts(surface, material, path, model)):
        warnings.warn(text, IchaWarning, stacklevel=2)
    dataset = _compute(solver, surface, material, path, model, seed, progress, kept)
    saved = list(zip(dataset["snapshot_kind"].values, dataset["snapshot_target"].values, strict=True))
    for target in path.unloading_snapshots:
        if (target.snapshot_kind, target.value) not in saved:
            text = f"{target.describe()}: no snapshot, because unloading does not reach this state, or jumps over it"
            warnings.warn(text, IchaWarning, stacklevel=2)
    if dataset.attrs["applicability"]:
        warnings.warn(dataset.attrs["applicability"], IchaWarning, stacklevel=2)
    for name, reasons in attributes_of_failure(check_run(dataset)).items():
        dataset = dataset.assign_attrs({name: reasons})
        invalid = "hysteresis loss" if name == "failed_loss_checks" else "numbers"
        warnings.warn(
            f"The run fails checks; do not use the {invalid} of this run: {reasons}", IchaWarning, stacklevel=2
        )
    return dataset


def _compute(solver, surface, material, path, model, seed, progress, kept):
    """Return the dataset of a run before its checks; raise `ConvergenceError` if the run is incomplete.

    solver : module of the model; all other arguments are those of `simulate`.
    """
    # With one thread, linear algebra adds in a fixed order, so every bit of the result is the same on all machines.
    with threadpool_limits(1):
        contact = solver.contact_of(surface, material)
        observables = contact.observables(surface)
        if kept is not None:
            contact = solver.resumable(contact, kept)
        reachable = path.within_asperity_range(pressure_units(surface, material)) if MODELS[model].by_summits else path
        record = record_path(contact, observables, path, reachable, progress)
        loading = [step["mean_separation"] for step in record.steps if step["leg"] == 0]
        reasons = observables.reasons_against(loading, record.pressed) + reasons_of_edges(surface, record.steps)
        values = observables.of_contact()
        dataset = run_dataset(surface, material, path, model, seed, record, contact.asperities, reasons, values)
    if record.failure:
        raise ConvergenceError(record.failure, dataset) from None
    if path.unload:
        pull_off = record.snapshots[-1]["snapshot_step"]
        # Nominal tension if all summits had their pull-off force at the same time, Pa.
        radii = float(np.sum(contact.asperities.radius_of_curvature))
        summits_pull = 1.5 * np.pi * material.receding.surface_energy * radii / contact.area
        least_area = 1 / surface.grid**2 if MODELS[model].by_cells else 0.0
        loop = summarise_loop(record.steps, pull_off, material, summits_pull, record.unattributed, least_area)
        loop["uphill_jump_in_count"] = count_uphill_jumps_in(record)
        measured = loop_values(record.steps, loop, surface, material) if surface.free else {}
        dataset = dataset.assign(describe_variables(LOOP | INDENTER, loop | measured))
    return dataset


def empty_run(
    surface: Surface, material: Material, path: Path, reason: str, *, model: str = DEFAULT_MODEL, seed: int = -1
) -> xr.Dataset:
    """Return the dataset of a run that could not be computed: no steps, and the reason as attribute `incomplete`.

    The arguments other than `reason` are those of `simulate`.
    """
    record, summits = PathRecord(reason), locate_summits(surface)
    coverage = SummitCoverage.of(surface, summits)
    reasons = coverage.reasons_against([surface.unit_height]) if MODELS[model].by_summits else []
    return run_dataset(surface, material, path, model, seed, record, summits, reasons, {})
