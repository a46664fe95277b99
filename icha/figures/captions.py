"""Captions of the figures: their texts, and the numbers of runs that a figure lacks or marks."""

from __future__ import annotations

import itertools
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from icha.contact.models import DEFAULT_MODEL, MODELS
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
    """Count the runs of some studies that a figure of their means lacks, and those that it marks as not applicable.

    Returns
    -------
    Sentences for the end of a caption; "" if all runs are complete and the asperity model is applicable to them.
    """
    found: list[str] = []
    for name in studies:
        if name in campaign.children:
            study, suffix = campaign[name].to_dataset(), f" of study {name}" if len(studies) > 1 else ""
            found += [*_missing_runs(study, suffix), *_runs_not_applicable(study, suffix)]
    return " ".join(found)


def _missing_runs(study: xr.Dataset, suffix: str) -> Iterator[str]:
    """Count by model and material the runs that did not complete or whose checks failed."""
    from icha.datasets.variables.campaign import COMPUTED_RUNS, FAILED_CHECKS, INCOMPLETE, MISSING

    status = study["status"].transpose("model", "material", ...)
    unit = "seeds" if status.sizes["surface"] == status.sizes["rms_slope"] == 1 else "runs"
    for model, material in itertools.product(study["model"].values.tolist(), study["material"].values.tolist()):
        found = status.sel(model=model, material=material).values
        asked = int(np.isin(found, (*COMPUTED_RUNS, MISSING)).sum())
        counts = {"did not complete": (INCOMPLETE, MISSING), "failed their checks": (FAILED_CHECKS,)}
        words = [
            f"{count} of {asked} {unit} of material {material} {what}"
            for what, states in counts.items()
            if (count := int(np.isin(found, states).sum()))
        ]
        if words:
            by = "" if model == DEFAULT_MODEL else f" by {MODELS[model].words}"
            yield f"{' and '.join(words)}{suffix}{by}: see Failed runs."


def _runs_not_applicable(study: xr.Dataset, suffix: str) -> Iterator[str]:
    """Count by reason the complete runs to which the asperity model is not applicable."""
    from icha.datasets.variables.campaign import COMPLETE

    if "applicability" not in study:  # in campaigns of earlier versions
        return
    complete = study["status"].transpose(*LABELS).values == COMPLETE
    reasons = study["applicability"].transpose(*LABELS).values[complete].tolist()
    for reason, count in Counter(map(str, reasons)).items():
        if reason:
            yield f"{count} {'run is' if count == 1 else 'runs are'} marked{suffix}: {reason}."
