"""The page for exploring a campaign: one HTML file with a slider along the snapshots of each contact.

The page needs neither network nor other files. The same results and choices always give exactly the same file.
"""

from __future__ import annotations

import base64
import io
import json
import os
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from icha.contact.models import MODELS
from icha.datasets import results
from icha.datasets.attributes import why_failed
from icha.datasets.campaign import find_snapshot, reduced_gap, run_labels, select_run, spots_of
from icha.datasets.files import read_campaign, read_dataset, readable
from icha.datasets.labels import RunLabels, number_label, path_fields
from icha.datasets.quantities import quantity
from icha.figures.at_one_load import gap_densities, pressure_densities
from icha.figures.maps import average_blocks
from icha.report.template import write_page
from icha.support.formatting import printable

CHOICES = ("study", "surface", "rms_slope", "material", "seed")  # labels of a contact, in the order of the lists
MOST_CELLS = 512  # largest number of cells along an edge of a picture; finer maps are averaged over blocks
# The page omits densities below this fraction of the highest, because the JKR law has an infinite tail.
LEAST_DENSITY = 1e-3
CONTACT_COLOUR = (230, 0, 13)  # red, green and blue of spots and patches


def write_explorer(
    folder: str | os.PathLike, page: str | os.PathLike, *, only: Mapping[str, Collection] = {}, largest: float
) -> tuple[int, int]:
    """Write the page for exploring a campaign; return the number of contacts on the page, and of those without steps.

    Raise ValueError if a file cannot be read, a choice does not exist, or the page is too large.

    Parameters
    ----------
    folder : folder of the results of the campaign.
    page : HTML file to write.
    only : values to include, by a name in `CHOICES` such as "study"; a missing name stands for all its values.
    largest : largest size of the data of the page, MB.
    """
    files = sorted(Path(folder).glob(results.DATASET.format(campaign="*")))
    if len(files) != 1:
        count = f"{len(files)} campaign datasets" if files else "no campaign dataset"
        raise ValueError(f"{folder} has {count} in dataset/; expected a folder with the results of one campaign")
    campaign = read_campaign(files[0])
    groups = group_runs(run_labels(campaign), only)
    contacts, topographies, size = [], {}, 0
    for number, runs in enumerate(groups):
        if (entry := encode_contact(campaign, Path(folder), runs)) is None:
            continue
        name = entry["topography"] = results.SURFACE.format(surface=runs[0].surface, seed=runs[0].seed)
        if name not in topographies:
            heights = read_dataset(Path(folder, name))["height"].transpose("y", "x").values
            topographies[name] = picture((heights - heights.min()) / (np.ptp(heights) or 1.0))
            size += len(topographies[name])
        contacts.append(entry)
        size += len(json.dumps(entry))
        if size > largest * 1e6:
            advice = "choose fewer with --study, --surface, --material and --seed, or use a larger --size"
            raise ValueError(f"only {number} of {len(groups)} contacts fit on a page of {largest:g} MB; {advice}")
    if not contacts:
        raise ValueError("no run reached a target; there is nothing to show")
    without_steps = len(groups) - len(contacts)
    write_page(
        page,
        "explorer.html",
        title=campaign.attrs.get("title", "Rough contact campaign"),
        data={"contacts": contacts, "topographies": topographies},
        choices=CHOICES,
        without_steps=without_steps,
        densities=["gap u/h_rms", "pressure p/(E* h'rms)"],
    )
    return len(contacts), without_steps


def group_runs(labels: list[RunLabels], only: Mapping[str, Collection]) -> list[list[RunLabels]]:
    """Group the chosen runs that differ only in their model."""
    for name, values in only.items():
        known = list(dict.fromkeys(getattr(run, name) for run in labels))
        if unknown := [value for value in values if value not in known]:
            raise ValueError(f"{name} {unknown[0]} is not in this campaign; expected {', '.join(map(str, known))}")
    contacts: dict[RunLabels, list[RunLabels]] = {}
    for run in sorted(labels, key=lambda run: list(MODELS).index(run.model)):
        if all(getattr(run, name) in values for name, values in only.items()):
            contacts.setdefault(run._replace(model=""), []).append(run)
    return list(contacts.values())


def encode_contact(campaign: xr.DataTree, folder: Path, labels: list[RunLabels]) -> dict | None:
    """Return the curves and snapshots of a contact with all models; None if no run reached a step."""
    runs = {run: data for run in labels if (data := select_run(campaign, run)).sizes["step"]}
    if not runs:
        return None
    first, data = next(iter(runs.items()))
    states: dict[tuple, dict] = {}
    for run, each in runs.items():
        for k in np.argsort(each["snapshot_step"].values, kind="stable").tolist():
            state = str(each["snapshot_kind"].values[k]), float(each["snapshot_target"].values[k])
            file = folder / results.RUN.format(**path_fields(run))
            states.setdefault(state, {})[run.model] = encode_snapshot(each, k, file, state)
    choices = (first.study, first.surface, number_label(first.rms_slope), first.material, first.seed)
    return dict(zip(CHOICES, map(printable, choices), strict=True)) | {
        "grid": int(data["grid"]),
        "periodic": str(data["boundary"].values) == "periodic",
        "curves": [
            [
                *map(_label, names),
                {run.model: [_numbers(_values(each, n)) for n in names] for run, each in runs.items()},
            ]
            for names in _plots(data)
        ],
        "failures": {run.model: printable(reason) for run, each in runs.items() if (reason := why_failed(each.attrs))},
        "states": list(states.values()),
    }


def _plots(run: xr.Dataset) -> list[tuple[str, str]]:
    """Return the quantities on both axes of the plots; indenters are shown as experiments are."""
    if "shape" in run:
        return [("indentation", "contact_area_fraction"), ("indentation", "force")]
    return [("reduced_pressure", "contact_area_fraction"), ("reduced_pressure", "reduced_gap")]


def _values(run: xr.Dataset, name: str) -> np.ndarray:
    """Return a quantity of the steps of a run, in the unit of its label."""
    values = reduced_gap(run) if name == "reduced_gap" else run[name]
    return values.values * (1.0 if quantity(name).unit == "1" else 1e6)


def _label(name: str) -> str:
    words = quantity(name)
    return f"{words.name} {words.text}{'' if words.unit == '1' else f' (µ{words.unit})'}"


def _numbers(values) -> list[float]:
    """Return numbers with five digits."""
    return [float(f"{value:.5g}") for value in np.asarray(values).tolist()]


def encode_snapshot(run: xr.Dataset, k: int, file: Path, state: tuple[str, float]) -> dict:
    """Return the step, the contact and the distributions of snapshot `k` of a run, whose kind and target are `state`.

    Only the `file` of the run contains contact maps of boundary elements. Its snapshots may have another order.
    """
    step, by_cells = int(run["snapshot_step"].values[k]), MODELS[run.attrs["contact_model"]].by_cells
    densities = gap_densities([(run, k)]), pressure_densities([(run, k)], joined=by_cells)
    leg = int(run["leg"].values[step])
    found: dict = {
        "leg": ("unloading" if leg % 2 else "loading") + (f" (leg {leg})" if leg > 1 else ""),
        "points": [[_numbers(_values(run, name))[step] for name in names] for names in _plots(run)],
        "densities": [
            [_numbers(axis[y > LEAST_DENSITY * y.max(initial=0)]) for axis in (x, y)] for x, (y,) in densities
        ],
    }
    if by_cells and file.is_file():
        with readable(file), xr.open_dataset(file, engine="netcdf4") as data:
            found["map"] = picture(data["contact_map"][find_snapshot(data, *state)].values, CONTACT_COLOUR)
    elif not by_cells:
        spots = spots_of(run, k) * 1000 / float(run["period"])
        columns = (_numbers(spots[f"spot_{name}"]) for name in ("x", "y", "radius"))
        found["circles"] = list(zip(*columns, strict=True))
    return found


def picture(values: np.ndarray, colour: tuple[int, ...] = ()) -> str:
    """Return an array (y, x; from 0 to 1; first row at the bottom) as a PNG in base64: grey, or opacity of a colour."""
    from PIL import Image

    values = average_blocks(np.asarray(values, float), MOST_CELLS)[::-1]
    image = Image.fromarray(np.rint(255 * values).astype(np.uint8))
    if colour:
        image.putpalette(colour * 256)
        image.info["transparency"] = bytes(range(256))
    file = io.BytesIO()
    image.save(file, "PNG")
    return base64.b64encode(file.getvalue()).decode("ascii")
