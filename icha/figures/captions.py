"""Captions of the figures: their text, and the runs that a figure lacks or draws apart, counted in the dataset."""

from __future__ import annotations

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
    """Return what a figure shows, for those who look at it."""
    return _texts()[name].format_map(_texts())


def count_runs(campaign: xr.DataTree, studies: Sequence[str]) -> str:
    """Count the runs of some studies that a figure of their means lacks, and those that it marks as not applicable.

    Returns
    -------
    Sentences for the end of a caption; "" where all runs are complete and the asperity model is applicable to them.
    """
    found: list[str] = []
    for name in studies:
        if name in campaign.children:
            study, several = campaign[name].to_dataset(), f" of study {name}" if len(studies) > 1 else ""
            found += [*_missing_runs(study, several), *_runs_not_applicable(study, several)]
    return " ".join(found)


def _missing_runs(study: xr.Dataset, several: str) -> Iterator[str]:
    """Count by model and material the runs that did not complete or whose checks failed."""
    from icha.datasets.variables.campaign import COMPUTED_RUNS, FAILED_CHECKS, INCOMPLETE, MISSING

    status = study["status"].transpose("model", "material", ...)
    seeds = "seeds" if status.sizes["surface"] == status.sizes["rms_slope"] == 1 else "runs"
    for model in study["model"].values.tolist():
        for material in study["material"].values.tolist():
            own = status.sel(model=model, material=material).values
            asked = int(np.isin(own, (*COMPUTED_RUNS, MISSING)).sum())
            ended, checks = int(np.isin(own, (INCOMPLETE, MISSING)).sum()), int((own == FAILED_CHECKS).sum())
            parts = [f"{ended} of {asked} {seeds} of material {material} did not complete"] if ended else []
            if checks:
                parts.append(f"{checks} of {asked} {seeds} of material {material} failed their checks")
            if parts:
                by = "" if model == DEFAULT_MODEL else f" by {MODELS[model].words}"
                yield f"{' and '.join(parts)}{several}{by}: see Failed runs."


def _runs_not_applicable(study: xr.Dataset, several: str) -> Iterator[str]:
    """Count the complete runs that the asperity model is not applicable to, by reason."""
    from icha.datasets.variables.campaign import COMPLETE

    if "applicability" not in study:  # which campaigns of earlier versions lack
        return
    complete = study["status"].transpose(*LABELS).values == COMPLETE
    reasons = study["applicability"].transpose(*LABELS).values[complete].tolist()
    for reason, count in Counter(map(str, reasons)).items():
        if reason:
            runs = "run is" if count == 1 else "runs are"
            yield f"{count} {runs} marked{several}: {reason}."
