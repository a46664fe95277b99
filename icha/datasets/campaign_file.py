"""Build the campaign dataset from the runs of all studies.

Each study is one group with arrays along the labels of its runs. ICHA reads all runs into memory, arranges them along
the labels, and fills the arrays of a study one after the other. `docs/howto/dataset.md` describes the dataset.
"""

import itertools
import math
import os
from collections.abc import Iterable, Mapping
from typing import Any

import h5py
import numpy as np
import xarray as xr
from h5py import h5d, h5s

from icha.datasets.attributes import COLLECTED, combine_attributes
from icha.datasets.build import describe_variables
from icha.datasets.files import check_is_run, encode_texts, is_text, read_run, readable
from icha.datasets.labels import LABELS, RunLabels, arrange_slopes, slope_dims
from icha.datasets.variables.campaign import (
    BEYOND_MODEL,
    CAMPAIGN,
    COMPLETE,
    FAILED_CHECKS,
    INCOMPLETE,
    MISSING,
    NOT_IN_DESIGN,
    RAGGED,
    STATUS_ATTRIBUTES,
    VARIES_WITH,
    VARIES_WITH_OWN_UNITS,
    WHOLE_RUNS,
    index_variable,
)
from icha.datasets.variables.run import CELLS, CYCLE, FURTHER, LOOP, OF_MODELS, OF_SOME, RUN
from icha.path.targets import UNLOADING
from icha.support.input_files import text

# Labels of a run, and the dataset of the run or the path of its file.
LabelledRun = tuple[RunLabels | tuple, xr.Dataset | str | os.PathLike]

# Variables of runs that are in the campaign dataset: all except maps.
_OF_RUNS = frozenset(
    name
    for name, described in (RUN | OF_MODELS | CYCLE | LOOP | OF_SOME).items()
    if not set(CELLS) & set(described.dims)
)
# Values that must be the same for several runs count as equal up to this relative difference.
_SAME = 1e-9
_ENDED_EARLY = (INCOMPLETE, BEYOND_MODEL)

_LAYOUT = (
    "Variables of the runs along model, surface, seed, rms_slope and material. Spots and events are ragged arrays "
    "along spot and event, with one run after the other in the order of the labels. A variable with the attribute "
    "instance_dimension gives, for each spot or event, the position of its run or snapshot along this dimension."
)
_OWN_SLOPES = "each surface has different slopes, in ascending order along the dimension rms_slope"
_STUDIES = "The runs of every study, with one group for each study."
# Attribute of the root of the file. The root has no variables.
_ACCESS = (
    "The file has one group for each study: {0}. To open a group with Python's xarray, use "
    "xarray.open_datatree(FILE)['{1}'].to_dataset(), or xarray.open_dataset(FILE, group='{1}')"
)


class _Run:
    """A run in memory.

    Attributes
    ----------
    labels : labels of the run.
    source : dataset of the run, or path of its file.
    values : values of each variable, by name; texts are bytes. `_Study` removes the values that it has used.
    attrs : global attributes of the run.
    snapshots : kind and target of each snapshot of the run.
    step_count : number of steps.
    status, failure : status of the run, and reason why the run is not complete ("" for a complete run).
    extent : sort key; the run with the largest extent has the most variables and steps.
    """

    def __init__(self, labels: RunLabels, source: xr.Dataset | str | os.PathLike):
        self.labels, self.source = labels, source
        self.values, self.attrs = (_values_of if isinstance(source, xr.Dataset) else _read_values)(source)
        kinds, targets = (self.values.get(f"snapshot_{name}", np.empty(0)).tolist() for name in ("kind", "target"))
        self.snapshots = list(zip(kinds, targets, strict=True))
        self.step_count = self.values["step"].size
        reasons = [(status, str(self.attrs[name])) for status, name in STATUS_ATTRIBUTES.items() if name in self.attrs]
        self.status, self.failure = (*reasons, (COMPLETE, ""))[0]
        self.extent = self.status not in _ENDED_EARLY, len(self.values), self.step_count

    def sample(self) -> xr.Dataset:
        """Return the dataset of the run without maps, with the attributes of its variables."""
        run = self.source if isinstance(self.source, xr.Dataset) else read_run(self.source)
        return run.drop_dims(CELLS, errors="ignore")


def _read_values(path: str | os.PathLike) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Read the values and the global attributes of a run from its file, without maps.

    The low-level interface of h5py takes a quarter of the time that xarray takes.
    """
    with readable(path), h5py.File(path) as file:
        check_is_run(file, path)
        values = {}
        for name in file:
            if name in _OF_RUNS:
                variable = h5d.open(file.id, name.encode())
                found = np.empty(variable.shape, variable.dtype.newbyteorder("="))
                variable.read(h5s.ALL, h5s.ALL, found)
                # The last dimension of texts is that of their characters.
                values[name] = found.view(f"S{found.shape[-1]}")[..., 0] if found.dtype == "S1" else found
        names = ("applicability", "attraction", *STATUS_ATTRIBUTES.values())
        return values, {name: text(file.attrs[name]) for name in names if name in file.attrs}


def _values_of(run: xr.Dataset) -> tuple[dict[str, np.ndarray], Mapping]:
    """Return the values and attributes of a run in memory, as `_read_values` does for a file."""
    variables = run.drop_dims(CELLS, errors="ignore").variables
    return {name: encode_texts(v.values) if is_text(v.dtype) else v.values for name, v in variables.items()}, run.attrs


class _Study:
    """The arrays of a study along the labels of its runs.

    Attributes
    ----------
    runs : the computed runs, in the order of their positions along the labels.
    places : index of each run along each label.
    axes : values of each label.
    sizes : sizes of all dimensions except those of spots and events.
    snapshots : index of each snapshot along the dimension `snapshot`, by kind and target.
    variables : variables of the runs with their attributes, each from one run as an example.
    coordinates : names of the variables that are coordinates.
    origins : global attributes of the examples.
    """

    def __init__(self, name: str, design: list[RunLabels], found: Mapping[RunLabels, _Run]):
        self.name, self.design = name, design
        self.axes: dict[str, Any] = {label: list(dict.fromkeys(getattr(r, label) for r in design)) for label in LABELS}
        self.axes["seed"].sort()
        self.axes["rms_slope"] = arrange_slopes((labels.surface, labels.rms_slope) for labels in design)
        self.places = {labels: self._place(labels) for labels in design}
        runs = [found[labels] for labels in design if labels in found]
        if not runs:
            raise ValueError(f"study {name}: no run is computed; expected at least one run")
        self.variables: dict[str, xr.Variable] = {}
        self.coordinates, self.origins = set(LABELS), []
        models = set()
        longest_first = sorted(runs, key=lambda run: run.extent, reverse=True)
        for run in sorted(longest_first, key=lambda run: self.axes["model"].index(run.labels.model)):
            if run.labels.model not in models or not run.values.keys() <= self.variables.keys():
                models.add(run.labels.model)
                sample = run.sample()
                self.variables = dict(sample.variables) | self.variables
                self.coordinates |= set(sample.coords)
                self.origins.append(sample.attrs)
        # Kind and target identify a snapshot. Runs may have their snapshots in different orders.
        snapshots = dict.fromkeys(itertools.chain(*(run.snapshots for run in (longest_first[0], *runs))))
        self.snapshots = {each: k for k, each in enumerate(snapshots)}
        self.runs = sorted(runs, key=lambda run: self.places[run.labels])
        self.sizes = {dim: n for v in self.variables.values() for dim, n in v.sizes.items() if dim not in RAGGED}
        largest = {"snapshot": len(snapshots), "step": max(run.step_count for run in runs)}
        self.sizes |= {dim: size for dim, size in largest.items() if dim in self.sizes}
        self.sizes |= {label: len(self.axes[label]) for label in LABELS}
        self.sizes["rms_slope"] = self.axes["rms_slope"].shape[-1]
        self.varies_with = VARIES_WITH_OWN_UNITS if self._has_own_units() else VARIES_WITH

    def _place(self, labels: RunLabels) -> tuple[int, ...]:
        """Return the index of a run along each label."""
        at = {label: self.axes[label].index(getattr(labels, label)) for label in LABELS if label != "rms_slope"}
        slopes = self.axes["rms_slope"][at["surface"]] if self.axes["rms_slope"].ndim == 2 else self.axes["rms_slope"]
        return tuple((at | {"rms_slope": int(np.argmax(slopes == labels.rms_slope))})[label] for label in LABELS)

    def _has_own_units(self) -> bool:
        """Return whether runs of equal rms slopes may have different units: with shapes, and with rms heights."""
        units: dict[float, list[float]] = {}
        for run in self.runs:
            units.setdefault(run.labels.rms_slope, []).append(float(run.values.get("unit_slope", math.nan)))
        return "shape" in self.variables or any(max(each) > (1 + _SAME) * min(each) for each in units.values())

    def dataset(self, varied: Mapping[str, tuple[str, str, dict]], attrs: Mapping[str, str]) -> xr.Dataset:
        """Return the dataset of the study; the values of the runs are removed, because arrays now contain them.

        `varied` are the varied parameters as in `campaign_tree`, and `attrs` the attributes of the file.
        """
        variables: dict[str, xr.Variable] = {}
        for name, variable in self.variables.items():
            if name in self.sizes and name not in LABELS:
                variables[name] = xr.Variable(name, np.arange(self.sizes[name], dtype=np.int32), variable.attrs)
            elif name not in LABELS and not set(variable.dims) & set(RAGGED):
                variables[name] = self._along_labels(name)
        for dim in RAGGED:
            if names := [name for name, variable in self.variables.items() if variable.dims == (dim,)]:
                variables |= self._ragged(dim, names)
        variables |= self._of_design()
        coordinates = {name: variables.pop(name) for name in sorted(self.coordinates) if name in variables}
        coordinates |= {
            name: _along_label(name, *each, self.axes) for name, each in varied.items() if name not in variables
        }
        shared = {"study": self.name, "license": self.origins[0].get("license")}
        # The checksum of the campaign, and not that of one of the runs.
        shared["config_sha256"] = attrs.get("config_sha256")
        given = {name: value for name, value in shared.items() if value is not None}
        described = combine_attributes(f"Study {self.name}", _LAYOUT, COLLECTED, self.origins)
        return xr.Dataset(variables, coordinates, described | given)

    def _of_design(self) -> dict[str, xr.Variable]:
        """Return the labels, and the variables that describe each run of the design, such as `status`."""
        shape = tuple(self.sizes[label] for label in LABELS)
        values: dict[str, Any] = dict(self.axes)
        values["status"] = np.full(shape, NOT_IN_DESIGN, np.int8)
        values["step_count"] = np.zeros(shape, np.int32)
        texts = ("failure", "applicability", "attraction")
        values |= {name: np.full(shape, "", object) for name in texts}
        for labels in self.design:
            values["status"][self.places[labels]] = MISSING
        for run in self.runs:
            place, status, failure = self.places[run.labels], run.status, run.failure
            # A state that unloading does not reach has no snapshot.
            lacks = any(not text(kind).startswith(UNLOADING) for kind, _ in self.snapshots.keys() - set(run.snapshots))
            if status in (*WHOLE_RUNS, FAILED_CHECKS) and lacks:
                status, failure = INCOMPLETE, f"{len(run.snapshots)} of {len(self.snapshots)} snapshots"
            values["status"][place], values["step_count"][place] = status, run.step_count
            for name, value in zip(texts, (failure, *(run.attrs.get(each, "") for each in texts[1:])), strict=True):
                values[name][place] = str(value)
        slopes = values.pop("rms_slope")
        variables = describe_variables(CAMPAIGN, values)
        attributes = CAMPAIGN["rms_slope"].attributes | ({"comment": _OWN_SLOPES} if slopes.ndim > 1 else {})
        return variables | {"rms_slope": xr.Variable(slope_dims(slopes), slopes, attributes)}

    def _along(self, name: str) -> tuple[str, ...]:
        """Return the labels along which a variable of the runs varies."""
        along, dims = self.varies_with.get(name, LABELS), slope_dims(self.axes["rms_slope"])
        if "rms_slope" not in along:
            return along
        return tuple(label for label in LABELS if label in {*along, *dims})

    def _along_labels(self, name: str) -> xr.Variable:
        """Return the array of a variable of all runs; raise ValueError if runs differ in a value that they share."""
        along, dims = self._along(name), self.variables[name].dims
        having = [run for run in self.runs if name in run.values]
        shape = [self.sizes[dim] for dim in (*along, *dims)]
        array = _empty(shape, [run.values[name].dtype for run in having])
        columns = [LABELS.index(label) for label in along]
        for run in having:
            values = run.values.pop(name)
            snapshots = [self.snapshots[each] for each in run.snapshots]
            sizes = zip(dims, values.shape, strict=True)
            slots = tuple(snapshots if dim == "snapshot" else slice(size) for dim, size in sizes)
            of_run = array[(*(self.places[run.labels][column] for column in columns), ...)]
            if along != LABELS:
                values = _shared(of_run[slots], values, f"{run.labels}: {name}", along)
            of_run[slots] = values
        return self._variable(name, (*along, *dims), array, len(having) == len(self.runs))

    def _ragged(self, dim: str, names: list[str]) -> dict[str, xr.Variable]:
        """Return the variables along a ragged dimension, and for each of its values the index of its run.

        The spots of a run are sorted by the index of their snapshot.
        """
        rows: dict[str, list[np.ndarray]] = {name: [] for name in names}
        counts = []
        for run in self.runs:
            found = {name: run.values.pop(name) for name in names if name in run.values}
            counts.append(len(next(iter(found.values()), ())))
            order = slice(None)
            if "spot_snapshot" in found:
                numbers = np.array([self.snapshots[each] for each in run.snapshots], np.int32)
                found["spot_snapshot"] = numbers[found["spot_snapshot"]]
                order = np.argsort(found["spot_snapshot"], kind="stable")
            for name in names:
                rows[name].append(found[name][order] if name in found else np.full(counts[-1], np.nan))
        variables = {name: self._variable(name, (dim,), np.concatenate(rows.pop(name)), True) for name in names}
        places = np.array([self.places[run.labels] for run in self.runs], np.int32)
        for label, column in zip(LABELS, np.repeat(places, counts, axis=0).T, strict=True):
            described = index_variable(dim, label)
            variables[f"{dim}_{label}"] = xr.Variable(described.dims, column, described.attributes)
        return variables

    def _variable(self, name: str, dims: tuple[str, ...], array: np.ndarray, everywhere: bool) -> xr.Variable:
        """Return the variable of an array; `everywhere` is True if all runs have the variable.

        Every netCDF tool reads integers of 32 bits, and flags of 8 bits. As in xarray, integers of which some are
        missing are floats with the encoding of integers.
        """
        example, encoding = self.variables[name], {}
        owners = [model for model, names in FURTHER.items() if name in names]
        lacking = [model for model in self.axes["model"] if owners and model not in owners]
        missing = f"in runs with the model {' or '.join(lacking)}" if lacking else ""
        if name in OF_SOME and not everywhere:
            missing = "in runs whose model, material, shape or path does not define the value"
        if array.dtype.kind == "S":
            array = np.char.decode(array, "utf-8").astype(object)
        elif example.dtype.kind in "iu":
            if array.dtype.kind == "f" and np.isnan(array).any():
                encoding = {"dtype": np.dtype(np.int32)}
            else:
                array = array.astype(np.int8 if example.dtype == np.int8 else np.int32)
        return xr.Variable(dims, array, example.attrs | ({"missing": missing} if missing else {}), encoding)


def _empty(shape: list[int], dtypes: list[np.dtype]) -> np.ndarray:
    """Return an array of missing values: empty texts of the largest length of the types, or NaN for numbers."""
    texts = [dtype.itemsize for dtype in dtypes if dtype.kind == "S"]
    return np.zeros(shape, f"S{max(texts)}") if texts else np.full(shape, np.nan)


def _shared(known: np.ndarray, values: np.ndarray, where: str, along: tuple[str, ...]) -> np.ndarray:
    """Return the known values that several runs share, and `values` where none is known."""
    if known.dtype.kind == "S":
        unknown, equal = known == b"", known == values
    else:
        unknown, equal = np.isnan(known), np.isclose(known, values, rtol=_SAME, atol=0)
    if not np.all(unknown | equal):
        shared = ", ".join(along) or "the study"
        raise ValueError(f"{where} differs between runs that share {shared}; expected equal values")
    return np.where(unknown, values, known)


def _along_label(name: str, label: str, unit: str, by_name: Mapping, axes: Mapping[str, Any]) -> xr.Variable:
    """Return the coordinate of a varied parameter that depends on one label; `by_name` has its values."""
    given = [by_name.get(each) for each in axes[label]]
    attributes = {"units": unit, "long_name": f"{name.replace('_', ' ')} of the {label}", "varied": "true"}
    if all(isinstance(value, int | float | None) for value in given):
        values = np.array([math.nan if value is None else value for value in given], float)
        attributes |= {"missing": f"for a {label} without this parameter"} if None in given else {}
    else:
        values = np.array(["" if value is None else str(value) for value in given], object)
    return xr.Variable((label,), values, attributes)


def _plain(labels: RunLabels | tuple) -> RunLabels:
    """Return labels with seed and slope as Python's int and float instead of types of numpy."""
    labels = RunLabels(*labels)
    return labels._replace(seed=int(labels.seed), rms_slope=float(labels.rms_slope))


def campaign_tree(
    runs: Iterable[LabelledRun],
    *,
    design: Iterable[RunLabels | tuple] | None = None,
    attrs: Mapping[str, str] = {},
    varied: Mapping[str, Mapping[str, tuple[str, str, dict]]] = {},
) -> xr.DataTree:
    """Build the campaign dataset: one group for each study, with arrays along the labels of the runs.

    The dataset does not contain the maps of boundary elements.

    Parameters
    ----------
    runs : for each run, its labels (study, model, surface, seed, rms_slope, material), and its dataset or path. Names
        have the order of the design. Seeds and slopes are sorted. A run counts as incomplete if it has the attribute
        `incomplete`, or if it lacks a snapshot that another run of its study has.
    design : labels of all runs of the campaign. Default: the labels in `runs`. Other combinations of these labels have
        the status `not_in_design`.
    attrs : global attributes (title, summary, campaign, license, …).
    varied : for each study, its varied parameters by name: label on which the parameter depends (surface or material),
        unit, and value for each value of the label. They become coordinates.

    Raises
    ------
    ValueError
        If a run is given twice or is not in the design; if runs differ in a value that they must share; if a file
        cannot be read. The message names the run.
    """
    found: dict[RunLabels, _Run] = {}
    for labels, source in runs:
        labels = _plain(labels)
        if labels in found:
            raise ValueError(f"{labels}: this run is given twice")
        found[labels] = _Run(labels, source)
    designs: dict[str, list[RunLabels]] = {}
    asked = dict.fromkeys(found if design is None else map(_plain, design))
    for labels in asked:
        designs.setdefault(labels.study, []).append(labels)
    for labels in found:
        if labels not in asked:
            raise ValueError(f"{labels}: this run is not in the design")
    studies = [_Study(name, of_study, found) for name, of_study in designs.items()]
    groups = {f"/{study.name}": study.dataset(varied.get(study.name, {}), attrs) for study in studies}
    origins = [each for study in studies for each in study.origins]
    described = combine_attributes("Campaign of rough contacts", _STUDIES, COLLECTED, origins)
    access = _ACCESS.format(", ".join(designs), next(iter(designs)))
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=described | {"comment": access} | dict(attrs))} | groups)
