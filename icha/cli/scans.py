"""Describe a scan (a measured topography) to the user, and write its section for the file of a new campaign."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from icha.cli.project import UserError
from icha.support import formatting
from icha.support.formatting import format_count, printable
from icha.support.input_files import problem_with_path

if TYPE_CHECKING:
    from icha.contact.models import Model

# A warning recommends another measurement if more than this fraction of the points is filled.
MOST_FILLED = 0.05
# A line on curvature is printed if a paraboloid takes more than this fraction of the variance, and a line on anisotropy
# if the ratio of rms slopes is larger than this value.
MUCH_CURVATURE, ANISOTROPIC = 0.5, 1.5
# A file may lack these keys. ICHA then assumes the values of GUESSES (in m), and shows those of EXAMPLES to the user.
GUESSES = {
    "height_unit": 1e-9,
    "lateral_unit": 1e-6,
    "size": (1e-4, 1e-4),
    "scattered": "interpolate",
    "touches_first": "low",
}
EXAMPLES = {"height_unit": "nm", "lateral_unit": "um", "size": "[90 um, 90 um]", "scattered": "interpolate"}
# What the user can do about keys that ICHA cannot assume.
_HINTS = {
    "data": "; choose one with --data NAME",
    "columns": "; write x, y and z above these columns in the file, and the unit of each column, such as z (nm)",
}
# Lines of a text file, and characters of a line, that `icha new` prints.
SHOWN_LINES, SHOWN_WIDTH = 6, 72


def show_first_lines(path: Path) -> Iterator[str]:
    """Yield the first lines of a text file for the user; no lines for other files."""
    from icha.surfaces.measured.text_tables import first_lines

    lines = [] if problem_with_path(path) else first_lines(path)[:SHOWN_LINES]
    if any(lines):
        yield f"{path.name} begins with:"
    for line in lines if any(lines) else []:
        text = printable(line.rstrip().replace("\t", " "))
        yield f"  {text[:SHOWN_WIDTH]}{' …' if len(text) > SHOWN_WIDTH else ''}"


def describe_scan(
    name: str, scan, *, to_scale: bool = True, sized: bool = True, models: Iterable[Model] = ()
) -> Iterator[str]:
    """Return the lines in which `icha new` and `icha describe` describe a scan.

    Parameters
    ----------
    name : name of the surface.
    scan : resolution of the scan (`icha.surfaces.measured.resolution.ScanResolution`).
    to_scale : whether the units of the heights and of the side lengths are known.
    sized : whether the ratio of the side lengths of pixels is known.
    models : contact models of the runs on the surface; empty if no runs are defined yet.
    """
    lines = [*_reading(scan, to_scale), *_defects(scan, to_scale)]
    if not sized:
        lines.append("summits, waves and directions depend on `size`; with it, `icha describe` prints them")
    elif not keys_for_defects(scan):
        lines += [*_resolution(scan, to_scale, list(models)), *(_noise(scan) if to_scale else ())]
    return (f"{name}: {line}" for line in lines)


def _reading(scan, to_scale: bool) -> Iterator[str]:
    """Yield lines on the format of the file, on points without a height, and on opposite edges that do not fit."""
    from icha.surfaces.surface import edges_fit

    share = formatting.share(scan.filled, scan.points)
    filled = f"heights of {format_count(scan.filled, 'point')} interpolated ({share} of the square)"
    array = f", `data: {printable(scan.square.data)}`, one of several" if scan.square.data else ""
    yield f"read as {scan.square.format}{array}, {filled if scan.filled else 'all points have a height'}"
    points = scan.reading.partition(", ")[2]
    # Without units, sizes would be assumptions.
    yield points if to_scale else points.partition(";")[0]
    if scan.filled > MOST_FILLED * scan.points:
        yield (
            f"warning: more than {100 * MOST_FILLED:.0f} % of the heights are interpolated and too smooth; measure "
            "again, or `crop` an area with fewer missing points"
        )
    if not scan.surface.free and not edges_fit(scan.surface.heights):
        yield (
            "warning: `boundary: periodic`, but opposite edges differ by much more than neighbouring nodes, so there "
            "is a step at the edges; use `boundary: window`, `mirror` or `free`"
        )


def _defects(scan, to_scale: bool) -> Iterator[str]:
    """Yield lines on outliers, offsets of scan lines and curvature: what was removed, or the keys that remove them."""
    defects, settings = scan.defects, scan.settings
    if found := defects.description_of_outliers:
        removed = found.replace(",", " replaced,", 1)
        keep = f"warning: {found}; `outliers: remove` replaces outliers"
        yield removed if settings.outliers == "remove" else keep
    for levelling, step in defects.offsets.items():
        size = f" of {formatting.length(float(f'{step:.2g}'))} rms" if to_scale else ""
        where = f"the lines along {'x' if levelling == 'lines' else 'y'}"
        if settings.levelling == levelling:
            yield f"steps{size} between {where} removed"
        else:
            yield (
                f"warning: {where} have steps{size} from line to line, which the surface does not have in the other "
                f"direction; `levelling: {levelling}` removes them"
            )
    if defects.curvature > MUCH_CURVATURE and settings.detrend != "none":
        taken = f"a paraboloid takes {defects.curvature:.0%} of the variance"
        advice = "; if the sample is curved, write `detrend: curvature`"
        yield f"{taken}{' and was removed' if settings.detrend == 'curvature' else advice}"
    if left := " and ".join(f"`{key}`" for key in keys_for_defects(scan)):
        yield f"write {left}; then `icha describe` judges the surface without the defects"


def keys_for_defects(scan) -> list[str]:
    """Return the keys that remove outliers and steps between lines, such as `outliers: remove`, if they are not set."""
    defects, settings = scan.defects, scan.settings
    found = ["outliers: remove"] if defects.outliers and settings.outliers == "keep" else []
    return found + [f"levelling: {each}" for each in defects.offsets if settings.levelling != each]


def _resolution(scan, to_scale: bool, models: list[Model]) -> Iterator[str]:
    """Yield lines on anisotropy, on the resolution of summits and waves, and on models that are not applicable."""
    import numpy as np

    from icha.surfaces.moments import slope_anisotropy
    from icha.surfaces.resolution import RECOMMENDED_CELLS
    from icha.surfaces.summits import SummitCoverage

    if (anisotropy := slope_anisotropy(scan.surface)) > ANISOTROPIC:
        yield (
            f"anisotropic: the largest rms slope of all directions is {anisotropy:.2g} times the smallest; the "
            "asperity model has been validated for isotropic surfaces only"
        )
    used, unsupported = scan.surface, len(scan.asperities.unsupported_height)
    summits = len(scan.asperities) + unsupported
    scale = f" {formatting.length(used.spacing)} apart, rms slope {used.rms_slope:.3g}" if to_scale else ""
    yield (
        f"{used.grid} x {used.grid} nodes{scale}, {format_count(summits, 'summit')}, about {scan.resolution}; "
        f"recommended: at least {RECOMMENDED_CELLS}"
    )
    if unsupported:
        yield (
            f"the asperity model excludes {unsupported} of these summits, because the nodes around them form steps, "
            "spikes, pits or plateaus instead of smooth summits"
        )
    # At mean separations of 3 to 1 rms heights.
    heights = np.linspace(3, 1, 5) * used.rms_height
    reasons = SummitCoverage.of(used, scan.asperities).reasons_against(heights)
    if reasons and (not models or any(model.by_summits for model in models)):
        other_model = ", or `models: [boundary_elements]`" if scan.resolution.representable else ""
        yield (
            f"warning: asperity model not applicable ({'; '.join(reasons)}); use a `cutoff` that smooths the surface"
            f"{other_model}"
        )


def _noise(scan) -> Iterator[str]:
    """Yield lines on the noise floor of the spectrum, and on recommended keys."""
    from icha.surfaces.measured.resolution import filtered_slope_share

    if (noise := scan.noise) is None:
        yield "no noise floor: the spectrum decreases down to the shortest waves"
    else:
        rms, wavelength = (formatting.length(float(f"{length:.2g}")) for length in (noise.rms, noise.wavelength))
        yield (
            f"the spectrum ends in a noise floor of {rms} rms; waves shorter than {wavelength} are mostly noise, and "
            f"contribute {noise.slope_share:.0%} of the mean square slope"
        )
        if scan.filled:
            yield "interpolated heights also contribute to the noise floor"
        if scan.settings.cutoff:
            yield (
                f"with `cutoff: {formatting.length(scan.settings.cutoff)}`, noise contributes "
                f"{scan.noise_share_after_filter:.0%} of the mean square slope"
            )
    if scan.advice:
        keys = " and ".join(f"`{key}: {value}`" for key, value in format_advice(scan.advice).items())
        cutoff = scan.advice.get("cutoff")
        kept = f"; filtering keeps {filtered_slope_share(scan.measured, cutoff):.0%} of the rms slope" if cutoff else ""
        yield f"recommended: {keys}{kept}"


def format_advice(advice: Mapping[str, float | int]) -> dict[str, str]:
    """Return the recommended keys, with their values as text for a configuration file."""
    return {key: formatting.length(value) if key == "cutoff" else str(value) for key, value in advice.items()}


def read_measured_section(path: Path, data: str | None, folder: Path) -> dict[str, Any]:
    """Read a measured topography and return the section of this surface for a configuration file in `folder`.

    Returns
    -------
    name : name of the surface.
    path : file of the topography, relative to `folder`.
    lines : lines of YAML, with the keys that the file determines and the keys that the user fills in.
    touches_first : `low` if the heading of the file says that the numbers increase downwards; otherwise `high`.
    to_fill_in : keys that the user must fill in, each with the reason.
    advice : recommended keys, with their values as text.
    scan : resolution of the scan (`icha.surfaces.measured.resolution.ScanResolution`).

    Raises
    ------
    UserError
        If ICHA cannot read the file with any setting, or cannot use its topography.
    """
    import numpy as np

    from icha.surfaces.measured.resolution import examine_scan
    from icha.surfaces.measured.settings import UnfitTopography

    if problem := problem_with_path(path):
        raise UserError(f"--measured {path}: {problem}; expected a file with a topography")
    scan, guessed, missing = _load(path, data)
    rows, columns = scan.heights.shape
    settings = {"format": "auto", "boundary": "free", "data": data, "detrend": "tilt", "missing": "fill"} | guessed
    try:
        resolution = examine_scan(path, settings)
    except UnfitTopography as error:
        raise UserError(f"--measured {path}: {error.key} {error}") from None

    # A heading that says that the numbers increase downwards determines this key.
    missing.pop("touches_first", None)
    array = data if data is not None else scan.data
    lines = [f"data: {json.dumps(array)}"] if array else []
    points = f"# {columns} x {rows} points"
    if "size" not in missing and "lateral_unit" not in missing:
        points += f" over {scan.size[0] * 1e6:.4g} um x {scan.size[1] * 1e6:.4g} um"
    if "height_unit" not in missing:
        points += f", heights from {np.nanmin(scan.heights) * 1e6:.4g} um to {np.nanmax(scan.heights) * 1e6:.4g} um"
    lines.append(points)
    lines += [f"{key}:        # to fill in (not in the file), for example {EXAMPLES[key]}" for key in missing]
    if not np.isfinite(scan.heights).all():
        lines.append("missing: fill                # some points have no height; with `refuse`, this is an error")
    lines += [f"# {key:<27}# recommended; see the output of `icha new`" for key in keys_for_defects(resolution)]
    advice = {} if missing or keys_for_defects(resolution) else format_advice(resolution.advice)
    if resolution.defects.curvature > MUCH_CURVATURE:
        advice["detrend"] = "curvature"
    name = re.sub("[^a-z0-9_-]+", "_", path.stem.lower()).strip("_") or "measured"
    missing["boundary"] = "what surrounds the scan: free, window, mirror or periodic"
    relative = Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    section = {"name": name, "path": relative, "lines": lines}
    section["touches_first"] = guessed.get("touches_first", "high")
    return section | {"to_fill_in": missing, "advice": advice, "scan": resolution}


def _load(path: Path, data: str | None):
    """Load a scan; return the scan, guessed values of keys that the file lacks, and a reason for each missing key."""
    from icha.surfaces.measured.scan import load_scan
    from icha.surfaces.measured.settings import Preparation, UnfitTopography

    guessed: dict[str, Any] = {}
    missing: dict[str, str] = {}
    while True:
        try:
            scan = load_scan(path, Preparation("auto", "free", data, **guessed))
            break
        except UnfitTopography as error:
            if error.key not in GUESSES or error.key in guessed:
                raise UserError(f"--measured {path}: {error.key} {error}{_HINTS.get(error.key, '')}") from None
            guessed[error.key] = GUESSES[error.key]
            missing[error.key] = str(error)
    if "size" in missing:
        rows, columns = scan.heights.shape  # most scans have square pixels
        guessed["size"] = columns * 1e-6, rows * 1e-6
    return scan, guessed, missing
