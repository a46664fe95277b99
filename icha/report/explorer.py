"""A page for moving along the paths of a campaign: one HTML file that needs neither network nor other files.

It holds the library that draws, plotly.js, and what its own short script (`templates/explorer.js`) shows of every
contact. The same results and choices give the same bytes.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from icha.contact.models import MODELS
from icha.datasets import results
from icha.datasets.campaign import find_snapshot, run_labels, select_run
from icha.datasets.files import read_campaign, read_dataset, readable
from icha.datasets.labels import RunLabels, parts
from icha.report.explorer_data import (
    CONTACT_COLOUR,
    LEAST_DENSITY,
    MOST_CELLS,
    MOST_HEIGHTS,
    partners,
    picture,
    run_entry,
    topography,
)
from icha.report.template import template
from icha.support.atomic_files import whole_file
from icha.support.in_words import counted, printable_lines

# What one chooses a contact by, in this order.
CHOICES = ("study", "surface", "rms_slope", "material", "seed")


class NothingToExplore(ValueError):
    """There is nothing in a folder that a page could show; the message says why and what is allowed."""


class Written(NamedTuple):
    """What became of a page: bytes, contacts on it and those left out as it would be too large, or without a step."""

    size: int
    shown: int
    left_out: int
    without_steps: int


def write_explorer(
    folder: str | os.PathLike,
    page: str | os.PathLike,
    *,
    only: Mapping[str, Collection] = {},
    largest: float,
) -> Written:
    """Write the page of a campaign.

    Contacts with the first seed of each kind come first, so that where not all find room, some of each kind do.

    Parameters
    ----------
    folder : the campaign's results.
    page : the HTML file.
    only : names of studies, surfaces and materials, and seeds, that are shown, by `CHOICES`; those left out are all.
    largest : how large the page may be, MB.

    Raises
    ------
    NothingToExplore
        If there is no campaign dataset, nothing of what is asked for, or room for not even one contact.
    ValueError
        If a file cannot be read.
    """
    folder = Path(folder)
    campaign = read_campaign(_dataset(folder))
    contacts = _contacts(run_labels(campaign), only)
    library = _library()
    room = largest * 1e6 - len(library.encode()) - len(_filled(campaign, {}, library="", largest=largest))
    shown: list[dict] = []
    topographies: dict[str, dict] = {}
    without_steps = left_out = 0
    for number, runs in enumerate(contacts):
        entry = _contact(campaign, folder, runs)
        if entry is None:
            without_steps += 1
            continue
        name = results.SURFACE.format(surface=runs[0].surface, seed=runs[0].seed)
        new = {} if name in topographies else {name: topography(read_dataset(folder / name))}
        room -= len(json.dumps([entry, new]))
        if room < 0:
            left_out = len(contacts) - number
            break
        shown.append(entry | {"topography": name})
        topographies |= new
    if not shown:
        raise NothingToExplore(_why_nothing(left_out, largest))
    data = {"contacts": shown, "topographies": topographies}
    text = _filled(campaign, data, library=library, largest=largest, left_out=left_out, without_steps=without_steps)
    with whole_file(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Written(len(text.encode()), len(shown), left_out, without_steps)


def _dataset(folder: Path) -> Path:
    """The campaign dataset in a folder of results."""
    found = sorted(folder.glob(results.DATASET.format(campaign="*")))
    if len(found) != 1:
        there = f"{len(found)} campaign datasets" if found else "no campaign dataset"
        raise NothingToExplore(f"{folder}: has {there} in dataset/; allowed: the results of one campaign")
    return found[0]


def _contacts(labels: list[RunLabels], only: Mapping[str, Collection]) -> list[list[RunLabels]]:
    """The runs of every contact, one for each model; contacts with the first seed of each kind come first."""
    for name, wanted in only.items():
        there = list(dict.fromkeys(getattr(each, name) for each in labels))
        if unknown := [value for value in wanted if value not in there]:
            raise NothingToExplore(f"{name} {unknown[0]}: there is none; allowed: {', '.join(map(str, there))}")
    contacts: dict[tuple, list[RunLabels]] = {}
    for each in labels:
        if all(getattr(each, name) in wanted for name, wanted in only.items()):
            contacts.setdefault(each._replace(model=""), []).append(each)
    rank: dict[tuple, int] = {}
    ranked = []
    for contact, runs in contacts.items():
        kind = contact._replace(seed=0)
        rank[kind] = rank.get(kind, -1) + 1
        ranked.append((rank[kind], sorted(runs, key=lambda run: MODELS.index(run.model))))
    return [runs for _, runs in sorted(ranked, key=lambda pair: pair[0])]


def _contact(campaign: xr.DataTree, folder: Path, labels: list[RunLabels]) -> dict | None:
    """What the page shows of a contact by all models; None where no run came as far as to a first stop."""
    runs = {each.model: select_run(campaign, each) for each in labels}
    runs = {model: run for model, run in runs.items() if run.sizes["step"]}
    if not runs:
        return None
    entries = {
        each.model: run_entry(runs[each.model], _maps(folder, each, runs[each.model]))
        for each in labels
        if each.model in runs
    }
    first, *others = runs
    for other in others:
        entries[other]["partners"] = partners(runs[first], runs[other])
    return {name: getattr(labels[0], name) for name in CHOICES} | {"runs": entries}


def _maps(folder, labels, run):
    """Pictures of the contact by boundary elements at every snapshot of a run; None without its file.

    Maps are in the file of the run only, which may have its snapshots in another order than the campaign.
    """
    file = folder / results.RUN.format(**parts(labels))
    if not MODELS[labels.model].by_cells or not file.is_file():
        return None
    with readable(file), xr.open_dataset(file, engine="netcdf4") as own:
        states = zip(run["snapshot_kind"].values.astype(str), run["snapshot_target"].values, strict=True)
        return [picture(own["contact_map"][find_snapshot(own, *state)].values) for state in states]


def _why_nothing(left_out, largest):
    if left_out:
        return f"not even one contact finds room on a page of {largest:g} MB; allowed: a larger page"
    return "no run came as far as to a first stop, so there is nothing to show"


def _library() -> str:
    from plotly.offline import get_plotlyjs

    return get_plotlyjs()


def _printable(data):
    """The same data; their texts are fit for a page, and so are the names by which others find them."""
    if isinstance(data, dict):
        return {_printable(name): _printable(value) for name, value in data.items()}
    if isinstance(data, list):
        return [_printable(value) for value in data]
    return printable_lines(data) if isinstance(data, str) else data


def _filled(campaign, data, *, library, largest, left_out=0, without_steps=0) -> str:
    """The page as text."""
    return template("explorer.html").render(
        title=campaign.attrs.get("title", "Rough contact campaign"),
        campaign=campaign.attrs.get("campaign", ""),
        data=_printable(data),
        library=library,
        colour=f"rgb{CONTACT_COLOUR}",
        choices=CHOICES,
        most_heights=MOST_HEIGHTS,
        most_cells=MOST_CELLS,
        least_density=LEAST_DENSITY,
        largest=largest,
        left_out=left_out and counted(left_out, "contact"),
        without_steps=without_steps and counted(without_steps, "contact"),
    )
