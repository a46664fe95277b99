"""Select runs, snapshots and errors for a figure from the datasets of a campaign."""

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import NamedTuple, Self

import numpy as np
import xarray as xr

from icha.analysis.model_error import snapshot_if_any
from icha.contact.attraction import FINITE_RANGE
from icha.contact.models import DEFAULT_MODEL, MODELS, REFERENCE_MODEL, first_model, model_of
from icha.datasets.campaign import find_snapshot, loading_stops, reduced_gap, run_place, runs_of_status, select_run
from icha.datasets.labels import LABELS, RunLabels, place_of
from icha.datasets.quantities import quantity
from icha.datasets.variables.campaign import COMPUTED_RUNS, LOADED_RUNS, MISSING, RAGGED, WHOLE_RUNS
from icha.figures.drawn import Name
from icha.figures.style import format_number
from icha.path.targets import LOADS, UNITS, UNLOADING
from icha.support.formatting import format_quantity
from icha.uncertainty.grid_error import LOOP_ERRORS, cells_of_length

# Name of boundary elements at a finite range of attraction in legends; other names are in the records of the models.
FINITE_RANGE_NAME = "boundary elements at finite range"
# Why lines are pale, in the words of a legend.
NOT_APPLICABLE = "asperity model not applicable"
COARSE_GRID = "grid too coarse for boundary elements"


def name_of_model(run: xr.Dataset) -> str:
    """Return the name of the model of a run in legends."""
    return FINITE_RANGE_NAME if run.attrs.get("attraction") == FINITE_RANGE else model_of(run.attrs).words


class NothingToDraw(ValueError):
    """The campaign has no complete run that the figure could show; the message names what is missing."""


# Labels and dataset of each run.
LabelledRuns = list[tuple[RunLabels, xr.Dataset]]
# A run and the index of a snapshot of it, for each run of an ensemble.
Members = Sequence[tuple[xr.Dataset, int]]


class Line(NamedTuple):
    """What a line of a figure shows.

    Attributes
    ----------
    material, surface : names of material and surface.
    rms_slope : rms slope of the surface; None if the figure does not distinguish slopes.
    model : contact model.
    doubt : why the line is drawn pale, as `doubt_about` states it; "" for most lines.
    """

    material: str
    surface: str
    rms_slope: float | None
    model: str = DEFAULT_MODEL
    doubt: str = ""

    @classmethod
    def of(cls, labels: RunLabels, doubt: str = "") -> Self:
        """Return the line of runs with these labels, except the seed."""
        return cls(labels.material, labels.surface, labels.rms_slope, labels.model, doubt)

    @property
    def contact(self) -> tuple[str, str, float | None]:
        """Material, surface and rms slope."""
        return self[:3]

    @property
    def place(self) -> tuple[str, float | None]:
        """Surface and rms slope."""
        return self[1:3]


class ContactRuns(NamedTuple):
    """The complete runs of one model, material, surface and rms slope: one run for each seed.

    Runs that are drawn pale form a separate group.

    Attributes
    ----------
    labels : labels of the first run.
    by_seed : the runs, by seed.
    asked : number of seeds that the study requests.
    doubt : why the runs are drawn pale, as `doubt_about` states it; "" for most runs.
    """

    labels: RunLabels
    by_seed: dict[int, xr.Dataset]
    asked: int
    doubt: str = ""

    @property
    def line(self) -> Line:
        """The line that shows the runs."""
        return Line.of(self.labels, self.doubt)

    @property
    def model_name(self) -> str:
        """Name of the model in legends."""
        return name_of_model(self.first)

    @property
    def drawn_name(self) -> Name:
        """Name in the table of a figure: the model, and the labels; without the seed if there are several seeds."""
        several = len(self.by_seed) > 1
        return Name(self.model_name, self.labels._replace(seed=None) if several else self.labels)

    @property
    def first(self) -> xr.Dataset:
        """The first run."""
        return next(iter(self.by_seed.values()))

    @property
    def members(self) -> LabelledRuns:
        """Labels and dataset of every run."""
        return [(self.labels._replace(seed=seed), run) for seed, run in self.by_seed.items()]

    @property
    def surface_energy(self) -> float:
        """Surface energy of the material, J/m^2."""
        return float(self.first["surface_energy"])


def group_by_contact(
    campaign: xr.DataTree, runs: LabelledRuns, doubt_of_run: Callable[[xr.Dataset], str] | None = None
) -> list[ContactRuns]:
    """Group runs that differ only in their seed; `doubt_of_run` states why a run is drawn pale (`doubt_about`)."""
    found: dict[tuple, ContactRuns] = {}
    for labels, run in runs:
        key = labels._replace(seed=None), (doubt_of_run or doubt_about)(run)
        if key not in found:
            asked = asked_seeds(campaign[labels.study].to_dataset(), labels)
            found[key] = ContactRuns(labels, {}, asked, key[1])
        found[key].by_seed[labels.seed] = run
    return list(found.values())


def select_runs(campaign: xr.DataTree, study: str, *, ragged: bool = True, model: str | None = None) -> LabelledRuns:
    """Return all complete runs of a study that use one model: `model`, or by default the `shown_model` of the study.

    Spots and events of the runs are left out unless they are `ragged`, which is much slower. Raise `NothingToDraw` if
    no run of the `shown_model` is complete.
    """
    dataset = campaign[study].to_dataset()
    wanted = model or shown_model(dataset)
    found = [labels for labels in runs_of_status(dataset, study, LOADED_RUNS) if labels.model == wanted]
    # Adhesion may end a run before its first target.
    counts = dataset["step_count"].transpose(*LABELS).values
    found = [labels for labels in found if counts[tuple(run_place(dataset, labels).values())]]
    if not found and model is None:
        raise NothingToDraw(f"study {study}: no run is complete")
    if not ragged:
        campaign = xr.DataTree.from_dict({f"/{study}": dataset.drop_dims(RAGGED, errors="ignore")})
    runs = [(labels, select_run(campaign, labels)) for labels in found]
    return [(labels, run.assign(reduced_gap=reduced_gap(run))) for labels, run in runs]


def asked_seeds(study: xr.Dataset, labels: RunLabels) -> int:
    """Return the number of seeds that a study requests for the model, surface, slope and material of a run."""
    at = place_of(study, {label: getattr(labels, label) for label in LABELS if label != "seed"})
    return int(np.isin(study["status"].isel(at).values, (*COMPUTED_RUNS, MISSING)).sum())


def has_shape(study: xr.Dataset) -> bool:
    """Return whether a surface of a study has a shape, so that its units of loads and separations are the shape's."""
    return "shape" in study and bool((study["shape"] != "").any())


def has_layer(study: xr.Dataset) -> bool:
    """Return whether a run of a study is on a layer of finite thickness."""
    return "layer_thickness" in study and bool(np.isfinite(study["layer_thickness"]).any())


def doubt_about(run: xr.Dataset) -> str:
    """Return that the model of a run is not applicable, in the words of a legend; "" if the run states no reason."""
    if not run.attrs.get("applicability"):
        return ""
    model = run.attrs.get("contact_model", DEFAULT_MODEL)
    return NOT_APPLICABLE if model == DEFAULT_MODEL else f"{MODELS[model].words} not applicable"


def doubt_about_loop(run: xr.Dataset, variable: str = "hysteresis_loss") -> str:
    """Return why pull-off or loss of a run is in doubt: its grid is too coarse, or `doubt_about`."""
    least = LOOP_ERRORS[variable].least_cells
    coarse = run.attrs.get("contact_model") == REFERENCE_MODEL and cells_of_length(run) < least
    return COARSE_GRID if coarse else doubt_about(run)


def shown_model(study: xr.Dataset) -> str:
    """Return the model that figures of a study show: the asperity model, or else the first model of the study."""
    return first_model(study["model"].values.tolist())


def select_by_labels(runs: LabelledRuns, **wanted: object) -> LabelledRuns:
    """Return the runs with the wanted labels; None stands for the label of the first run.

    Raise `NothingToDraw` if no run has a wanted label.
    """
    for name, value in wanted.items():
        present = [getattr(labels, name) for labels, _ in runs]
        value = present[0] if value is None else value
        if value not in present:
            complete = ", ".join(map(str, dict.fromkeys(present)))
            raise NothingToDraw(f"no complete run has {name} {value}; complete runs have {name} {complete}")
        runs = [(labels, run) for labels, run in runs if getattr(labels, name) == value]
    return runs


def select_complete_run(campaign: xr.DataTree, labels: RunLabels, statuses: Collection[int] = WHOLE_RUNS) -> xr.Dataset:
    """Return a run of the campaign; raise `NothingToDraw` if its status is not one of `statuses`."""
    dataset = campaign[labels.study].to_dataset()
    if int(dataset["status"].isel(run_place(dataset, labels))) not in statuses:
        raise NothingToDraw(f"{labels}: this run is not complete")
    return select_run(campaign, labels)


def early_end(run: xr.Dataset) -> str:
    """Return a sentence on the end of a run before its last target; "" if the run reached its last target."""
    reason = run.attrs.get("beyond_model")
    return f"The run ended before its last target: {reason}." if reason else ""


def path_steps(run: xr.Dataset) -> xr.Dataset:
    """Return the steps of the first loading at targets of the study, only for the most frequent kind of target.

    Steps at zero load are left out: their load is only an error of the solver.
    """
    run = run.isel(step=loading_stops(run).values)
    kinds = [str(kind) for kind in run["step_kind"].values]
    main = max(dict.fromkeys(kinds), key=kinds.count, default=None)
    unloaded = (run["step_target"].values == 0) & (main in LOADS)
    return run.isel(step=[kind == main for kind in kinds] & ~unloaded)


def branches(run: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield for every leg of a run: branch (loading or unloading), and steps from the end of the previous leg on."""
    legs = run["leg"].values
    for leg in np.unique(legs):
        steps = np.flatnonzero(legs == leg)
        yield str(run["branch"].values[steps[0]]), run.isel(step=slice(max(steps[0] - 1, 0), steps[-1] + 1))


def unloading_legs(run: xr.Dataset) -> list[xr.Dataset]:
    """Return the steps of each unloading leg of a run; the first step is the turning point before the leg."""
    return [leg for branch, leg in branches(run) if branch == "unloading"]


class Snapshots(NamedTuple):
    """Runs that differ only in their seed, and the index of the same snapshot in each run.

    Attributes
    ----------
    runs : the runs.
    members : pairs of a run and the index of the snapshot in this run.
    truths : the same pairs for runs with boundary elements; empty if `runs` are already runs with boundary elements.
    """

    runs: ContactRuns
    members: Members
    truths: Members

    @property
    def truth_name(self) -> Name:
        """Name of the runs with boundary elements in the table of a figure."""
        labels = self.runs.labels._replace(model=REFERENCE_MODEL, seed=None)
        return Name(MODELS[REFERENCE_MODEL].words, labels)


def select_snapshots(
    campaign: xr.DataTree, study: str, kind: str | None = None, target: float | None = None
) -> list[Snapshots]:
    """Return the same snapshot of every run on the first surface and slope of a study, for the `shown_model`.

    Runs that do not reach the state are left out.
    """
    groups = group_by_contact(campaign, select_runs(campaign, study))
    dataset = campaign[study].to_dataset()
    state = kind_and_target(dataset, find_snapshot(dataset, kind, target))
    alone = groups[0].labels.model == REFERENCE_MODEL
    others = [] if alone else select_runs(campaign, study, model=REFERENCE_MODEL)
    found = []
    for group in groups:
        if group.line.place == groups[0].line.place:
            members = [(run, snapshot_if_any(run, *state)) for run in group.by_seed.values()]
            members = [member for member in members if member[1] is not None]
            if not members:
                continue
            beside = [run for labels, run in others if Line.of(labels).contact == group.line.contact]
            truths = [(truth, snapshot_if_any(truth, *state)) for truth in beside]
            found.append(Snapshots(group, members, [truth for truth in truths if truth[1] is not None]))
    if not found:
        raise NothingToDraw(f"study {study}: no run reaches the state of the snapshot")
    return found


def kind_and_target(data: xr.Dataset, snapshot: int) -> tuple[str, float]:
    """Return kind and target of a snapshot of a study or run."""
    return str(data["snapshot_kind"].values[snapshot]), float(data["snapshot_target"].values[snapshot])


def snapshot_label(run: xr.Dataset, snapshot: int) -> str:
    """Return the target of a snapshot as text, such as an area fraction with its value."""
    kind, value = str(run["snapshot_kind"].values[snapshot]), float(run["snapshot_target"].values[snapshot])
    if kind == "pull_off":
        return "pull-off"
    branch = "unloading, " if kind.startswith(UNLOADING) else ""
    kind = kind.removeprefix(UNLOADING)
    shown = format_quantity(value, UNITS[kind]) if kind in UNITS else format_number(value)
    return f"{branch}${quantity(kind).symbol}$ = {shown}"


# --- runs that were unloaded ---

# A tension counts as a rounding error if it is below this fraction of the largest pressure.
ROUNDING = 1e-9


def select_unloaded_runs(campaign: xr.DataTree, study: str, model: str | None = None) -> LabelledRuns:
    """Return the runs of a study that unload, without spots and events; `model` is the preferred model, if any.

    Raise `NothingToDraw` if no run is complete, or if no run unloads.
    """
    runs = _select_runs_with(unloading_legs, campaign, study, [model, None, REFERENCE_MODEL])
    if not runs:
        raise NothingToDraw(f"study {study}: no run reached its unloading; `icha run` prints where the runs ended")
    return runs


def _select_runs_with(condition, campaign, study, models=(None, REFERENCE_MODEL)):
    """Return the runs that fulfil a condition, of the first of some models that has such runs.

    None is the `shown_model` of the study. Near full contact, runs with asperities end before unloading, but runs with
    boundary elements may unload.
    """
    for model in models:
        runs = select_runs(campaign, study, ragged=False, model=model)
        if found := [(labels, run) for labels, run in runs if condition(run)]:
            break
    return found


def select_detached_lines(
    campaign: xr.DataTree, studies: Sequence[str], quantity: str, *, along_slopes: bool = False
) -> dict[Line, list[ContactRuns]]:
    """Return the runs of some studies that were unloaded to complete separation, as lines of points.

    Boundary elements are beside runs of another model. Raise `NothingToDraw` if there is no line.

    Parameters
    ----------
    quantity : variable of the loop that the runs must have; a run that failed checks of its loss has no loss.
    along_slopes : True if a line joins points at several rms slopes. If False, every rms slope has its own line.
    """

    def has_quantity(run):
        return quantity in run

    found = {}
    for study in studies:
        runs = _select_runs_with(has_quantity, campaign, study)
        if runs and runs[0][0].model != REFERENCE_MODEL:
            runs += _select_runs_with(has_quantity, campaign, study, [REFERENCE_MODEL])
        for point in group_by_contact(campaign, runs, lambda run: doubt_about_loop(run, quantity)):
            line = point.line._replace(rms_slope=None) if along_slopes else point.line
            found.setdefault(line, []).append(point)
    if studies and not found:
        words = quantity.replace("_", " ")
        raise NothingToDraw(
            f"studies {', '.join(studies)}: no run was unloaded to complete separation with a valid {words}"
        )
    return found


def pull_off_step(run: xr.Dataset) -> int | None:
    """Return the step of the largest tension in the last unloading; None if there is no tension."""
    last = unloading_legs(run)[-1]
    lowest = int(np.argmin(last["nominal_pressure"].values))
    step = np.flatnonzero(run["step"].values == last["step"].values[lowest])[0]
    pressure = run["nominal_pressure"].values
    return int(step) if pressure[step] < -ROUNDING * pressure.max() else None
