"""Topographies from files: their facts, for a campaign, and `icha.read_scan`, for scripts."""

from __future__ import annotations

import os
import warnings
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from icha.configuration.campaign import Campaign, Topography
from icha.configuration.errors import problem_of, refuse
from icha.configuration.studies import MEASURED
from icha.configuration.surfaces import FileSurface, MeasuredSurface
from icha.support.checksums import sha256_of
from icha.support.values import NOTHING, Problem

if TYPE_CHECKING:
    from icha.surfaces.surface import Surface


def inspect_topographies(campaign: Campaign) -> tuple[dict[str, Topography], list[Problem]]:
    """Return the facts of every topography from a file that a study uses, and the problems with these files."""
    contacts = [each for study in campaign.studies for each in campaign.contacts(study)]
    of_measured_slope = {each.surface for each in contacts if each.rms_slope == MEASURED}
    facts, problems = {}, []
    for name in dict.fromkeys(each.surface for each in contacts if not campaign.surfaces[each.surface].random):
        surface = campaign.surfaces[name]
        try:
            facts[name] = inspect_file(surface)
        except (ValueError, MemoryError) as error:
            key, origin = getattr(error, "key", "path"), campaign.origin("surfaces", name)
            key = key if hasattr(surface, key) else "path"  # surfaces of kind `file` have fewer keys
            variant = "" if origin == name else f"of variant {name!r}: "
            if isinstance(error, MemoryError):
                error = f"does not fit into the memory of this machine ({error}); expected a smaller topography"
            problems.append((("surfaces", origin, key), getattr(surface, key, NOTHING), f"{variant}{error}"))
            continue
        if name not in of_measured_slope:
            facts[name] = facts[name]._replace(rms_slope=None)
    return facts, problems


# Facts of topographies, by path, settings, time and size of the file.
_KNOWN: dict[tuple, Topography] = {}


def inspect_file(section: MeasuredSurface | FileSurface) -> Topography:
    """Return the facts of a topography from a file, which is read again only if it has changed."""
    try:
        stat = os.stat(section.path)
        version = stat.st_mtime_ns, stat.st_size
    except (OSError, ValueError):  # reading the file reports what is wrong
        version = None
    key = section.path, section.model_dump_json(), version
    if key not in _KNOWN:
        surface = read_surface(section)
        slope = surface.rms_slope
        _KNOWN[key] = Topography(
            surface.grid,
            surface.period,
            # Six digits, which are part of file names, are more than any instrument has.
            float(f"{slope:.6g}"),
            sha256_of(Path(section.path)),
            surface.full_contact_energy / slope**2,
            surface.complete_contact_pressure / slope,
        )
    return _KNOWN[key]


def read_surface(section: MeasuredSurface | FileSurface) -> Surface:
    """Read and prepare the surface of a file, as its section of the configuration describes."""
    # These modules import SciPy, which takes time; campaigns without such a surface do not need it.
    if isinstance(section, MeasuredSurface):
        from icha.surfaces.measured.topography import prepared_topography

        return prepared_topography(section.path, section.preparation).surface
    from icha.surfaces.measured.scan import read_height_map
    from icha.surfaces.surface import Surface

    return Surface(read_height_map(section.path, section.height_unit), section.period)


def read_scan(path: str | os.PathLike, *, confirmed: Collection[str] = (), **keywords: Any) -> Surface:
    """Read a measured topography and prepare it as a campaign does.

    Parameters
    ----------
    path : file of the topography.
    confirmed : names of the keywords with unusual values that you intend; "height_unit" also confirms the slope.
    keywords : keys of a measured surface in a configuration, with values in the same form, such as `size="32 um"`,
        `height_unit="nm"` and `boundary="window"`. `boundary` is required; `size` and `height_unit` are required unless
        the file contains them.

    Raises
    ------
    ConfigurationError
        A ValueError, if a key is missing or wrong, if the file cannot be read or prepared with these keys, or if a
        size or slope is unusual and not confirmed.
    """
    from icha.configuration.plausibility import unusual_topography, unusual_values
    from icha.surfaces.measured.settings import UnfitTopography
    from icha.surfaces.surface import MISFIT_OF_EDGES, EdgeWarning, edges_fit

    section = {"kind": "measured", "path": os.fspath(path), **keywords}
    where = ("surfaces", "scan")
    unusual = unusual_values({"surfaces": {"scan": section}})
    try:
        measured = MeasuredSurface.model_validate(section)
        refuse("read_scan", _unconfirmed(unusual, confirmed))
        surface = read_surface(measured)
    except ValidationError as error:
        problems = [problem_of({**details, "loc": (*where, "measured", *details["loc"])}) for details in error.errors()]
        refuse("read_scan", [(location[2:], value, reason) for location, value, reason in problems])
    except UnfitTopography as error:
        refuse("read_scan", [((error.key,), section.get(error.key, NOTHING), str(error))])
    refuse("read_scan", _unconfirmed(unusual_topography(where, measured, surface.period, surface.rms_slope), confirmed))
    if not surface.free and not edges_fit(surface.heights):
        warnings.warn(MISFIT_OF_EDGES, EdgeWarning, stacklevel=2)
    return surface


def _unconfirmed(unusual, confirmed) -> list[Problem]:
    """Return the problems with unusual values of a scan that are not confirmed."""
    reason = "is unusual{}; expected {}. Correct it, or add `confirmed=[{!r}]` if it is intended"
    found = [(each.location[2], each) for each in unusual]
    return [
        ((key,), each.value, reason.format(each.source, each.usual, key)) for key, each in found if key not in confirmed
    ]
