"""Topographies from files: their facts, for a campaign, and `icha.read_scan`, for scripts."""

from __future__ import annotations

import json
import math
import os
import warnings
from collections.abc import Collection
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from icha.configuration.campaign import Campaign, Topography
from icha.configuration.errors import ConfigurationError, format_problem, problem_of
from icha.configuration.studies import MEASURED
from icha.configuration.surfaces import FileSurface, MeasuredSurface
from icha.support.checksums import sha256_of
from icha.support.values import NOTHING, Problem

if TYPE_CHECKING:
    from icha.surfaces.surface import Surface


def inspect_topographies(campaign: Campaign) -> tuple[dict[str, Topography], list[Problem]]:
    """Return facts of every topography from a file that a study uses, and the problems with these files."""
    contacts = [each for study in campaign.studies for each in campaign.contacts(study)]
    of_measured_slope = {each.surface for each in contacts if each.rms_slope == MEASURED}
    adhesive = {each.surface for each in contacts if campaign.materials[each.material].surface_energy > 0}
    facts, problems = {}, []
    for name in dict.fromkeys(each.surface for each in contacts):
        surface = campaign.surfaces[name]
        if surface.random:
            continue
        try:
            if isinstance(surface, MeasuredSurface):
                facts[name] = inspect_scan(surface, with_slope=name in of_measured_slope)
            else:
                facts[name] = _inspect_map(surface, with_slope=name in of_measured_slope, with_energy=name in adhesive)
        except (ValueError, MemoryError) as error:
            key, origin = getattr(error, "key", "path"), campaign.origin("surfaces", name)
            variant = "" if origin == name else f"of variant {name!r}: "
            if isinstance(error, MemoryError):
                error = f"does not fit into the memory of this machine ({error}); expected a smaller topography"
            problems.append((("surfaces", origin, key), getattr(surface, key, NOTHING), f"{variant}{error}"))
    return facts, problems


def inspect_scan(surface: MeasuredSurface, *, with_slope: bool = True) -> Topography:
    """Return facts of a prepared scan, which are known already if the file has not changed."""
    try:
        stat = os.stat(surface.path)
        version = stat.st_mtime_ns, stat.st_size
    except (OSError, ValueError):  # reading the file reports what is wrong
        version = None
    facts = _facts(surface.path, version, json.dumps(surface.preparation, sort_keys=True))
    return facts if with_slope else facts._replace(rms_slope=None)


@lru_cache(maxsize=256)
def _facts(path: str, version: tuple[int, int] | None, preparation: str) -> Topography:
    """Facts of a prepared topography, which are kept until the file has another version (time and size)."""
    # Slow to import, and not needed for every campaign.
    from icha.surfaces.measured.topography import prepared_topography

    prepared = prepared_topography(path, json.loads(preparation))
    surface = prepared.surface
    slope = _rounded(surface.rms_slope)
    return Topography(surface.grid, surface.period, slope, prepared.source_sha256, *_full_contact(surface))


def _inspect_map(surface: FileSurface, *, with_slope: bool, with_energy: bool) -> Topography:
    from icha.surfaces.measured.array_files import read_height_map

    heights = read_height_map(surface.path, surface.height_unit)
    slope, full_contact = None, (math.nan, math.nan)
    if with_slope or with_energy:
        # Imports SciPy's transforms, which other calls do not need.
        from icha.surfaces.surface import Surface

        topography = Surface(heights, surface.period)
        slope = _rounded(topography.rms_slope) if with_slope else None
        full_contact = _full_contact(topography) if with_energy else full_contact
    return Topography(len(heights), surface.period, slope, sha256_of(Path(surface.path)), *full_contact)


def _full_contact(surface):
    """Energy (m) and complete pressure of full contact over E*, at rms slope 1."""
    return surface.full_contact_energy / surface.rms_slope**2, surface.complete_contact_pressure / surface.rms_slope


def _rounded(slope: float) -> float:
    """Round to six digits, which are part of file names and more than any instrument has."""
    return float(f"{slope:.6g}")


def read_scan(path: str | os.PathLike, *, confirmed: Collection[str] = (), **keywords: Any) -> Surface:
    """Read a measured topography and prepare it as a campaign does.

    Parameters
    ----------
    path : file of the topography.
    confirmed : names of keywords with unusual values that are intended; "height_unit" also confirms the slope.
    keywords : keys of a measured surface in a configuration, with values in the same form, such as `size="32 um"`,
        `height_unit="nm"` and `boundary="window"`. `boundary` is needed; `size` and `height_unit` are needed unless the
        file has them.

    Raises
    ------
    ConfigurationError
        A ValueError, if a key is missing or wrong, the file cannot be read or prepared as asked, or a size or slope
        is unusual and not confirmed.
    """
    section = {"kind": "measured", "path": os.fspath(path), **keywords}
    from icha.configuration.plausibility import unusual_topography, unusual_values
    from icha.surfaces.measured.settings import UnfitTopography
    from icha.surfaces.measured.topography import prepared_topography
    from icha.surfaces.surface import MISFIT_OF_EDGES, EdgeWarning, edges_fit

    try:
        measured = MeasuredSurface.model_validate(section)
    except ValidationError as error:
        where = ("surfaces", "scan", "measured")
        problems = [problem_of({**details, "loc": (*where, *details["loc"])}) for details in error.errors()]
        lines = [format_problem("read_scan", location[2:], value, reason) for location, value, reason in problems]
        raise ConfigurationError("\n".join(lines)) from None
    _refuse_unusual(unusual_values({"surfaces": {"scan": section}}), confirmed)
    try:
        surface = prepared_topography(path, measured.preparation).surface
    except UnfitTopography as error:
        value = section.get(error.key)
        raise ConfigurationError(
            format_problem("read_scan", (error.key,), NOTHING if value is None else value, str(error))
        ) from None
    _refuse_unusual(unusual_topography(("surfaces", "scan"), measured, surface.period, surface.rms_slope), confirmed)
    if not surface.free and not edges_fit(surface.heights):
        warnings.warn(MISFIT_OF_EDGES, EdgeWarning, stacklevel=2)
    return surface


def _refuse_unusual(found, confirmed):
    """Raise ConfigurationError if unusual values of a scan are not confirmed."""
    reason = "is unusual{}; expected {}. Correct it, or add `confirmed=[{!r}]` if it is intended"
    lines = [
        format_problem("read_scan", (key,), each.value, reason.format(each.source, each.usual, key))
        for each in found
        if (key := each.location[2]) not in confirmed
    ]
    if lines:
        raise ConfigurationError("\n".join(lines))
