"""Captions of the figures, and sentences that count missing runs and runs that are drawn pale."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from icha.datasets.labels import LABELS, slopes_of
from icha.datasets.variables.model_error import FINITE_RANGE, SHORT_RANGE

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


@cache
def _texts() -> dict[str, str]:
    file = Path(__file__).with_name("captions.toml")
    return {name: " ".join(text.split()) for name, text in tomllib.loads(file.read_text(encoding="utf-8")).items()}


# A text of a caption that depends on what the figure shows, such as `[bare: Open shapes are …]`.
_CONDITIONAL = re.compile(r"\[([^\]:]+): (.*?)\] ?")


def caption_of(name: str, shown: str) -> str:
    """Return the caption of a figure; `shown` are lines that tell what the figure shows, from `texts_of`."""

    def choose(found):
        return f"{found[2]} " if re.search(found[1], shown, re.MULTILINE) else ""

    return _CONDITIONAL.sub(choose, _texts()[name].format_map(_texts())).strip()


def texts_of(figure: Figure, data: Mapping[str, object], studies: Sequence[str]) -> str:
    """Return all texts of a figure, and words for what no text of a figure tells, as lines.

    Words are the names of the `data`, and words for the `studies` that are shown: materials that are `bare`, `adhesive`
    or `with and without adhesion`; `several surfaces`, `several slopes`, `bare at several slopes`, `adhesive at several
    slopes`, `one seed`, `periodic` surfaces; boundary elements with which the model was compared, `in the limit` or `at
    finite range`.
    """
    from matplotlib.text import Text

    words = [*data, *(text.get_text() for text in figure.findobj(Text))]
    campaign = data["campaign"].children if "campaign" in data else {}
    for study in (campaign[name].to_dataset() for name in studies if name in campaign):
        bare, adhesive = (study["surface_energy"] == 0).any(), (study["surface_energy"] > 0).any()
        several_slopes = len(slopes_of(study)) > 1
        conditions = {
            "bare": bare,
            "adhesive": adhesive,
            "with and without adhesion": bare and adhesive,
            "several surfaces": study.sizes["surface"] > 1,
            "several slopes": several_slopes,
            "bare at several slopes": bare and several_slopes,
            "adhesive at several slopes": adhesive and several_slopes,
            "one seed": study.sizes["seed"] == 1,
            "periodic": (study["boundary"] == "periodic").any(),
        }
        words += [word for word, holds in conditions.items() if holds]
    compared = data["model_error"].children.values() if "model_error" in data else ()
    truths = {node.attrs.get("truth") for node in compared if node.attrs.get("study") in studies}
    words += ["in the limit"] if SHORT_RANGE in truths else []
    return "\n".join(words + (["at finite range"] if FINITE_RANGE in truths else []))


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
