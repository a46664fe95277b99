"""From the text of a configuration file to a campaign, or to a list of everything that is wrong with it."""

import itertools
import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

import yaml
from pydantic import ValidationError

from icha.configuration.campaign import Campaign, Topography
from icha.configuration.design import designed
from icha.configuration.errors import MOST_TOLD, ConfigurationError, line, problem_of
from icha.configuration.plausibility import (
    CONFIRMED,
    needless_confirmations,
    plausibility_problems,
    sticky_runs,
    unusual_topography,
    unusual_values,
)
from icha.configuration.studies import MEASURED
from icha.configuration.surfaces import MeasuredSurface
from icha.configuration.yaml_files import (
    dumped,
    excessive_defaults,
    merged,
    place_in_defaults,
    read_yaml,
    with_defaults,
)
from icha.support.checksums import sha256_of
from icha.support.values import NOTHING, Problem
from icha.surfaces.measured.array_files import read_height_map


@dataclass(frozen=True)
class Configuration:
    """A valid campaign and where it came from.

    `text` is the merged configuration as its author wrote it, units included; `campaign` is what it means, in SI
    units and with the paths of its files resolved; `origin` is its file, and `warnings` are what is allowed but not
    advisable, or unusual.
    """

    campaign: Campaign
    text: str
    origin: str = field(compare=False)
    warnings: tuple[str, ...] = field(compare=False, default=())


def load_configuration(
    path: str | os.PathLike, overrides: Mapping[str, Any] | None = None, *, within: str | os.PathLike | None = None
) -> Configuration:
    """Read and check a configuration file.

    Parameters
    ----------
    path : YAML file.
    overrides : values that replace those of the file, key by key, as given by `snakemake --config`.
    within : folder in which all files that it names must lie, as those of a stranger must; anywhere if left out.

    Raises
    ------
    ConfigurationError
        Naming every key that is wrong.
    """
    path = Path(path)
    from_file = read_yaml(path)
    written = merged(from_file, overrides or {})
    text = dumped(written, str(path))
    unusual, meant = unusual_values(written), written.get(CONFIRMED)
    # Told with whatever else is wrong, of which they may be the cause.
    slips = list(plausibility_problems(unusual, meant))

    def said(location, *what):
        return line(_origin(path, from_file, overrides or {}, location), location, *what)

    def fail(found: Iterable[Problem]):
        found = list(itertools.islice(found, MOST_TOLD + 1))
        if not found:
            return
        told = [(place_in_defaults(location, written), value, reason) for location, value, reason in found]
        lines = list(dict.fromkeys(said(*problem) for problem in [*told, *slips[: MOST_TOLD + 1]]))
        if len(lines) > MOST_TOLD:
            lines[MOST_TOLD:] = [f"{path}: more is wrong, which is told once this is right"]
        raise ConfigurationError("\n".join(lines))

    fail(excessive_defaults(written))
    content = with_defaults(written)
    try:
        campaign = Campaign.model_validate(content)
    except ValidationError as error:
        fail(problem_of(details, content) for details in error.errors())
    campaign, design_problems = designed(campaign.with_files_beside(path.parent), content)
    fail(design_problems)
    fail(_files_outside(campaign, within) if within is not None else ())
    topographies, unread = _topographies(campaign)
    fail(unread)
    campaign = campaign.with_topographies(topographies)
    for name, each in topographies.items():
        location = "surfaces", campaign.origin("surfaces", name)
        unusual += unusual_topography(location, campaign.surfaces[name], each.period, each.rms_slope)
    sticky = list(sticky_runs(campaign))
    # A slip may be why a contact is sticky.
    slips = list(plausibility_problems(unusual, meant)) or list(plausibility_problems(sticky, meant))
    unusual += sticky
    fail(itertools.chain(campaign.problems(), slips, needless_confirmations(unusual, meant)))
    confirmed = [
        said(each.location, each.value, f"is unusual{each.how}, but confirmed; usual: {each.usual}") for each in unusual
    ]
    return Configuration(campaign, text, str(path), (*campaign.warnings(), *confirmed))


def _files_outside(campaign: Campaign, folder: str | os.PathLike) -> list[Problem]:
    """Files that a campaign names and that do not lie in a folder, links followed."""
    named = {("surfaces", name): each.path for name, each in campaign.surfaces.items() if not each.random}
    named |= {("measurements", name): each.path for name, each in campaign.measurements.items()}
    return [
        ((section, campaign.origin(section, name), "path"), path, "lies elsewhere; allowed: files beside it")
        for (section, name), path in named.items()
        if not Path(path).resolve().is_relative_to(Path(folder).resolve())
    ]


def _origin(path: Path, from_file: Mapping, overrides: Mapping, location: tuple) -> str:
    """Who gave the value at `location`, or failed to give it: the file, or the command line's overrides."""

    def holds(content, keys):
        for key in keys:
            if not isinstance(content, Mapping):
                return True
            if key not in content:
                return False
            content = content[key]
        return True

    given = bool(location) and holds(overrides, location)
    return "--config" if given or not holds(from_file, location[:-1]) else str(path)


def _topographies(campaign: Campaign) -> tuple[dict[str, Topography], list[Problem]]:
    """What there is to know of every topography that is pressed and comes from a file; what is wrong with them."""
    contacts = [each for study in campaign.studies for each in campaign.contacts(study)]
    asking = {each.surface for each in contacts if each.rms_slope == MEASURED}
    adhering = {each.surface for each in contacts if campaign.materials[each.material].surface_energy > 0}
    found, wrong = {}, []
    for name in dict.fromkeys(each.surface for each in contacts):
        surface = campaign.surfaces[name]
        if surface.random:
            continue
        try:
            grid, period, boundary, slope, sha256, energy = _facts(surface, name in asking, name in adhering)
        except (ValueError, MemoryError) as error:
            key = getattr(error, "key", "path")
            origin = campaign.origin("surfaces", name)
            variant = "" if origin == name else f"of variant {name!r}: "
            if isinstance(error, MemoryError):
                error = f"does not fit into the memory of this machine ({error}); allowed: a smaller topography"
            wrong.append((("surfaces", origin, key), getattr(surface, key, NOTHING), f"{variant}{error}"))
            continue
        # Six digits name the files, and are more than any instrument has.
        slope = None if slope is None else float(f"{slope:.6g}")
        found[name] = Topography(grid, period, boundary, slope, sha256, energy)
    return found, wrong


def _facts(surface, with_slope: bool, with_energy: bool) -> tuple[int, float, str, float | None, str, float]:
    if isinstance(surface, MeasuredSurface):
        # Slow to import, and not for every campaign.
        from icha.surfaces.measured.topography import topography_facts

        facts = topography_facts(surface.path, surface.preparation)
        slope = facts.rms_slope if with_slope else None
        return facts.grid, facts.period, facts.boundary, slope, facts.source_sha256, facts.full_contact_energy
    heights = read_height_map(surface.path, surface.metres_per_unit)
    slope, energy = None, math.nan
    if with_slope or with_energy:
        # Imports SciPy's transforms, for which no other call should wait.
        from icha.surfaces.surface import Surface

        topography = Surface(heights, surface.period)
        slope = topography.rms_slope if with_slope else None
        energy = topography.full_contact_energy / topography.rms_slope**2 if with_energy else math.nan
    return len(heights), surface.period, "periodic", slope, sha256_of(Path(surface.path)), energy


INPUTS = "inputs"


def with_files_beside_it(configuration: Configuration) -> tuple[str, dict[str, str]]:
    """The text of a configuration as used, and the files that belong beside it.

    Returns
    -------
    text : the configuration, whose files lie in `inputs/<section>/<entry>/`, with their own names.
    files : where these files are now, by their paths from the folder of the text. A surface that no study presses has
        a path, too, but no file: nobody has read it.
    """
    campaign = configuration.campaign
    named = {("surfaces", name): each.path for name, each in campaign.surfaces.items() if not each.random}
    named |= {("measurements", name): each.path for name, each in campaign.measurements.items()}
    # Variants of a surface have its file.
    named = {key: path for key, path in named.items() if campaign.origin(*key) == key[1]}
    if not named:
        return configuration.text, {}
    content = yaml.safe_load(configuration.text)
    pressed = {each.surface for study in campaign.studies for each in campaign.contacts(study)}
    used = {("surfaces", campaign.origin("surfaces", name)) for name in pressed}
    files = {}
    for (section, name), path in named.items():
        place = str(PurePosixPath(INPUTS, section, name, Path(path).name))
        content[section][name] = (content[section][name] or {}) | {"path": place}
        if section == "measurements" or (section, name) in used:
            files[place] = path
    # All surfaces have a path of their own now.
    (content.get("defaults") or {}).get("surfaces", {}).pop("path", None)
    return dumped(content, configuration.origin), files
