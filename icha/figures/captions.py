"""Captions of the figures, and sentences that count missing runs and runs that are drawn pale."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from icha.datasets.labels import LABELS

if TYPE_CHECKING:
    import xarray as xr


@cache
def _texts() -> dict[str, str]:
    file = Path(__file__).with_name("captions.toml")
    return {name: " ".join(text.split()) for name, text in tomllib.loads(file.read_text(encoding="utf-8")).items()}


def caption_of(name: str) -> str:
    """Return the caption of a figure."""
    return _texts()[name].format_map(_texts())


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
