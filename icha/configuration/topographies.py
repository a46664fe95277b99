"""Read surfaces from files, for campaigns and their checks, and for scripts (function `icha.read_scan`)."""

from __future__ import annotations

import os
import warnings
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from icha.configuration.campaign import Campaign, Topography
from icha.configuration.errors import problem_of, refuse
from icha.configuration.studies import MEASURED
from icha.configuration.surfaces import FileSurface, MeasuredSurface, SpectrumSurface
from icha.configuration.yaml_files import Source
from icha.half_space.layer import softness_of
from icha.support.checksums import sha256_of
from icha.support.usual import IchaWarning
from icha.support.values import NOTHING, Problem
from icha.surfaces.measured.settings import UnfitTopography
from icha.surfaces.moments import FullContact

if TYPE_CHECKING:
    from icha.asperity.material import Material
    from icha.surfaces.measured.topography import PreparedTopography
    from icha.surfaces.surface import Surface
    from icha.surfaces.tabulated_spectrum import TabulatedSpectrum


def inspect_topographies(campaign: Campaign) -> tuple[dict[str, Topography], list[Problem]]:
    """Return the properties of those surfaces of studies that come from files, and the problems of these files."""
    of_measured_slope = {run.surface for run in campaign.all_runs if run.rms_slope == MEASURED}
    facts, problems = {}, []
    for name in (name for name in campaign.used_surfaces if campaign.surfaces[name].from_file):
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


# Properties of the topographies that have been read, and their full contact with layers of a thickness and Poisson
# ratio; by path, settings, time and size of the file.
_KNOWN: dict[tuple, Topography] = {}
_KNOWN_ON_LAYERS: dict[tuple, FullContact] = {}


def _version_of_file(section):
    """Return a key of a section and its file that changes with the settings and with the file."""
    try:
        stat = os.stat(section.path)
        version = stat.st_mtime_ns, stat.st_size
    except (OSError, ValueError):  # `read_surface` reports the error
        version = None
    return section.path, section.model_dump_json(), version


def inspect_file(section: MeasuredSurface | FileSurface | SpectrumSurface) -> Topography:
    """Return the properties of a surface from a file; an unchanged file is read only once."""
    key = _version_of_file(section)
    if key not in _KNOWN:
        from icha.surfaces.resolution import shortest_wave

        repeated = ""
        if isinstance(section, MeasuredSurface):
            from icha.surfaces.measured.defects import repeated_height

            topography = read_topography(section)
            surface, repeated = _in_place(topography.surface, section), repeated_height(topography.square.heights)
        else:
            surface = read_surface(section)
        slope, height = surface.rms_slope, surface.rms_height
        if isinstance(section, SpectrumSurface):
            # All realisations have the slope and the ratio of height and slope of the spectrum, whatever their seed.
            spectrum = _spectrum(section)
            slope, height = spectrum.rms_slope, spectrum.rms_height
        _KNOWN[key] = Topography(
            surface.grid,
            surface.period,
            # File names contain the slope with six digits; no instrument is more accurate.
            float(f"{slope:.6g}"),
            sha256_of(Path(section.path)),
            surface.full_contact().scaled(1 / surface.rms_slope),
            height / slope,
            surface.rms_curvature / surface.rms_slope,
            shortest_wave(surface),
            repeated,
        )
    return _KNOWN[key]


def full_contact_on_layer(section: MeasuredSurface | FileSurface | SpectrumSurface, material: Material) -> FullContact:
    """Return the full contact of a surface from a file with a layer, at rms slope 1; an unchanged file is read once."""
    key = *_version_of_file(section), material.thickness, material.poisson_ratio
    if key not in _KNOWN_ON_LAYERS:
        surface = read_surface(section)
        _KNOWN_ON_LAYERS[key] = surface.full_contact(softness_of(material)).scaled(1 / surface.rms_slope)
    return _KNOWN_ON_LAYERS[key]


def read_topography(section: MeasuredSurface) -> PreparedTopography:
    """Read and prepare a measured topography; its size may be one length only if the scan is square."""
    from icha.surfaces.measured.topography import prepared_topography

    return prepared_topography(section.path, section.preparation | {"size": section.size})


def read_surface(section: MeasuredSurface | FileSurface | SpectrumSurface) -> Surface:
    """Read a surface from a file, and prepare it with the keys of its section; of a spectrum, the realisation 1."""
    # The modules below import SciPy, which takes time; campaigns without surfaces from files do not need SciPy.
    from icha.surfaces.measured.scan import read_height_map
    from icha.surfaces.surface import Surface

    if isinstance(section, MeasuredSurface):
        surface = read_topography(section).surface
    elif isinstance(section, SpectrumSurface):
        with warnings.catch_warnings():
            # The configuration asks about coarse grids itself.
            warnings.simplefilter("ignore", IchaWarning)
            surface = _spectrum(section).realise(section.grid, 1, section.amplitudes)
    else:
        surface = Surface(read_height_map(section.path, section.height_unit), section.period)
    return _in_place(surface, section)


def _spectrum(section: SpectrumSurface) -> TabulatedSpectrum:
    """Read the spectrum of a surface of kind `spectrum`, in its periodic cell."""
    from icha.surfaces.tabulated_spectrum import read_spectrum_table

    return read_spectrum_table(section.path, section.length_unit, section.convention).in_cell(section.period)


def _in_place(surface, section):
    """Return a surface with the boundary and shape of its section; raise UnfitTopography if the shape does not fit."""
    if section.shape is None:
        return surface if surface.free == section.free else replace(surface, boundary="free")
    if problem := section.shape.problem(surface.period, surface.grid):
        raise UnfitTopography(problem.removeprefix("shape: "), "shape")
    return replace(surface, boundary="free", shape=section.shape.shape)


def read_scan(path: str | os.PathLike, *, confirmed: Collection[str] = (), **keywords: Any) -> Surface:
    """Read a measured topography from a file and prepare a surface, with the same steps as in a campaign.

    Parameters
    ----------
    path : path of the file.
    confirmed : names of keywords whose unusual values you intend; "height_unit" also confirms an unusual rms slope.
    keywords : keys of a surface of kind `measured`, with values as in a configuration file, such as `size="32 um"`,
        `height_unit="nm"` and `boundary="window"`. `boundary` is required; `size` and `height_unit` are required unless
        the file contains them.

    Raises
    ------
    ConfigurationError
        If a key is missing or wrong, if the file cannot be read or prepared with these keys, or if an unusual size or
        slope is not confirmed. A ConfigurationError is also a ValueError.

    Warns
    -----
    IchaWarning
        If opposite edges of a periodic surface do not fit, or if outliers are kept.
    """
    from icha.configuration.plausibility import plausibility_problems, unusual_topography, unusual_values
    from icha.surfaces.measured.defects import repeated_height
    from icha.surfaces.measured.topography import defects_of
    from icha.surfaces.surface import MISFIT_OF_EDGES, edges_fit

    def unconfirmed(unusual):
        unusual = [each._replace(location=each.location[2:]) for each in unusual]
        return plausibility_problems(unusual, list(confirmed), "`confirmed=[{!r}]`")

    source = Source("read_scan")
    section = {"kind": "measured", "path": os.fspath(path), **keywords}
    try:
        measured = MeasuredSurface.model_validate(section)
        refuse(source, unconfirmed(unusual_values({"surfaces": {"scan": section}})))
        topography = read_topography(measured)
        surface = _in_place(topography.surface, measured)
    except ValidationError as error:
        problems = [{**details, "loc": ("surfaces", "scan", "measured", *details["loc"])} for details in error.errors()]
        refuse(source, [(location[2:], *others) for location, *others in map(problem_of, problems)])
    except UnfitTopography as error:
        refuse(source, [((error.key,), section.get(error.key, NOTHING), str(error))])
    repeated = repeated_height(topography.square.heights)
    unusual = unusual_topography(("surfaces", "scan"), measured, surface.period, surface.rms_slope, repeated)
    refuse(source, unconfirmed(unusual))
    if not surface.free and not edges_fit(surface.heights):
        warnings.warn(MISFIT_OF_EDGES, IchaWarning, stacklevel=2)
    if measured.outliers == "keep" and (text := defects_of(topography.square).description_of_outliers):
        warnings.warn(f"{text}; `outliers: remove` replaces outliers", IchaWarning, stacklevel=2)
    return surface
