"""The page for exploring a campaign: one HTML file that needs neither network nor other files.

The page contains the library plotly.js, a short script (`templates/explorer.js`), and the data of every contact. The
same results and choices always give exactly the same file.
"""

from __future__ import annotations

import base64
import io
import itertools
import json
import os
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from icha.contact.models import MODELS, model_of
from icha.datasets import results
from icha.datasets.attributes import why_failed
from icha.datasets.campaign import find_snapshot, reduced_gap, run_labels, select_run, spots_of
from icha.datasets.files import read_campaign, read_dataset, readable
from icha.datasets.labels import RunLabels, path_fields
from icha.figures.fig3_distributions import gap_densities, pressure_densities
from icha.figures.fig8_patch_sizes import patch_areas, patch_density, patches_above
from icha.figures.maps import average_blocks
from icha.path.targets import BETWEEN
from icha.report.template import template
from icha.support.atomic_files import whole_file
from icha.support.formatting import format_count, printable_lines

# Labels that identify a contact, in the order of the lists on the page.
CHOICES = ("study", "surface", "rms_slope", "material", "seed")
# Largest numbers of cells along an edge of a topography and of a contact map. Contact maps have finer details.
MOST_HEIGHTS, MOST_CELLS = 256, 512
# The page omits densities of pressure below this fraction of the highest, because the JKR law has an infinite tail.
LEAST_DENSITY = 1e-3
LEVELS = 255  # largest grey level of a picture
CONTACT_COLOUR = (230, 0, 13)  # red, green and blue of spots and patches


class PageSummary(NamedTuple):
    """Size of a page, number of contacts on the page, and numbers of omitted contacts.

    Attributes
    ----------
    size : size of the file, bytes.
    shown : number of contacts on the page.
    left_out : number of contacts omitted because the page would be too large.
    without_steps : number of contacts omitted because their runs reached no target.
    """

    size: int
    shown: int
    left_out: int
    without_steps: int


def write_explorer(
    folder: str | os.PathLike, page: str | os.PathLike, *, only: Mapping[str, Collection] = {}, largest: float
) -> PageSummary:
    """Write the page for exploring a campaign.

    The first seed of each contact precedes the other seeds, so that a small page contains all kinds of contacts.

    Parameters
    ----------
    folder : folder of the results of the campaign.
    page : HTML file to write.
    only : values to include, by a name in `CHOICES` such as "study"; a missing name stands for all its values.
    largest : largest size of the page, MB.

    Raises
    ------
    ValueError
        If the dataset is missing, a choice in `only` does not exist, no contact fits, or a file cannot be read.
    """
    from plotly.offline import get_plotlyjs

    folder = Path(folder)
    campaign = read_campaign(_dataset(folder))
    contacts = _contacts(run_labels(campaign), only)
    library = get_plotlyjs()
    room = largest * 1e6 - len(library.encode()) - len(_filled(campaign, {}, library="", largest=largest))
    included: list[dict] = []
    topographies: dict[str, dict] = {}
    without_steps = left_out = 0
    for number, runs in enumerate(contacts):
        entry = _contact(campaign, folder, runs)
        if entry is None:
            without_steps += 1
            continue
        name = results.SURFACE.format(surface=runs[0].surface, seed=runs[0].seed)
        new = {} if name in topographies else {name: encode_topography(read_dataset(folder / name))}
        room -= len(json.dumps([entry, new]))
        if room < 0:
            left_out = len(contacts) - number
            break
        included.append(entry | {"topography": name})
        topographies |= new
    if not included:
        reason = f"not even one contact fits on a page of {largest:g} MB; use a larger page"
        raise ValueError(reason if left_out else "no run reached a target; there is nothing to show")
    data = {"contacts": included, "topographies": topographies}
    text = _filled(campaign, data, library=library, largest=largest, left_out=left_out, without_steps=without_steps)
    with whole_file(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return PageSummary(len(text.encode()), len(included), left_out, without_steps)


def _dataset(folder: Path) -> Path:
    """Return the path of the campaign dataset in a folder of results."""
    files = sorted(folder.glob(results.DATASET.format(campaign="*")))
    if len(files) != 1:
        count = f"{len(files)} campaign datasets" if files else "no campaign dataset"
        raise ValueError(f"{folder} has {count} in dataset/; expected a folder with the results of one campaign")
    return files[0]


def _contacts(labels: list[RunLabels], only: Mapping[str, Collection]) -> list[list[RunLabels]]:
    """Group the chosen runs that differ only in their model. Groups with the first seed of a contact come first."""
    for name, values in only.items():
        known = list(dict.fromkeys(getattr(run, name) for run in labels))
        if unknown := [value for value in values if value not in known]:
            raise ValueError(f"{name} {unknown[0]} is not in this campaign; expected {', '.join(map(str, known))}")
    contacts: dict[tuple, list[RunLabels]] = {}
    for run in labels:
        if all(getattr(run, name) in values for name, values in only.items()):
            contacts.setdefault(run._replace(model=""), []).append(run)
    seeds: dict[RunLabels, list] = {}
    for contact, runs in contacts.items():
        runs.sort(key=lambda run: list(MODELS).index(run.model))
        seeds.setdefault(contact._replace(seed=0), []).append(runs)
    return [runs for each in itertools.zip_longest(*seeds.values()) for runs in each if runs]


def _contact(campaign: xr.DataTree, folder: Path, labels: list[RunLabels]) -> dict | None:
    """Return the data of a contact with all models; None if no run reached a target."""
    runs = {run.model: select_run(campaign, run) for run in labels}
    entries = {
        run.model: encode_run(runs[run.model], _maps(folder, run, runs[run.model]))
        for run in labels
        if runs[run.model].sizes["step"]
    }
    if not entries:
        return None
    first, *others = entries
    for other in others:
        entries[other]["partners"] = find_partners(runs[first], runs[other])
    return {name: getattr(labels[0], name) for name in CHOICES} | {"runs": entries}


def _maps(folder: Path, labels: RunLabels, run: xr.Dataset) -> list[str] | None:
    """Return the contact map at each snapshot of a boundary-element run; None for other runs or without a file.

    Only the file of the run contains maps. The order of snapshots in this file and in the campaign dataset may differ.
    """
    file = folder / results.RUN.format(**path_fields(labels))
    if not MODELS[labels.model].by_cells or not file.is_file():
        return None
    with readable(file), xr.open_dataset(file, engine="netcdf4") as data:
        states = zip(run["snapshot_kind"].values.astype(str), run["snapshot_target"].values, strict=True)
        return [encode_map(data["contact_map"][find_snapshot(data, *state)].values) for state in states]


def _printable(data):
    """Escape control characters in all texts and keys of nested data."""
    if isinstance(data, dict):
        return {_printable(name): _printable(value) for name, value in data.items()}
    if isinstance(data, list):
        return [_printable(value) for value in data]
    return printable_lines(data) if isinstance(data, str) else data


def _filled(campaign, data, *, library, largest, left_out=0, without_steps=0) -> str:
    """Return the HTML text of the page."""
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


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def encode_floats(values: np.ndarray) -> str:
    """Encode numbers in base64: little-endian, single precision."""
    return _base64(np.asarray(values, "<f4").tobytes())


def encode_topography(surface: xr.Dataset) -> dict:
    """Return the heights of a surface file, divided by the rms height and averaged over blocks, in 256 levels."""
    heights = surface["height"].transpose("y", "x").values / (float(surface["rms_height"]) or 1.0)
    means = average_blocks(heights, MOST_HEIGHTS)
    low, high = float(means.min()), float(means.max())
    levels = np.rint((means - low) / ((high - low) or 1.0) * LEVELS).astype(np.uint8)
    return {"grid": len(heights), "cells": len(means), "low": low, "high": high, "levels": _base64(levels.tobytes())}


def encode_run(run: xr.Dataset, maps: Sequence[str] | None) -> dict:
    """Return the curves of a run and its snapshots.

    Parameters
    ----------
    run : dataset of a run with at least one step.
    maps : contact maps (from `encode_map`) at the snapshots of a run with boundary elements; None if the file with the
        maps is missing. For the asperity model, `maps` is None because `run` contains the spots.
    """
    stops = zip(run["step_kind"].values.astype(str), run["step_target"].values, strict=True)
    # Indenters are shown as experiments are: force (uN) against indentation (um).
    of_indenter = {"force": 1e6, "indentation": 1e6} if "shape" in run else {}
    return {
        **{name: encode_floats(run[name] * factor) for name, factor in of_indenter.items()},
        "failure": why_failed(run.attrs),
        "period": float(run["period"]),
        "periodic": str(run["boundary"].values) == "periodic",
        "grid": int(run["grid"]),
        "rms_height": float(run["unit_height"]),
        "pressure": encode_floats(run["reduced_pressure"]),
        "area": encode_floats(run["contact_area_fraction"]),
        "gap": encode_floats(reduced_gap(run)),
        "spots": run["spot_count"].values.tolist(),
        "leg": run["leg"].values.tolist(),
        "stops": [None if kind == BETWEEN else f"{kind} {target:.6g}" for kind, target in stops],
        "snapshots": [_snapshot(run, k, maps) for k in range(run.sizes["snapshot"])],
    }


def _snapshot(run: xr.Dataset, snapshot: int, maps: Sequence[str] | None) -> dict:
    """Return the spots or the contact map of a snapshot, and the distributions of figures 3 and 8."""
    by_cells = model_of(run.attrs).by_cells
    cell = float(run["period"]) ** 2
    areas = [patch_areas(run, snapshot)]
    pressure, (density,) = pressure_densities([(run, snapshot)], joined=by_cells)
    visible = density > LEAST_DENSITY * density.max(initial=0)
    data = {
        "step": int(run["snapshot_step"].values[snapshot]),
        "gap": ["", ""],
        "pressure": [encode_floats(pressure[visible]), encode_floats(density[visible])],
        "sizes": _points(patch_density(areas, cell)),
        "larger": _points(patches_above(areas, cell)),
    }
    gap, densities = gap_densities([(run, snapshot)])
    if len(gap):  # near full contact, too few gaps for a distribution remain
        data["gap"] = _points((gap, densities))
    if maps is not None:
        data["map"] = maps[snapshot]
    elif not by_cells:
        spots = spots_of(run, snapshot)
        data["circles"] = [encode_floats(spots[f"spot_{name}"]) for name in ("x", "y", "radius")]
    return data


def _points(curve) -> list[str]:
    """Encode the x values and the y values of a curve of one run."""
    x, (y,) = curve
    return [encode_floats(x), encode_floats(y)]


def encode_map(contact: np.ndarray) -> str:
    """Return a map of contact as a PNG in base64; the opacity of a cell is its fraction in contact.

    Parameters
    ----------
    contact : (n, n), from 0 to 1, along y and x; its first row is at the bottom of the picture.
    """
    from PIL import Image

    fraction = average_blocks(np.asarray(contact, float), MOST_CELLS)[::-1]
    levels = np.rint(fraction * LEVELS).astype(np.uint8)
    image = Image.frombytes("P", levels.shape, levels.tobytes())
    image.putpalette(CONTACT_COLOUR * (LEVELS + 1))
    file = io.BytesIO()
    image.save(file, "PNG", transparency=bytes(range(LEVELS + 1)))
    return _base64(file.getvalue())


def find_partners(one: xr.Dataset, other: xr.Dataset) -> list[int]:
    """Find, for every step of a run, the step of another run at the same state of the path; -1 without such a step.

    A step that reaches a target corresponds to the step of the other run at the same target on the same leg. Any other
    step corresponds to the step on the same leg with the nearest mean separation.

    Parameters
    ----------
    one : dataset of the first run, with `step_kind`, `step_target`, `leg` and `mean_separation`.
    other : the other run, with the same variables.
    """
    legs, separations = other["leg"].values, other["mean_separation"].values
    kinds, targets = other["step_kind"].values.astype(str), other["step_target"].values
    steps = []
    columns = (one[name].values for name in ("leg", "mean_separation", "step_kind", "step_target"))
    for leg, separation, kind, target in zip(*columns, strict=True):
        candidates = legs == leg
        if str(kind) != BETWEEN:
            candidates &= (kinds == str(kind)) & (targets == target)
        distances = np.where(candidates, np.abs(separations - separation), np.inf)
        steps.append(int(distances.argmin()) if candidates.any() else -1)
    return steps
