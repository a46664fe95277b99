"""The section of a measured surface in a new campaign: what its file says is filled in, the rest is left to do."""

import json
import os
import re
from pathlib import Path
from string import Template
from typing import Any, NamedTuple

from icha.cli.project import Mistake
from icha.cli.scans import in_yaml
from icha.support.input_files import flaw_of_path

_TEMPLATE = Path(__file__).parent / "templates/measured.yaml"
# What stands in the place of what is left to fill in while the rest is checked, in SI units and in a configuration.
_GUESSES = {"height_unit": 1e-9, "size": (1e-4, 1e-4)}
_GUESSED = {"height_unit": "nm", "lateral_unit": "um", "boundary": "window"}
_EXAMPLES = {"height_unit": "nm", "lateral_unit": "um", "size": "[90 um, 90 um]"}
# Bytes that show whether anything is in a file.
_BEGINNING = 2**16

_BOUNDARY = """\
    # What lies beyond the edges. One of:
    #   free        nothing: one square on a half-space that extends beyond it, for asperities only
    #   window      the same square again, after its heights have been made to fall to their mean towards the edges;
    #               the rim is flat and smooth, and with adhesion it may stick as a whole
    #   mirror      its mirror images, in a cell of twice the side, with four times the nodes
    #   periodic    the same square again, as it is: only if opposite edges fit, as those of computed ones do
    boundary:        # to fill in
"""
_PERIODIC = "    boundary: periodic           # a Fourier series is\n"


class MeasuredSection(NamedTuple):
    """Name and text of a section; what is to fill in, by key, and with what it can be checked; the scan.

    scan : its `icha.surfaces.measured.resolution.ScanResolution`.
    """

    name: str
    text: str
    to_fill_in: dict[str, str]
    filled_in: dict[str, str]
    scan: Any


def measured_section(path: Path, data: str | None, folder: Path) -> MeasuredSection:
    """Read the file of a measured topography, and write its section for a configuration in a folder.

    Raises
    ------
    Mistake
        If it can be read by no setting, or has no topography that can be used.
    """
    import numpy as np

    from icha.surfaces.measured.resolution import scan_resolution
    from icha.surfaces.measured.scan import format_of
    from icha.surfaces.measured.settings import UnfitTopography

    _check_file(path)
    scan, assumed, missing, sides = _read(path, data)
    rows, columns = scan.heights.shape
    gaps = int(np.count_nonzero(~np.isfinite(scan.heights)))
    boundary, detrend = ("periodic", "none") if format_of(path) == "fourier" else ("free", "tilt")
    how = {"format": "auto", "boundary": boundary, "data": data, "detrend": detrend, "missing": "fill"} | assumed
    try:
        resolution = scan_resolution(path, how)
    except UnfitTopography as error:
        raise Mistake(f"--measured {path}: {error.key} {error}") from None

    taken = data if data is not None else scan.data
    lines = [f"data: {json.dumps(taken)}"] if taken else []
    lines.append(f"# {columns} x {rows} points{_what_is_known(scan, missing, sides)}")
    for key in missing:
        empty = " (empty: that of the heights)" if key == "lateral_unit" else ""
        lines.append(f"{key}:        # to fill in, since the file does not say it{empty}: such as {_EXAMPLES[key]}")
    if gaps:
        lines.append(f"missing: fill                # {gaps} points have no height; `refuse` makes that an error")
    advice = {} if missing else in_yaml(resolution.advice)
    cutoff, grid = advice.get("cutoff", "1 um"), advice.get("grid", "128")
    advised = {key: "advised: " if key in advice else "" for key in ("cutoff", "grid")}
    name = re.sub("[^a-z0-9_-]+", "_", path.stem.lower()).strip("_") or "measured"
    text = Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        surface=name,
        path=Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix(),
        found="".join(f"    {line}\n" for line in lines),
        boundary=_PERIODIC if boundary == "periodic" else _BOUNDARY,
        cutoff=f"    # cutoff: {cutoff:<18} # {advised['cutoff']}shorter waves are filtered out\n",
        grid=f"# grid: {grid:<20} # {advised['grid']}nodes along a side; fewer are quicker, but lose short waves",
    )
    if boundary != "periodic":
        missing = missing | {"boundary": "what lies beyond the edges: free, window, mirror or periodic"}
    guessed = _GUESSED | {"size": [f"{columns} um", f"{rows} um"]}
    return MeasuredSection(name, text, missing, {key: guessed[key] for key in missing}, resolution)


def _check_file(path):
    if flaw := flaw_of_path(path):
        raise Mistake(f"--measured {path}: {flaw}; allowed: a file that holds a topography")
    with path.open("rb") as file:
        if not file.read(_BEGINNING).strip():
            raise Mistake(f"--measured {path}: the file is empty; allowed: one that holds a topography")


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
                raise Mistake(f"--measured {path}: {error.key} {error}{how}") from None
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
