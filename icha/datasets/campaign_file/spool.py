"""Runs as they come: what is needed of all is noted, their values go to a temporary file."""

import os
import pickle
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import BinaryIO, NamedTuple

import numpy as np
import xarray as xr

from icha.datasets.labels import RunLabels
from icha.datasets.netcdf import characters, is_refused, is_text, not_finite
from icha.datasets.run_values import Values, read_run_values
from icha.datasets.variables.run import CELLS, RUN


class Entry(NamedTuple):
    """What is kept in memory of one run: what it is called and has, and where its values are in the spool."""

    labels: RunLabels
    place: int
    names: frozenset[str]
    sizes: tuple[tuple[str, int], ...]
    snapshots: tuple[tuple[bytes, float], ...]
    failure: str
    failed_checks: str
    applicability: str

    def size(self, dim: str) -> int:
        """Size of a dimension of the run, 0 if it has none of that name."""
        return dict(self.sizes).get(dim, 0)


@dataclass
class Members:
    """The runs of a study as they come, the widths of their texts in bytes.

    samples, ranks : of every model a run that shows what its runs have, and how well it does.
    """

    entries: dict[RunLabels, Entry] = field(default_factory=dict)
    widths: dict[str, int] = field(default_factory=dict)
    samples: dict[str, xr.Dataset | str | os.PathLike] = field(default_factory=dict)
    ranks: dict[str, tuple] = field(default_factory=dict)


def spooled(
    runs: Iterable[tuple[RunLabels | tuple, xr.Dataset | str | os.PathLike]],
    spool: BinaryIO,
    settings: Mapping[RunLabels | tuple, str] = {},
) -> dict[str, Members]:
    """Note of every run what is needed of all, by study, and put its values into the spool.

    Raises
    ------
    ValueError
        Naming the run: if it is given twice, has other labels than its dataset, was computed with other settings than
        it should, or holds a value that is not finite; if there is none.
    """
    studies: dict[str, Members] = {}
    # Most runs have the same variables, sizes and snapshots, which are then kept once.
    shared: dict = {}
    for labels, source in runs:
        labels = plain(labels)
        members = studies.setdefault(labels.study, Members())
        if labels in members.entries:
            raise ValueError(f"{labels}: this run is given twice")
        values, attrs = _values_of(source) if isinstance(source, xr.Dataset) else read_run_values(source, CELLS)
        _check_labels(labels, values, attrs)
        if attrs.get("config_sha256") != settings.get(labels, attrs.get("config_sha256")):
            file = labels if isinstance(source, xr.Dataset) else source
            raise ValueError(
                f"{file}: this run was computed with other settings than are asked for; remove it and give the same "
                "command again, which computes it"
            )
        _refuse_values_not_finite(labels, values)
        sizes = {dim: n for dims, v in values.values() for dim, n in zip(dims, v.shape, strict=False)}
        alike = frozenset(values), tuple(sorted(sizes.items())), _snapshots(values)
        alike = (shared.setdefault(each, each) for each in alike)
        members.entries[labels] = Entry(
            labels,
            spool.tell(),
            *alike,
            _failure(values, attrs),
            str(attrs.get("failed_checks", "")),
            str(attrs.get("applicability", "")),
        )
        pickle.dump(values, spool, protocol=5)
        for name, (_, v) in values.items():
            if is_text(v.dtype):
                members.widths[name] = max(members.widths.get(name, 1), v.shape[-1])
        # Of a run that ended early some variables may be unknown: what it would have reached at the end.
        rank = ("incomplete" not in attrs, sizes.get("step", 0))
        if rank > members.ranks.get(labels.model, ()):
            members.samples[labels.model], members.ranks[labels.model] = source, rank
    if not studies:
        raise ValueError("a campaign dataset needs at least one run")
    return studies


def values_back(entry: Entry, spool: BinaryIO) -> Values:
    """Values of a run from the spool."""
    spool.seek(entry.place)
    return pickle.load(spool)


def plain(labels: RunLabels | tuple) -> RunLabels:
    """Labels with numbers of Python's own types."""
    labels = RunLabels(*labels)
    return labels._replace(seed=int(labels.seed), rms_slope=float(labels.rms_slope))


def _values_of(run: xr.Dataset) -> tuple[Values, dict]:
    """What `icha.datasets.run_values.read_run_values` gives of a run's file, of the run itself."""
    values = {
        name: (variable.dims, characters(variable.values) if is_text(variable.dtype) else variable.values)
        for name, variable in run.drop_dims(CELLS, errors="ignore").variables.items()
    }
    return values, run.attrs


def _failure(values, attrs) -> str:
    """Why a run did not reach its end; an empty text if it did."""
    if "incomplete" in attrs:
        return str(attrs["incomplete"])
    failed = int(np.sum(values["converged"][1] != 1)) if "converged" in values else 0
    return f"{failed} of its steps did not converge" if failed else ""


def _check_labels(labels, values, attrs):
    if attrs.get("contact_model", labels.model) != labels.model:
        raise ValueError(f"{labels}: the dataset's model is {attrs['contact_model']}")
    for label, tolerance in (("rms_slope", 1e-6), ("seed", 0)):
        if label in values:
            value, named = float(values[label][1]), float(getattr(labels, label))
            if abs(value - named) > tolerance * abs(named):
                raise ValueError(f"{labels}: the dataset's {label} is {value:g}")


def _refuse_values_not_finite(labels, values):
    for name, (dims, v) in values.items():
        if v.dtype.kind != "f" or np.isfinite(v).all():
            continue
        bad = is_refused(v, RUN[name].further if name in RUN else {})
        if bad.any():
            raise ValueError(f"{labels}: variable {not_finite(name, dims, bad)}")


def _snapshots(values):
    """Kind and target of a run's snapshots."""
    if "snapshot_kind" not in values:
        return ()
    kinds = values["snapshot_kind"][1]
    return tuple(
        zip((kind.tobytes().rstrip(b"\0") for kind in kinds), values["snapshot_target"][1].tolist(), strict=True)
    )
