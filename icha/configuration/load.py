"""Load a configuration file: convert its text into a campaign, or report all problems."""

import itertools
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Any

import yaml
from pydantic import ValidationError

from icha.configuration.campaign import Campaign
from icha.configuration.design import expand_design
from icha.configuration.errors import ConfigurationError, format_problem, problem_of, refuse
from icha.configuration.plausibility import (
    CONFIRMED,
    Unusual,
    caused_in_campaign,
    plausibility_problems,
    sticky_runs,
    unusual_in_campaign,
    unusual_values,
)
from icha.configuration.studies import PILOT
from icha.configuration.topographies import inspect_topographies
from icha.configuration.yaml_files import (
    Source,
    apply_defaults,
    dump_yaml,
    excessive_size,
    merge,
    read_source,
    read_yaml,
)
from icha.datasets.results import CHOSEN_LEVELS
from icha.support.scripts import modules_of
from icha.support.values import NAME_PATTERN, NOTHING, Folders


@dataclass(frozen=True)
class Configuration:
    """A valid campaign, and the text from which the campaign was loaded.

    Parameters
    ----------
    campaign : the campaign in SI units, with complete paths of files.
    text : the configuration as written, with units and overrides.
    origin : path of the configuration file.
    warnings : warnings about coarse grids and unusual values.
    """

    campaign: Campaign
    text: str
    origin: str = field(compare=False)
    warnings: tuple[str, ...] = field(compare=False, default=())


def load_configuration(
    path: str | os.PathLike,
    overrides: Mapping[str, Any] | None = None,
    *,
    within: str | os.PathLike | None = None,
    results: str | os.PathLike | None = None,
) -> Configuration:
    """Read and check a configuration file, and all surfaces and measurements in other files.

    The text is checked before the other files, because this order finds most errors quickly.

    Parameters
    ----------
    path : path of the configuration file (YAML).
    overrides : nested mapping of values that replace values in the file, as from `snakemake --config`.
    within : folder that must contain all files of surfaces and measurements; None to allow any folder.
    results : folder with the results of all campaigns; it contains the seeds that ICHA has chosen for the studies with
        `accuracy`. Without this folder, these studies have the seeds of a pilot.

    Raises
    ------
    ConfigurationError
        If a key or file is wrong; the message has a line for each problem.
    """
    source = read_source(Path(path), overrides or {})
    if results is not None:
        source = replace(source, content=_with_chosen_levels(source.content, Path(results)))
    return _load(source, within)


def _load(source: Source, within: str | os.PathLike | None) -> Configuration:
    """Check a configuration and the files that it names."""
    unusual = unusual_values(source.content)
    campaign = _check_text(source, unusual, within)
    text, confirmed = dump_yaml(source.content, source.name), source.content.get(CONFIRMED)
    topographies, unread = inspect_topographies(campaign)
    refuse(source, itertools.chain(unread, campaign.file_problems()))
    campaign = campaign.with_topographies(topographies)
    unusual += unusual_in_campaign(campaign)
    sticky = list(sticky_runs(campaign))
    # Studies for which ICHA chooses the levels, and has not chosen yet.
    undecided = {name for name, each in campaign.studies.items() if each.accuracy is not None and each.levels is None}
    if too_sticky := [each for each in sticky if each.location[1] in undecided]:
        levels = {each.location[1]: {"levels": _WITHOUT_ASPERITIES} for each in too_sticky}
        found = _load(replace(source, content=merge(source.content, {"studies": levels})), within)
        reason = "is not reached with the asperity model, because {}; boundary elements alone give the estimate"
        notes = [
            format_problem(
                source, (*each.location[:2], "accuracy"), NOTHING, reason.format(f"{each.value}{each.source}")
            )
            for each in too_sticky
        ]
        return replace(found, warnings=(*notes, *found.warnings))
    # Other unusual values are reported first, because they may cause the others.
    caused = [*sticky, *caused_in_campaign(campaign)]
    implausible = list(plausibility_problems(unusual, confirmed)) or plausibility_problems(caused, confirmed)
    unusual += caused
    refuse(source, itertools.chain(implausible, campaign.problems()))
    reason = "is unusual{}, but confirmed; expected {}"
    accepted = [
        format_problem(source, each.location, each.value, reason.format(each.source, each.usual)) for each in unusual
    ]
    return Configuration(campaign, text, source.name, tuple(accepted))


# Levels of the pilot of a study with `accuracy` whose surfaces are too sticky for the asperity model.
_WITHOUT_ASPERITIES = {"coarse": f"1..{len(PILOT.coarse)}", "fine": f"1..{len(PILOT.fine)}"}


def _with_chosen_levels(written: dict, results: Path) -> dict:
    """Return a configuration in which studies with `accuracy` have the seeds that ICHA has chosen, as `levels`."""
    studies, name = apply_defaults(written).get("studies"), written.get("name")
    if not isinstance(studies, Mapping) or not isinstance(name, str) or not re.fullmatch(NAME_PATTERN, name):
        return written
    asked = [label for label, study in studies.items() if isinstance(study, Mapping) and study.get("accuracy")]
    file = results / name / CHOSEN_LEVELS
    if not asked or not file.is_file():
        return written
    chosen = read_yaml(file)
    return merge(written, {"studies": {label: {"levels": chosen[label]} for label in asked if label in chosen}})


def _check_text(source: Source, unusual: list[Unusual], within: str | os.PathLike | None) -> Campaign:
    """Check the text of a configuration file and return the campaign; of other files, only maps of adhesion are read.

    Unusual values that are not confirmed are reported first, because they may cause the other problems.
    """
    implausible = list(plausibility_problems(unusual, source.content.get(CONFIRMED)))
    content = apply_defaults(source.content)
    if excess := excessive_size(content):
        raise ConfigurationError(f"{source.name}: {excess}; expected fewer")
    folders = Folders(Path(source.name).parent, None if within is None else Path(within))
    try:
        campaign = Campaign.model_validate(content, context=folders)
    except ValidationError as error:
        refuse(source, map(problem_of, error.errors()), implausible)
    campaign, problems = expand_design(campaign, content, folders)
    refuse(source, problems, implausible)
    refuse(source, itertools.chain(implausible, campaign.problems()))
    return campaign


def _with_map(material: Any, path: str) -> Any:
    """Return the content of a material, with another path of its map of works of adhesion."""
    if not isinstance(material, Mapping):
        return material
    return {key: path if key == "file" else _with_map(value, path) for key, value in material.items()}


def _named_files(campaign: Campaign) -> dict[tuple[str, str], str]:
    """Return the paths of the files of surfaces, maps, measurements and own figures, by section and entry."""
    files = {("surfaces", name): each.path for name, each in campaign.surfaces.items() if each.from_file}
    files |= {("figures", name): each.script for name, each in campaign.figures.model_extra.items()}
    maps = {("materials", name): each.adhesion_map for name, each in campaign.materials.items()}
    files |= {key: each.file for key, each in maps.items() if each and each.file}
    return files | {("measurements", name): each.path for name, each in campaign.measurements.items()}


# Folder for copies of the files that a configuration names; a copy of the configuration is in the parent folder.
INPUTS = "inputs"


def collect_inputs(configuration: Configuration) -> tuple[str, dict[str, str]]:
    """Return the text of a configuration with paths in the folder `inputs`, and the files to copy to this folder.

    The new paths are `inputs/<section>/<entry>/<name>`. The second result maps the new paths to the original paths;
    surfaces that no study uses are left out.
    """
    campaign = configuration.campaign
    # Variants of a surface have the same file as the original.
    named = {key: path for key, path in _named_files(campaign).items() if campaign.origin(*key) == key[1]}
    if not named:
        return configuration.text, {}
    content = yaml.safe_load(configuration.text)
    # Defaults may contain the path of a map, which each material gets at its own place. Other defaults stay, because
    # the list `confirmed` names them there.
    defaults = (content.get("defaults") or {}).get("materials") or {}
    maps = {key: defaults.pop(key) for key in list(defaults) if isinstance(defaults[key], Mapping)}
    content["materials"] = apply_defaults(content | {"defaults": {"materials": maps}})["materials"]
    used = {("surfaces", campaign.origin("surfaces", name)) for name in campaign.used_surfaces}
    files = {}
    for (section, name), path in named.items():
        folder, home = PurePosixPath(INPUTS, section, name), Path(path).resolve().parent
        modules = modules_of(path) if section == "figures" else ()
        stored = {Path(path).name: path} | {file.relative_to(home).as_posix(): str(file) for file in modules}
        entry, first = content[section][name] or {}, str(folder / Path(path).name)
        key = "script" if section == "figures" else "path"
        content[section][name] = _with_map(entry, first) if section == "materials" else entry | {key: first}
        if section != "surfaces" or (section, name) in used:
            files |= {str(folder / place): file for place, file in stored.items()}
    # Every surface from a file now has its own path, so the path is removed from the defaults.
    (content.get("defaults") or {}).get("surfaces", {}).pop("path", None)
    return dump_yaml(content, configuration.origin), files
