"""Variables of the dataset of a run."""

import numpy as np

from icha.asperity.full_contact import MEANING
from icha.contact.model import EVENT_KINDS
from icha.contact.models import MODELS
from icha.datasets.variables.terms import INFINITE, TERMS, Variable, read_tables

# The cells of the surface's grid: rows along y, columns along x.
CELLS = ("row", "column")


def _index_of(dim: str) -> dict[str, str]:
    """Return the attributes of an index of CF's indexed ragged arrays (CF 1.11, section 9.3.4).

    Spots and events follow each other; the index gives the snapshot or step of each. The attribute `featureType` of CF
    is left out, because it requires times and places on earth.
    """
    return {
        "instance_dimension": dim,
        "comment": "index of a ragged array: positions along instance_dimension, from 0",
    }


_SUM = {"comment": "where uphill_jump_in_count is not 0, only the sum with the other kind of jump has a meaning"}
_ATTRIBUTES = {
    "spot_snapshot": _index_of("snapshot"),
    "full_contact_energy_ratio": {INFINITE: "without adhesion"},
    "contact_stiffness": {INFINITE: "in full contact"},
    "slope_anisotropy": {INFINITE: "for straight grooves"},
    "event_kind": {
        "flag_values": np.arange(len(EVENT_KINDS), dtype=np.int8),
        "flag_meanings": " ".join(EVENT_KINDS),
    },
    "event_step": _index_of("step"),
    "loss_by_jump_in": _SUM,
    "loss_by_jump_off": _SUM,
}
# Variables of every run, of those whose path continues after the first loading, and of those that end in separation.
RUN, CYCLE, LOOP = read_tables("run.txt", TERMS, _ATTRIBUTES, meaning=MEANING).values()
# Further variables of the runs of a model.
FURTHER = {
    name: {key: Variable(*facts, np.dtype(dtype).type) for key, (*facts, dtype) in model.variables.items()}
    for name, model in MODELS.items()
}
OF_MODELS = {key: description for table in FURTHER.values() for key, description in table.items()}
