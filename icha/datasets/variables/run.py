"""Descriptions of the variables in the dataset of a run."""

import numpy as np

from icha.asperity.full_contact import MEANING
from icha.contact.model import EVENT_KINDS
from icha.contact.models import MODELS
from icha.datasets.variables.terms import INFINITE, TERMS, Variable, read_tables

# Dimensions of the cells of the surface's grid: rows along y, columns along x.
CELLS = ("row", "column")


def _index_of(dim: str) -> dict[str, str]:
    """Return the attributes of an index variable of an indexed ragged array (CF 1.11, section 9.3.4).

    The index variable gives the snapshot of each spot, or the step of each event. The CF attribute `featureType` is
    left out, because this attribute requires times and places on earth.
    """
    return {
        "instance_dimension": dim,
        "comment": "index of a ragged array: positions along instance_dimension, from 0",
    }


_SUM = {
    "comment": "where uphill_jump_in_count is not 0, only the sum of loss_by_jump_in and loss_by_jump_off has a meaning"
}
_ATTRIBUTES = {
    "spot_snapshot": _index_of("snapshot"),
    "full_contact_energy_ratio": {INFINITE: "without adhesion"},
    "contact_stiffness": {INFINITE: "in full contact"},
    "stiffness": {INFINITE: "in full contact"},
    "short_wavelength": {INFINITE: "on a smooth shape without waves"},
    "tabor_parameter": {INFINITE: "on a smooth shape without a radius of curvature"},
    "pull_off_over_summits": {INFINITE: "on a surface without summits"},
    "slope_anisotropy": {INFINITE: "for straight grooves"},
    "gap_map": {INFINITE: "where a shape has no surface"},
    "event_kind": {
        "flag_values": np.arange(len(EVENT_KINDS), dtype=np.int8),
        "flag_meanings": " ".join(EVENT_KINDS),
    },
    "event_step": _index_of("step"),
    "loss_by_jump_in": _SUM,
    "loss_by_jump_off": _SUM,
}
# Variables of every run, of runs whose path continues after the first loading, of runs that end in separation, of runs
# on a free square, of runs on a layer, and of runs with a map of works of adhesion. Not every run on a free square has
# all variables of INDENTER.
RUN, CYCLE, LOOP, INDENTER, LAYER, ADHESION_MAP = read_tables("run.txt", TERMS, _ATTRIBUTES, meaning=MEANING).values()
# Variables that only some runs of a study have.
OF_SOME = INDENTER | LAYER | ADHESION_MAP
# Coordinates of the cells in maps.
_PLACES = {axis: TERMS[axis]._replace(dims=(dim,), coordinate=True) for axis, dim in zip("yx", CELLS, strict=True)}
# Variables of the hysteresis loss, which are not valid if a run fails a check of its energies.
OF_LOSS = frozenset(name for name in LOOP | INDENTER if "loss" in name.split("_"))
# Variables that only runs with a certain model have, by name of the model.
FURTHER = {
    name: (_PLACES if model.by_cells else {})
    | {
        key: Variable(*facts, np.dtype(dtype).type, _ATTRIBUTES.get(key, {}))
        for key, (*facts, dtype) in model.variables.items()
    }
    for name, model in MODELS.items()
}
OF_MODELS = {key: description for table in FURTHER.values() for key, description in table.items()}
