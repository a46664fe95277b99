"""Scans: what is told of them before anything is computed, and their section in a new campaign."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from icha.cli.project import UserError
from icha.support import formatting
from icha.support.formatting import format_count, printable
from icha.support.input_files import problem_with_path

if TYPE_CHECKING:
    from icha.contact.models import Model

# Endings of the pictures that can be drawn.
PICTURES = (".png", ".pdf", ".svg")
# A few per cent of filled points do no harm; the documentation says "measure again" for more.
MANY_FILLED = 0.05
# What stands in the place of what is left to fill in while the rest is checked, in SI units and in a configuration.
_GUESSES = {"height_unit": 1e-9, "size": (1e-4, 1e-4)}
_GUESSED = {"height_unit": "nm", "lateral_unit": "um", "boundary": "window"}
_EXAMPLES = {"height_unit": "nm", "lateral_unit": "um", "size": "[90 um, 90 um]"}
# Bytes that show whether anything is in a file.
_BEGINNING = 2**16


def check_picture(path: Path | None) -> None:
    """Raise `UserError` unless the path, if there is one, ends as a picture."""
    if path is not None and path.suffix not in PICTURES:
        raise UserError(f"--plot {path}: ends in {path.suffix!r}; allowed: {', '.join(PICTURES)}")


def about_scan(name: str, scan, *, to_scale: bool = True, models: Iterable[Model] = ()) -> Iterator[str]:
    """Lines about the `icha.surfaces.measured.resolution.ScanResolution` of a surface of some name.

    to_scale : whether the units of its heights and of its size are known.
    models : those that press it; none if that is not known yet.
    """
    from icha.surfaces.measured.resolution import LEAST_CELLS_OF_SUMMIT, RESOLVED_CELLS, slope_left
    from icha.surfaces.moments import LEAST_CELLS_PER_WAVE, error_of_cells

    used = scan.used
    points = format_count(scan.filled, "point")
    filled = f"{points} had no height and {'was' if scan.filled == 1 else 'were'} filled" if scan.filled else ""
    taken = f", `data: {printable(scan.data)}` of several" if scan.data else ""
    yield f"{name}: read as {scan.format}{taken}, {filled or 'no point is missing'}"
    yield f"{name}: {scan.reading.partition(', ')[2]}"
    if scan.filled:
        yield f"{name}: {formatting.share(scan.filled, scan.points)} of the points are filled"
    if scan.filled > MANY_FILLED * scan.points:
        yield (
            f"{name}: warning: more than {100 * MANY_FILLED:.0f} % of the points are filled, so much of it is "
            "made up and smooth; measure again, or `crop` a part with fewer missing points"
        )
    if not scan.edges_fit:
        yield (
            f"{name}: warning: `boundary: periodic`, but opposite edges differ by much more than neighbouring nodes, "
            "so there is a step at the edges; use `boundary: window`, `mirror` or `free`"
        )
    nodes = f"{used.grid} x {used.grid} nodes"
    scale = f" {formatting.length(used.spacing)} apart, rms slope {used.rms_slope:.3g}," if to_scale else ","
    few = "; fewer than " if scan.cells_per_summit < LEAST_CELLS_OF_SUMMIT else "; at least "
    yield (
        f"{name}: {nodes}{scale} {format_count(scan.summits, 'summit')}, {scan.cells_per_summit:.0f} nodes for each"
        f"{few}{LEAST_CELLS_OF_SUMMIT}, with which summits are resolved"
    )
    if unsupported := len(scan.asperities.unsupported_height):
        yield (
            f"{name}: asperities leave out {unsupported} of them, which the nodes around do not support, as at steps, "
            "spikes, pits and plateaus"
        )
    models = list(models)
    reasons = scan.reasons_against_asperities
    if reasons and (not models or any(model.by_summits for model in models)):
        others = ", or `models: [boundary_elements]`" if scan.cells_per_short_wave >= LEAST_CELLS_PER_WAVE else ""
        yield (
            f"{name}: warning: asperity model not applicable ({'; '.join(reasons)}); use a `cutoff` that smooths the "
            f"surface{others}"
        )
    error = error_of_cells(scan.cells_per_short_wave)
    if error and any(model.by_cells for model in models):
        yield (
            f"{name}: boundary elements have about {scan.cells_per_short_wave:.2g} nodes for its shortest waves, with "
            f"which areas are off by {error}; recommended: {RESOLVED_CELLS}, by a longer `cutoff` or a finer "
            "`grid`"
        )
    if not to_scale:
        return
    noise = scan.noise
    if noise is None:
        yield f"{name}: its spectrum falls to the shortest waves: no noise floor is seen"
    else:
        yield (
            f"{name}: its spectrum ends in a noise floor of {formatting.length(float(f'{noise.rms:.2g}'))} rms; waves "
            f"shorter than {formatting.length(float(f'{noise.wavelength:.2g}'))} are mostly noise, and have "
            f"{noise.slope_share:.0%} of its mean square slope"
        )
    if scan.advice:
        keys = " and ".join(f"`{key}: {value}`" for key, value in in_yaml(scan.advice).items())
        cutoff = scan.advice.get("cutoff")
        leaves = f", which leaves {slope_left(scan.measured, cutoff):.0%} of its rms slope" if cutoff else ""
        yield f"{name}: advisable: {keys}{leaves}"


def in_yaml(advice: Mapping[str, float | int]) -> dict[str, str]:
    """Advised keys with their values as a configuration has them."""
    return {key: formatting.length(value) if key == "cutoff" else str(value) for key, value in advice.items()}


class MeasuredSection(NamedTuple):
    """What a new campaign has of a scan.

    name, path : of the surface, and of its file from the configuration. lines : what the file says, and what it does
    not. to_fill_in : why, by key. filled_in : values with which the rest can be checked. periodic : whether it is a
    Fourier series. advice : keys that are advised, as a configuration has them. scan : its
    `icha.surfaces.measured.resolution.ScanResolution`.
    """

    name: str
    path: str
    lines: list[str]
    to_fill_in: dict[str, str]
    filled_in: dict[str, str]
    periodic: bool
    advice: dict[str, str]
    scan: Any


def measured_section(path: Path, data: str | None, folder: Path) -> MeasuredSection:
    """Read the file of a measured topography for its section in a configuration of a folder.

    Raises
    ------
    UserError
        If it can be read by no setting, or has no topography that can be used.
    """
    import numpy as np

    from icha.surfaces.measured.resolution import scan_resolution
    from icha.surfaces.measured.settings import UnfitTopography

    _check_file(path)
    scan, assumed, missing, sides = _read(path, data)
    rows, columns = scan.heights.shape
    gaps = int(np.count_nonzero(~np.isfinite(scan.heights)))
    boundary, detrend = ("periodic", "none") if scan.format == "fourier" else ("free", "tilt")
    how = {"format": "auto", "boundary": boundary, "data": data, "detrend": detrend, "missing": "fill"} | assumed
    try:
        resolution = scan_resolution(path, how)
    except UnfitTopography as error:
        raise UserError(f"--measured {path}: {error.key} {error}") from None

    taken = data if data is not None else scan.data
    lines = [f"data: {json.dumps(taken)}"] if taken else []
    lines.append(f"# {columns} x {rows} points{_what_is_known(scan, missing, sides)}")
    for key in missing:
        empty = " (empty: that of the heights)" if key == "lateral_unit" else ""
        lines.append(f"{key}:        # to fill in, since the file does not say it{empty}: such as {_EXAMPLES[key]}")
    if gaps:
        lines.append(f"missing: fill                # {gaps} points have no height; `refuse` makes that an error")
    advice = {} if missing else in_yaml(resolution.advice)
    name = re.sub("[^a-z0-9_-]+", "_", path.stem.lower()).strip("_") or "measured"
    if boundary != "periodic":
        missing = missing | {"boundary": "what lies beyond the edges: free, window, mirror or periodic"}
    guessed = _GUESSED | {"size": [f"{columns} um", f"{rows} um"]}
    filled_in = {key: guessed[key] for key in missing}
    path = Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    return MeasuredSection(name, path, lines, missing, filled_in, boundary == "periodic", advice, resolution)


def _check_file(path):
    if problem := problem_with_path(path):
        raise UserError(f"--measured {path}: {problem}; allowed: a file that holds a topography")
    with path.open("rb") as file:
        if not file.read(_BEGINNING).strip():
            raise UserError(f"--measured {path}: the file is empty; allowed: one that holds a topography")


def _read(path, data):
    """The scan, what was assumed to read it and what is missing of it, by key; its sides, if their unit is missing."""
    from icha.surfaces.measured.scan import load_scan
    from icha.surfaces.measured.settings import Preparation, UnfitTopography

    assumed, missing = {}, {}
    while True:
        try:
            scan = load_scan(path, Preparation("auto", "free", data, **assumed))
            break
        except UnfitTopography as error:
            if error.key not in _GUESSES or error.key in assumed:
                how = "; say which by --data NAME" if error.key == "data" else ""
                raise UserError(f"--measured {path}: {error.key} {error}{how}") from None
            assumed[error.key] = _GUESSES[error.key]
            missing[error.key] = str(error)
    if "size" in missing:
        # Pixels are square, as a rule.
        rows, columns = scan.heights.shape
        assumed["size"] = columns * 1e-6, rows * 1e-6
    elif "height_unit" in missing:
        # Coordinates without a unit would count in that of the heights, which is not known either.
        bare = load_scan(path, Preparation("auto", "free", data, **assumed, lateral_unit=1.0))
        if bare.size != scan.size:
            missing["lateral_unit"] = "is missing, and the file does not say it; left out, it is that of the heights"
            return scan, assumed, missing, bare.size
    return scan, assumed, missing, None


def _what_is_known(scan, missing, sides) -> str:
    """Size and heights of a scan; `sides` are in the file's coordinates, if it gives these without their unit."""
    import numpy as np

    known = ""
    if sides is not None:
        known += f" over {sides[0]:.4g} x {sides[1]:.4g} in its coordinates"
    elif "size" not in missing:
        known += f" over {scan.size[0] * 1e6:.4g} um x {scan.size[1] * 1e6:.4g} um"
    if "height_unit" not in missing:
        known += f", heights from {np.nanmin(scan.heights) * 1e6:.4g} um to {np.nanmax(scan.heights) * 1e6:.4g} um"
    return known
