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

from icha.contact.attraction import FINITE_RANGE, SHORT_RANGE
from icha.contact.models import MODELS
from icha.datasets.labels import LABELS, slopes_of
from icha.figures.select import has_shape, lacks_fit, lacks_sphere

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@cache
def _texts() -> dict[str, str]:
    file = Path(__file__).with_name("captions.toml")
    return {name: " ".join(text.split()) for name, text in tomllib.loads(file.read_text(encoding="utf-8")).items()}


# A text of a caption that depends on what the figure shows, such as `[bare: Open shapes are …]`.
_CONDITIONAL = re.compile(r"\[([^\]:]+): (.*?)\] ?")


def caption_of(name: str, shown: str, grid: str = "") -> str:
    """Return the caption of a figure.

    Parameters
    ----------
    name : name of the figure.
    shown : lines that tell what the figure shows, from `texts_of`.
    grid : sentence on the error of loops due to the grid, from `sentence_on_loops`; only captions of loops contain it.
    """

    def choose(found):
        return f"{found[2]} " if re.search(found[1], shown, re.MULTILINE) else ""

    return _CONDITIONAL.sub(
        choose, f"{_texts()[name]} {{units_of_shapes}}".format_map(_texts() | {"grid_of_loops": grid})
    ).strip()


def texts_of(figure: Figure, data: Mapping[str, object], studies: Sequence[str]) -> str:
    """Return all texts of a figure, and words for what no text of a figure tells, as lines.

    Words are the names of the `data`, and words for the `studies` that are shown: materials that are `bare`, `adhesive`
    or `with and without adhesion`; `several surfaces`, `several slopes`, `bare at several slopes`, `adhesive at several
    slopes`, `one seed`, `periodic` surfaces, `units of a shape`, `first surface with a shape`, runs `without a sphere`
    or `without a fit` of JKR; boundary elements `in the limit`, `at finite range` or of `both ranges`. Texts name `both
    models`, or `only` one model.
    """
    from matplotlib.text import Text

    words = [*data, *(text.get_text() for text in figure.findobj(Text))]
    has_units = any(r"\mathrm{rms}" in word for word in words)
    models = [model.words for model in MODELS.values() if any(word.startswith(model.words) for word in words)]
    words += ["both models"] if len(models) > 1 else [f"only {model}" for model in models]
    campaign = data["campaign"].children if "campaign" in data else {}
    attractions: set[str] = set()
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
            "units of a shape": has_units and has_shape(study),
            "periodic": (study["boundary"] == "periodic").any(),
            "first surface with a shape": has_shape(study.isel(surface=0)),
            "without a sphere": lacks_sphere(study),
            "without a fit": lacks_fit(study),
        }
        words += [word for word, holds in conditions.items() if holds]
        attractions.update(study["attraction"].values.ravel() if "attraction" in study else ())
    ranges = {"in the limit": SHORT_RANGE, "at finite range": FINITE_RANGE}
    present = [word for word, attraction in ranges.items() if attraction in attractions]
    return "\n".join(words + (["both ranges"] if len(present) > 1 else present))


def sentence_on_measurements(measurements: Sequence[Mapping[str, object]]) -> str:
    """Return a sentence with label and citation of each measurement in a figure; "" without measurements."""
    named = "; ".join(f"{each['label']} ({each['citation']})" for each in measurements)
    return f"Lines without markers are measurements: {named}." if named else ""


def sentence_on_loops(data: Mapping[str, object], studies: Sequence[str]) -> str:
    """Return a sentence on the error of loops by boundary elements due to the grid; "" without such loops."""
    from icha.analysis.grid_error import cells_of_loops, describe_loops

    loops = cells_of_loops(data["campaign"], studies) if "campaign" in data else {}
    return f"Grid: {describe_loops(loops)}." if loops else ""


def count_runs(data: Mapping[str, object], studies: Sequence[str], shown: str = "") -> str:
    """Count the runs that a figure leaves out or draws pale, in sentences for the end of its caption; often empty.

    Parameters
    ----------
    data : datasets of the figure, by name.
    studies : names of the studies whose runs the figure shows.
    shown : lines that tell what the figure shows, from `texts_of`.
    """
    from icha.analysis.left_out import absent_materials, left_out_of_study
    from icha.analysis.sensitivity import left_out_of_samples
    from icha.datasets.variables.campaign import LOADED_RUNS

    found: list[str] = []
    for name in studies:
        if name in getattr(data.get("sensitivity"), "children", ()):
            found += [f"{line}." for line in left_out_of_samples(data["sensitivity"][name].to_dataset())]
        if name not in getattr(data.get("campaign"), "children", ()):
            continue
        study, suffix = data["campaign"][name].to_dataset(), f" in study {name}" if len(studies) > 1 else ""
        left_out = left_out_of_study(study, of_loss="loss" in shown)
        if left_out.words:
            biased = "; the others are a biased selection" if left_out.biased else ""
            found.append(
                f"The figure shows {left_out.words}{suffix}{biased}. Means over too few of the requested seeds have no "
                "intervals. The report lists the reasons."
            )
        found += [f"Without a curve{suffix}: {each}." for each in absent_materials(study)]
        if "applicability" in study:  # not in campaigns of earlier versions
            status = study["status"].transpose(*LABELS).values
            reasons = study["applicability"].transpose(*LABELS).values[np.isin(status, LOADED_RUNS)]
            for reason, count in Counter(filter(None, map(str, reasons))).items():
                found.append(f"Note on {count} {'run' if count == 1 else 'runs'}{suffix}: {reason}.")
    return " ".join(found)
