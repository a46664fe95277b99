"""The campaign dataset, written run by run: memory does not grow with the runs, but for a few numbers of each.

The runs are taken one after the other. What is needed of all before the first can be written (how many steps and spots
there are, which snapshots, how long the texts) is noted; their values go to a temporary file, from which they are taken
in the order of the dataset, a block of neighbouring runs at a time.
"""

import itertools
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

import netCDF4
import numpy as np
import xarray as xr

from icha.datasets.attributes import COLLECTED, collected
from icha.datasets.campaign_file.arrangement import arranged
from icha.datasets.campaign_file.group import VALUES_IN_BLOCK, Column, Group, define_group
from icha.datasets.campaign_file.spool import Entry, spooled, values_back
from icha.datasets.labels import LABELS, RunLabels
from icha.datasets.netcdf import characters
from icha.datasets.variables.campaign import RAGGED
from icha.support.atomic_files import whole_file

# Of what runs share, values at so many places are kept at most.
_LATEST = 256
_STUDIES = "The runs of every study, a group for each."


def write_campaign(
    runs: Iterable[tuple[RunLabels | tuple, xr.Dataset | str | os.PathLike]],
    path: str | os.PathLike,
    *,
    design: Iterable[RunLabels | tuple] | None = None,
    settings: Mapping[RunLabels | tuple, str] = {},
    attrs: Mapping[str, str] = {},
) -> None:
    """Write all runs of a campaign to one netCDF-4 file: a group per study, full arrays along the labels of the runs.

    The groups have the dimensions model, surface, seed, rms_slope and material, and those of the run dataset but for
    those of the maps of boundary elements, which stay in the files of the runs. A run has `step_count` steps; beyond
    them, along `step`, numbers are missing and texts empty. Spots and events of all runs stand one after the other
    along `spot` and `event`; `spot_model`, `spot_surface`, `spot_seed`, `spot_rms_slope` and `spot_material`,
    `event_model` and so on, and `spot_snapshot`, are positions along these dimensions, from 0. `status(model, surface,
    seed, rms_slope, material)` says of every combination whether its run is complete, incomplete,
    missing, not in the design or no result because its checks failed; `failure` says why it is incomplete or which
    checks failed, `applicability` why its model is not applicable. What is not known of an incomplete run, and
    everything of those that are not there, is missing; so is what only runs of another model have.

    Parameters
    ----------
    runs : pairs of labels (study, model, surface, seed, rms_slope, material) and run dataset, or its file. Studies,
        models, surfaces and materials keep the order in which they first come in the design, seeds and slopes are
        sorted. A run that failed has the reason in its attribute `incomplete`; one that did not converge or lacks
        snapshots that others
        of its study have is incomplete, too.
    path : the file, which appears whole or not at all. The same runs give the same bytes.
    design : labels of the runs that were asked for; those given, if left out. Other combinations of their labels are
        not in the design.
    settings : checksums of the settings that runs are to have been computed with (their attribute `config_sha256`), by
        their labels.
    attrs : global attributes of the file (title, summary, campaign, license, …).

    Raises
    ------
    ValueError
        Naming the run: if it is given twice, is not in the design, has other labels than its dataset, was computed with
        other settings than it should, holds a value that is not finite, or does not fit its study's other runs; if a
        study has no run; if a file cannot be read.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=path.parent) as spool:
        studies = arranged(spooled(runs, spool, settings), design)
        with whole_file(path) as temporary, netCDF4.Dataset(temporary, "w") as file:
            origins = [each for study in studies for each in study.origins]
            own = collected("Campaign of rough contacts", _STUDIES, COLLECTED, origins)
            file.setncatts(own | {"comment": _where([study.name for study in studies])} | dict(attrs))
            # All is defined before anything is written, which is quicker: see icha.datasets.netcdf.
            groups = [define_group(file.createGroup(study.name), study, attrs) for study in studies]
            for group in groups:
                _write(group, spool)


def _where(studies: list[str]) -> str:
    """Where in the file the data are: who opens its root alone sees nothing else."""
    return (
        f"The data are in the groups, one for each study: {', '.join(studies)}. With Python's xarray: "
        f"xarray.open_datatree(FILE)['{studies[0]}'].to_dataset(), or xarray.open_dataset(FILE, group='{studies[0]}')"
    )


def _write(group: Group, spool: BinaryIO) -> None:
    """Write all values of a group, those of the runs from the spool, block by block."""
    for variable, values in group.known:
        variable[...] = values
    for variable, own in group.texts:
        for position, reason in zip(group.study.positions, own, strict=True):
            if reason:
                text = characters(np.array(reason))
                variable[(*position, slice(0, len(text)))] = text
    common = {name: _Common(name, column) for name, column in group.columns.items() if _is_common(column)}
    ragged = _Ragged(group)
    for start, members in _blocks(group):
        _write_block(group, start, members, spool, common, ragged)
    ragged.flush()
    for each in common.values():
        each.flush()


def _write_block(group, start, members, spool, common, ragged):
    """Write a block of neighbouring runs, but for what is kept for later: what they share, and what is ragged."""
    corner = zip(start, group.block, group.study.status.shape, strict=True)
    box = tuple(slice(k, min(k + n, size)) for k, n, size in corner)
    lengths = tuple(side.stop - side.start for side in box)
    block = {
        name: np.full(lengths + column.variable.shape[len(LABELS) :], column.fill, column.variable.dtype)
        for name, column in group.columns.items()
        if column.along == LABELS
    }
    for entry, position in members:
        at = [group.study.snapshots[each] for each in entry.snapshots]
        place = dict(zip(LABELS, position, strict=True))
        values = {
            name: group.columns[name].fitting(*own)
            for name, own in values_back(entry, spool).items()
            if name in group.columns
        }
        for name, v in values.items():
            column = group.columns[name]
            own = column.places(at, v)
            if name in block:
                block[name][(*np.subtract(position, start), ...)][own] = v
            elif name in common:
                common[name].put(entry.labels, tuple(place[label] for label in column.along), own, v)
        ragged.add(position, values, at)
    for name, values in block.items():
        group.columns[name].variable[box] = values


def _is_common(column):
    return column.along != LABELS and not set(column.own) & set(RAGGED)


def _blocks(group: Group) -> Iterator[tuple[tuple[int, ...], list[tuple[Entry, tuple[int, ...]]]]]:
    """Where every block begins that has runs, and these with their positions."""
    placed = zip(group.study.entries, map(tuple, group.study.positions.tolist()), strict=True)
    for start, members in itertools.groupby(
        placed, key=lambda each: tuple(k // n * n for k, n in zip(each[1], group.block, strict=True))
    ):
        yield start, list(members)


class _Common:
    """A variable that several runs share: the first of them says what it is, the others must agree."""

    def __init__(self, name: str, column: Column):
        """Nothing is known yet."""
        self.name, self.column = name, column
        shape, at = column.variable.shape, column.own.index("snapshot") + 1 if "snapshot" in column.own else 0
        self.known = np.zeros(shape[: len(column.along) + at], bool)
        # A number of each run is kept in memory, arrays of each are read from the file again.
        self.held = column.variable
        if not column.own or not column.along:
            self.held = np.full(shape, column.fill, column.variable.dtype)
        # What was last taken or found to agree, by place.
        self.latest: dict[tuple[int, ...], tuple[tuple, np.ndarray]] = {}

    def put(self, labels: RunLabels, place: tuple[int, ...], own: tuple, values: np.ndarray) -> None:
        """Take the values of a run, or compare them."""
        latest = self.latest.get(place)
        if latest and latest[0] == own and np.array_equal(latest[1], values):
            return
        known = self.known[(*place, *own)[: self.known.ndim]]
        if np.any(known):
            there = self.held[(*place, *own)]
            same = there == values if values.dtype.kind == "S" else np.isclose(there, values, rtol=1e-9, atol=0)
            if np.any(known & ~np.reshape(same, (*np.shape(known), -1)).all(axis=-1)):
                shared = ", ".join(self.column.along) or "the study"
                raise ValueError(f"{labels}: {self.name} differs between runs that share {shared}")
        if not np.all(known):
            self.held[(*place, *own)] = values
            self.known[(*place, *own)[: self.known.ndim]] = True
        if len(self.latest) == _LATEST:
            self.latest.clear()
        self.latest[place] = own, values

    def flush(self) -> None:
        """Write what is kept in memory."""
        if self.held is not self.column.variable:
            self.column.variable[...] = self.held


class _Ragged:
    """What the runs have along ragged dimensions, one after the other."""

    def __init__(self, group: Group):
        """Nothing is written yet."""
        dims = dict.fromkeys(dim for dim, _ in group.places)
        self.written = dict.fromkeys(dims, 0)
        self.variables = {
            dim: {name: column.variable for name, column in group.columns.items() if column.own == (dim,)}
            | {f"{dim}_{label}": group.places[dim, label] for label in LABELS}
            for dim in dims
        }
        self._empty()

    def _empty(self):
        self.parts = {dim: {name: [] for name in variables} for dim, variables in self.variables.items()}
        self.taken = 0

    def add(self, position: tuple[int, ...], values: dict[str, np.ndarray], at: list[int]) -> None:
        """Take what a run has; `at` is where its snapshots stand, in whose order its spots are put."""
        for dim, parts in self.parts.items():
            own = {name: values[name] for name in parts if name in values}
            count = max(map(len, own.values()), default=0)
            if "spot_snapshot" in own and count:
                now = np.asarray(at, np.int32)[own["spot_snapshot"]]
                order = np.argsort(now, kind="stable")
                own = {name: v[order] for name, v in (own | {"spot_snapshot": now}).items()}
            own |= {f"{dim}_{label}": np.full(count, k) for label, k in zip(LABELS, position, strict=True)}
            for name, v in own.items():
                parts[name].append(v)
                self.taken += count
        if self.taken > VALUES_IN_BLOCK:
            self.flush()

    def flush(self) -> None:
        """Write what has been taken since the last time."""
        for dim, parts in self.parts.items():
            for name, values in parts.items():
                joined = np.concatenate(values) if values else np.empty(0)
                end = self.written[dim] + len(joined)
                if len(joined):
                    self.variables[dim][name][self.written[dim] : end] = joined
            self.written[dim] = end
        self._empty()
