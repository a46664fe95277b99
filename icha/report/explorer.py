"""A page for moving along the paths of a campaign: one HTML file that needs neither network nor other files.

It holds the library that draws, plotly.js, and what its own short script (`templates/explorer.js`) shows of every
contact. The same results and choices give the same bytes.
"""

from __future__ import annotations

import base64
import io
import json
import os
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from icha.contact.models import MODELS, model_of
from icha.datasets import results
from icha.datasets.attributes import why_no_result
from icha.datasets.campaign import find_snapshot, reduced_gap, run_labels, select_run, spots_of
from icha.datasets.files import read_campaign, read_dataset, readable
from icha.datasets.labels import RunLabels, path_fields
from icha.figures.fig3_distributions import gap_densities, joined_pressure_densities, pressure_densities
from icha.figures.fig8_patch_sizes import patch_areas, patch_density, patches_above
from icha.figures.maps import block_means
from icha.path.targets import BETWEEN
from icha.report.template import template
from icha.support.atomic_files import whole_file
from icha.support.formatting import format_count, printable_lines

# What one chooses a contact by, in this order.
CHOICES = ("study", "surface", "rms_slope", "material", "seed")


# Cells along an edge of a topography and of a map of contact, of which patches are finer than the topography.
MOST_HEIGHTS, MOST_CELLS = 256, 512
# Bins of the pressure with less than this part of the highest density are not shown: JKR's tail has no end.
LEAST_DENSITY = 1e-3
_LEVELS = 255


# Red, green and blue of contact, for spots and patches alike.
CONTACT_COLOUR = (230, 0, 13)


class NothingToExplore(ValueError):
    """There is nothing in a folder that a page could show; the message says why and what is allowed."""


class Written(NamedTuple):
    """What became of a page: bytes, contacts on it and those left out as it would be too large, or without a step."""

    size: int
    shown: int
    left_out: int
    without_steps: int


def write_explorer(
    folder: str | os.PathLike, page: str | os.PathLike, *, only: Mapping[str, Collection] = {}, largest: float
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
        ranked.append((rank[kind], sorted(runs, key=lambda run: list(MODELS).index(run.model))))
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
    file = folder / results.RUN.format(**path_fields(labels))
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
        left_out=left_out and format_count(left_out, "contact"),
        without_steps=without_steps and format_count(without_steps, "contact"),
    )


# --- what the page shows of a contact; arrays are the base64 text of their bytes ---


def floats(values: np.ndarray) -> str:
    """Numbers as the base64 text of their bytes, little-endian and in single precision."""
    return base64.b64encode(np.asarray(values, "<f4").tobytes()).decode("ascii")


def topography(surface: xr.Dataset) -> dict:
    """Heights of a surface file in units of its rms height: means over blocks of nodes, in 256 levels."""
    heights = surface["height"].transpose("y", "x").values / float(surface["rms_height"])
    shown = block_means(heights, MOST_HEIGHTS)
    low, high = float(shown.min()), float(shown.max())
    levels = np.rint((shown - low) / (high - low) * _LEVELS).astype(np.uint8)
    return {
        "grid": len(heights),
        "cells": len(shown),
        "low": low,
        "high": high,
        "levels": base64.b64encode(levels.tobytes()).decode("ascii"),
    }


def run_entry(run: xr.Dataset, maps: Sequence[str] | None) -> dict:
    """The curves of a run and its snapshots.

    Parameters
    ----------
    run : a run as in a campaign dataset, with at least one step.
    maps : of boundary elements, the `picture` of every snapshot; None of asperities, whose spots are in the run, and
        where the file with the maps is not there.
    """
    kinds, targets = run["step_kind"].values.astype(str), run["step_target"].values
    return {
        "failure": why_no_result(run.attrs),
        "period": float(run["period"]),
        "periodic": str(run["boundary"].values) == "periodic",
        "grid": int(run["grid"]),
        "rms_height": float(run["rms_height"]),
        "pressure": floats(run["reduced_pressure"]),
        "area": floats(run["contact_area_fraction"]),
        "gap": floats(reduced_gap(run)),
        "spots": run["spot_count"].values.tolist(),
        "leg": run["leg"].values.tolist(),
        "stops": [
            None if kind == BETWEEN else f"{kind} {target:.6g}" for kind, target in zip(kinds, targets, strict=True)
        ],
        "snapshots": [_snapshot(run, k, maps) for k in range(run.sizes["snapshot"])],
    }


def _snapshot(run, at, maps):
    """Spots or patches of a snapshot, and the distributions that figures 3 and 8 show."""
    step = int(run["snapshot_step"].values[at])
    cell = float(run["period"]) ** 2
    areas = [patch_areas(run, at)]
    found = {
        "step": step,
        "gap": _points(gap_densities([(run, at)])),
        "pressure": _pressures(run, at),
        "sizes": _points(patch_density(areas, cell)),
        "larger": _points(patches_above(areas, cell)),
    }
    if maps is not None:
        return found | {"map": maps[at]}
    if model_of(run.attrs).by_cells:
        return found
    spots = spots_of(run, at)
    return found | {"circles": [floats(spots[f"spot_{name}"]) for name in ("x", "y", "radius")]}


def _points(curve):
    """Points of the curve of a single run."""
    x, (y,) = curve
    return [floats(x), floats(y)]


def _pressures(run, at):
    """Points of the density of the pressure, without its thinnest tail; bins of few nodes are joined."""
    densities = joined_pressure_densities if model_of(run.attrs).by_cells else pressure_densities
    pressure, (density,) = densities([(run, at)])
    shown = density > LEAST_DENSITY * density.max(initial=0)
    return [floats(pressure[shown]), floats(density[shown])]


def picture(contact: np.ndarray) -> str:
    """A map of contact as a PNG in base64, its first row at the bottom: the part of a cell in contact as its opacity.

    contact : (n, n), from 0 to 1, along y and x.
    """
    from PIL import Image

    part = block_means(np.asarray(contact, float), MOST_CELLS)[::-1]
    levels = np.rint(part * _LEVELS).astype(np.uint8)
    image = Image.frombytes("P", levels.shape, levels.tobytes())
    image.putpalette(CONTACT_COLOUR * (_LEVELS + 1))
    file = io.BytesIO()
    image.save(file, "PNG", transparency=bytes(range(_LEVELS + 1)))
    return base64.b64encode(file.getvalue()).decode("ascii")


def partners(one: Mapping, other: Mapping) -> list[int]:
    """For every step of a run the step of another at the same state of the path, or -1 where it has none.

    A stop is the one on the same leg that was asked for; an equilibrium between stops has for its partner the one on
    the same leg at the nearest mean separation.

    Parameters
    ----------
    one, other : runs, of which `step_kind`, `step_target`, `leg` and `mean_separation` are used.
    """
    kinds, others = ([str(kind) for kind in run["step_kind"].values] for run in (one, other))
    asked = zip(other["leg"].values.tolist(), others, other["step_target"].values.tolist(), strict=True)
    stops = {stop: k for k, stop in enumerate(asked) if stop[1] != BETWEEN}
    legs, separations = other["leg"].values, other["mean_separation"].values
    found = []
    for k, (leg, kind, target) in enumerate(
        zip(one["leg"].values.tolist(), kinds, one["step_target"].values.tolist(), strict=True)
    ):
        same = np.flatnonzero(legs == leg)
        if kind != BETWEEN:
            found.append(stops.get((leg, kind, target), -1))
        elif len(same):
            distance = np.abs(separations[same] - float(one["mean_separation"].values[k]))
            found.append(int(same[np.argmin(distance)]))
        else:
            found.append(-1)
    return found
