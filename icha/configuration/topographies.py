"""Read topographies from files: their facts for campaigns, and `icha.read_scan` for scripts."""

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
        except ValueError as error:
            key, origin = getattr(error, "key", "path"), campaign.origin("surfaces", name)
            key = key if hasattr(surface, key) else "path"  # surfaces of kind `file` have fewer keys
            variant = "" if origin == name else f"of variant {name!r}: "
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
    from icha.configuration.plausibility import plausibility_problems, unusual_topography, unusual_values
    from icha.surfaces.measured.settings import UnfitTopography
    from icha.surfaces.surface import MISFIT_OF_EDGES, EdgeWarning, edges_fit

    def unconfirmed(unusual):
        unusual = [each._replace(location=each.location[2:]) for each in unusual]
        return plausibility_problems(unusual, list(confirmed), "`confirmed=[{!r}]`")

    section = {"kind": "measured", "path": os.fspath(path), **keywords}
    try:
        measured = MeasuredSurface.model_validate(section)
        refuse("read_scan", unconfirmed(unusual_values({"surfaces": {"scan": section}})))
        surface = read_surface(measured)
    except ValidationError as error:
        problems = [{**details, "loc": ("surfaces", "scan", "measured", *details["loc"])} for details in error.errors()]
        refuse("read_scan", [(location[2:], value, reason) for location, value, reason in map(problem_of, problems)])
    except UnfitTopography as error:
        refuse("read_scan", [((error.key,), section.get(error.key, NOTHING), str(error))])
    unusual = unusual_topography(("surfaces", "scan"), measured, surface.period, surface.rms_slope)
    refuse("read_scan", unconfirmed(unusual))
    if not surface.free and not edges_fit(surface.heights):
        warnings.warn(MISFIT_OF_EDGES, EdgeWarning, stacklevel=2)
    return surface
