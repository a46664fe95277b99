"""The group of a study in the file: its dimensions, variables and attributes, and how they are stored."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import netCDF4
import numpy as np

from icha.datasets.attributes import COLLECTED, collected
from icha.datasets.campaign_file.arrangement import Arrangement
from icha.datasets.labels import LABELS
from icha.datasets.netcdf import (
    FLOAT_FILL,
    INTEGER_FILL,
    characters,
    coordinates_of,
    define_dimensions,
    define_numbers,
    define_text,
    is_text,
)
from icha.datasets.storage import COMPRESSION, LEAST_COMPRESSED
from icha.datasets.variables.campaign import CAMPAIGN, RAGGED, place_of
from icha.datasets.variables.run import FURTHER

# A block holds at most so many runs, and of each variable so many values: some megabytes of all together.
_RUNS_IN_BLOCK = 256
VALUES_IN_BLOCK = 2**18
_VALUES_IN_CHUNK = 2**16

_LAYOUT = (
    "Variables of the runs along model, surface, seed, rms_slope and material. Spots and events of all runs, in this "
    "order of the runs, are ragged arrays along spot and event: the variables with an instance_dimension say where "
    "along that dimension each belongs, from 0; those that agree in all of them are of one snapshot of one run."
)
_OWN_SLOPES = {"comment": "each surface has slopes of its own, along the dimension rms_slope in ascending order"}


class Column(NamedTuple):
    """A variable of the runs in the file: the labels it varies with, its own dimensions, what stands for no value."""

    variable: netCDF4.Variable
    along: tuple[str, ...]
    own: tuple[str, ...]
    fill: float | int | bytes

    def fitting(self, dims: tuple[str, ...], values: np.ndarray) -> np.ndarray:
        """A run's values with their dimensions in the order of the file's, texts of the file's width."""
        if dims != self.own:
            values = np.moveaxis(values, [dims.index(dim) for dim in self.own], range(len(self.own)))
        if values.dtype.kind == "S":
            whole = np.zeros((*values.shape[:-1], self.variable.shape[-1]), "S1")
            whole[..., : values.shape[-1]] = values
            return whole
        return values

    def places(self, snapshots: list[int], values: np.ndarray) -> tuple[list[int] | slice, ...]:
        """Where a run's values stand along the own dimensions; its snapshots are those at the positions given."""
        sizes = zip(self.own, values.shape, strict=False)
        return tuple(snapshots if dim == "snapshot" else slice(0, size) for dim, size in sizes)


@dataclass(frozen=True, eq=False)
class Group:
    """A study's group, defined and empty.

    study : what belongs there. block : how many neighbouring runs are written at once, along every label. columns : the
    variables of the runs. places : of what is ragged, by dimension and label, to which run it belongs. known :
    variables whose values need no run, with these. texts : reasons, by name, with what each of the study's runs has.
    """

    study: Arrangement
    block: tuple[int, ...]
    columns: dict[str, Column]
    places: dict[tuple[str, str], netCDF4.Variable]
    known: list[tuple[netCDF4.Variable, np.ndarray]]
    texts: list[tuple[netCDF4.Variable, list[str]]]


def define_group(group: netCDF4.Dataset, study: Arrangement, attrs: Mapping[str, str]) -> Group:
    """Make dimensions, variables and attributes of a study's group; `attrs` are those of the file."""
    sample = study.sample
    counts = {dim: int(study.sizes_of(dim).sum()) for dim in RAGGED if dim in sample.dims}
    sizes = dict(zip(LABELS, study.status.shape, strict=True)) | study.sizes | counts
    define_dimensions(group, sizes)
    own = {"study": study.name} | {name: sample.attrs[name] for name in ("license",) if name in sample.attrs}
    # Not the checksum of one of its runs.
    own |= {name: attrs[name] for name in ("config_sha256",) if name in attrs}
    group.setncatts(collected(f"Study {study.name}", _LAYOUT, COLLECTED, study.origins) | own)

    names = [name for name in sample.variables if name not in LABELS]
    dims = {name: sum(study.dims_of(name), ()) for name in names} | {label: (label,) for label in LABELS}
    dims |= {name: CAMPAIGN[name].dims for name in ("status", "step_count", "failure", "applicability")}
    dims |= {"rms_slope": study.slope_dims}
    coordinates = coordinates_of(sample.variables, {*sample.coords, *LABELS}, dims)
    storage = _Storage.of(study, sizes, names)
    columns = {}
    for name in names:
        if name not in sizes:
            attributes = (
                sample[name].attrs
                | _why_lacking(study, name)
                | ({"coordinates": coordinates[name]} if name in coordinates else {})
            )
            columns[name] = _define_column(group, study, storage, name, attributes)
    described = {
        name: CAMPAIGN[name].attributes | ({"coordinates": coordinates[name]} if name in coordinates else {})
        for name in CAMPAIGN
    }
    known = [*_define_numbers_along(group, study), *_define_of_campaign(group, study, storage, described)]
    texts = [
        (_define_reasons(group, storage, name, own, described[name]), own)
        for name, own in (
            ("failure", study.failures),
            ("applicability", [entry.applicability for entry in study.entries]),
        )
    ]
    places = {
        (dim, label): define_numbers(
            group, f"{dim}_{label}", (dim,), np.int32, place_of(dim, label).attributes, **storage.options((), (dim,))
        )
        for dim in counts
        for label in LABELS
    }
    return Group(study, storage.block, columns, places, known, texts)


@dataclass(frozen=True)
class _Storage:
    """How variables of a group are stored: sizes of its dimensions, and how many neighbouring runs make a block."""

    sizes: dict[str, int]
    block: tuple[int, ...]

    @classmethod
    def of(cls, study, sizes, names):
        varying = [own for along, own in map(study.dims_of, names) if along == LABELS]
        largest = max(math.prod(sizes[dim] for dim in own) for own in varying)
        return cls(sizes, _block(sizes, LABELS, largest))

    def options(self, along, own, width=None):
        """Options of a variable: none if it is small, else it is compressed, block by block."""
        shape = tuple(self.sizes[dim] for dim in own) + (() if width is None else (width,))
        if math.prod(self.sizes[dim] for dim in along) * math.prod(shape) < LEAST_COMPRESSED:
            return {}
        block = self.block if along == LABELS else _block(self.sizes, along, math.prod(shape))
        chunk = (*block, *shape) if along else tuple(min(size, _VALUES_IN_CHUNK) for size in shape)
        # A block is written at once: nothing is gained from keeping more than one.
        return COMPRESSION | {"chunksizes": chunk, "chunk_cache": 8 * math.prod(chunk)}


def _block(sizes, along, values):
    """How many neighbouring runs make a block, along every label; of each there are so many values."""
    left = max(1, min(_RUNS_IN_BLOCK, VALUES_IN_BLOCK // max(1, values)))
    block = []
    for size in reversed([sizes[label] for label in along]):
        block.append(min(size, left))
        left = left // size if block[-1] == size else 1
    return tuple(reversed(block))


def _why_lacking(study, name):
    """Attribute of a variable that some of the study's models do not have."""
    owners = [model for model, own in FURTHER.items() if name in own]
    lacking = [model for model in study.axes["model"] if owners and model not in owners]
    return {"missing": f"of runs by {' and '.join(lacking)}"} if lacking else {}


def _define_column(group, study, storage, name, attributes):
    """Make a variable of the runs."""
    along, own = study.dims_of(name)
    dtype = study.sample[name].dtype
    if is_text(dtype):
        width = study.widths[name]
        options = storage.options(along, own, width)
        return Column(define_text(group, name, along + own, width, attributes, **options), along, own, b"")
    options, lacks = storage.options(along, own), study.lacks(name)
    fill = FLOAT_FILL
    if dtype.kind != "f":
        # 32 bits, which every netCDF tool reads, or flags.
        dtype = np.dtype(np.int8 if dtype == np.int8 and not lacks else np.int32)
        fill = INTEGER_FILL if lacks else 0
    options |= {"fill_value": fill} if lacks else {}
    return Column(define_numbers(group, name, along + own, dtype, attributes, **options), along, own, fill)


def _define_reasons(group, storage, name, own, attributes):
    """Make a variable of texts, one for each run, as wide as the longest of its `own` texts."""
    width = max(1, *(len(text.encode()) for text in own))
    return define_text(group, name, LABELS, width, attributes, **storage.options(LABELS, (), width))


def _define_numbers_along(group, study):
    """Make the variables that number the positions along the dimensions of runs, and give them with their values."""
    for dim, size in study.sizes.items():
        if dim in study.sample.variables:
            variable = define_numbers(group, dim, (dim,), np.int32, study.sample[dim].attrs)
            yield variable, np.arange(size, dtype=np.int32)


def _define_of_campaign(group, study, storage, described):
    """Make the variables that say what runs there are, and give them with their values."""
    values = {"status": study.status, "step_count": study.step_count, **study.axes}
    for name, (dims, _, _, dtype, *_) in CAMPAIGN.items():
        if name in ("failure", "applicability"):
            continue
        attributes = described[name]
        if dtype is str:
            texts = characters(np.array(values[name]))
            yield define_text(group, name, dims, texts.shape[-1], attributes), texts
            continue
        numbers = np.asarray(values[name], dtype)
        options = storage.options(dims, ()) if dims == LABELS else {}
        if name == "rms_slope":
            dims = study.slope_dims
            attributes = attributes | (_OWN_SLOPES if len(dims) > 1 else {})
            if np.isnan(numbers).any():
                options |= {"fill_value": FLOAT_FILL}
                numbers = np.nan_to_num(numbers, nan=FLOAT_FILL)
        yield define_numbers(group, name, dims, numbers.dtype, attributes, **options), numbers
