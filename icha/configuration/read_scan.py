"""Measured surfaces for scripts, prepared as a campaign prepares them."""

import os
import warnings
from typing import Any

from pydantic import ValidationError

from icha.configuration.errors import ConfigurationError, line, problem_of
from icha.configuration.surfaces import MeasuredSurface
from icha.support.values import NOTHING
from icha.surfaces.measured.settings import UnfitTopography
from icha.surfaces.measured.topography import prepared_topography
from icha.surfaces.surface import MISFIT_OF_EDGES, EdgeWarning, Surface, edges_fit


def read_scan(path: str | os.PathLike, **keywords: Any) -> Surface:
    """Read a measured topography and prepare it as a campaign does.

    Parameters
    ----------
    path : file of the topography.
    keywords : keys of a measured surface in a configuration, with values as they are written there, such as
        `size="32 um"`, `height_unit="nm"` and `boundary="window"`. `boundary` is needed; `size` and `height_unit` are
        needed unless the file has them.

    Raises
    ------
    ConfigurationError
        A ValueError, if a key is missing or wrong, or the file cannot be read or prepared as asked.
    """
    section = {"kind": "measured", "path": os.fspath(path), **keywords}
    try:
        preparation = MeasuredSurface.model_validate(section).preparation
    except ValidationError as error:
        content = {"surfaces": {"scan": section}}
        problems = [
            problem_of({**details, "loc": ("surfaces", "scan", *details["loc"])}, content)
            for details in error.errors(include_url=False)
        ]
        lines = [line("read_scan", location[2:], value, reason) for location, value, reason in problems]
        raise ConfigurationError("\n".join(lines)) from None
    try:
        surface = prepared_topography(path, preparation).surface
    except UnfitTopography as error:
        value = section.get(error.key)
        raise ConfigurationError(
            line("read_scan", (error.key,), NOTHING if value is None else value, str(error))
        ) from None
    if not surface.free and not edges_fit(surface.heights):
        warnings.warn(MISFIT_OF_EDGES, EdgeWarning, stacklevel=2)
    return surface
