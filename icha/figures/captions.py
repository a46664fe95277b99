"""Captions of the figures, and sentences that count missing runs and runs that are drawn pale."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Collection, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.datasets.labels import LABELS
from icha.datasets.variables.model_error import FINITE_RANGE
from icha.figures.ensembles import MOST_SCATTERED
from icha.support.statistics import ENOUGH

if TYPE_CHECKING:
    import xarray as xr


@cache
def _texts() -> dict[str, str]:
    file = Path(__file__).with_name("captions.toml")
    return {name: " ".join(text.split()) for name, text in tomllib.loads(file.read_text(encoding="utf-8")).items()}


# A text of a caption that depends on the contents of the figure, such as `[bare: Open shapes are …]`.
_CONDITIONAL = re.compile(r"\[(\w+): (.*?)\] ?")


def caption_of(name: str, contents: Collection[str] | None = None) -> str:
    """Return the caption of a figure with these `contents` (`contents_of`); None stands for all contents."""
    text = _texts()[name].format_map(_texts())

    def choose(found):
        return f"{found[2]} " if contents is None or found[1] in contents else ""

    return _CONDITIONAL.sub(choose, text).strip()


def contents_of(
    campaign: xr.DataTree, studies: Sequence[str], model_error: xr.DataTree | None = None, units: str = "reduced"
) -> set[str]:
    """Return the contents of a figure of some studies in `units`, as captions name them.

    Contents are the units; `asperities`; boundary elements `alone`; `seeds` (several), `few` (2 to 4) and `many` (5 or
    more) seeds; materials without (`bare`) and with adhesion (`adhesive`); `free` squares; several `surfaces`;
    `unloading`; boundary elements beside asperities in the limit of a short range (`truth`) and at a `finite` range,
    also in `loops`; an `estimate` of contact with adhesion from boundary elements without adhesion.
    """
    found = {units}
    shown = [campaign[name].to_dataset() for name in studies if name in campaign.children]
    for study in shown:
        seeds, energy = study.sizes["seed"], study["surface_energy"].values
        curves = study.sizes["surface"] * study.sizes["rms_slope"] * study.sizes["material"]
        conditions = {
            "seeds": seeds > 1,
            "few": 1 < seeds < ENOUGH and curves <= MOST_SCATTERED,
            "many": seeds >= ENOUGH,
            "bare": (energy == 0).any(),
            "adhesive": (energy > 0).any(),
            "free": (study["boundary"] == "free").any(),
            "surfaces": study.sizes["surface"] > 1,
            "unloading": study["leg"].max() > 0,
        }
        found |= {name for name, holds in conditions.items() if holds}
    models = {model for study in shown for model in study["model"].values.tolist()}
    found |= {"asperities"} if DEFAULT_MODEL in models else {"alone"}
    found |= {"truth"} if REFERENCE_MODEL in models and len(models) > 1 else set()
    found |= {"estimate"} if {"bare", "adhesive", "reduced", "truth"} <= found else set()
    entries = [] if model_error is None else [node.attrs for node in model_error.children.values()]
    finite = any(entry.get("truth") == FINITE_RANGE and entry.get("study") in studies for entry in entries)
    return found | ({"finite", "loops"} if finite else set())


def count_runs(campaign: xr.DataTree, studies: Sequence[str]) -> str:
    """Count the missing runs and the runs that are drawn pale, in sentences for the end of a caption.

    The text is empty if no run is missing and no run is drawn pale.
    """
    from icha.datasets.variables.campaign import COMPLETE, COMPUTED_RUNS, FAILED_CHECKS, INCOMPLETE, MISSING

    found: list[str] = []
    for name in studies:
        if name not in campaign.children:
            continue
        study, suffix = campaign[name].to_dataset(), f" of study {name}" if len(studies) > 1 else ""
        status = study["status"].transpose(*LABELS).values
        asked = np.count_nonzero(np.isin(status, (*COMPUTED_RUNS, MISSING)))
        for words, states in (("did not complete", (INCOMPLETE, MISSING)), ("failed their checks", (FAILED_CHECKS,))):
            if count := np.count_nonzero(np.isin(status, states)):
                found.append(f"{count} of {asked} runs{suffix} {words}; see the section Failed runs.")
        if "applicability" in study:  # not in campaigns of earlier versions
            reasons = study["applicability"].transpose(*LABELS).values[status == COMPLETE]
            for reason, count in Counter(filter(None, map(str, reasons))).items():
                found.append(f"Note on {count} {'run' if count == 1 else 'runs'}{suffix}: {reason}.")
    return " ".join(found)
