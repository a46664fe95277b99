"""Load a configuration file: its text becomes a campaign, or a list of all problems."""

import itertools
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

import yaml
from pydantic import ValidationError

from icha.configuration.campaign import Campaign
from icha.configuration.design import expand_design
from icha.configuration.errors import MOST_PROBLEMS, ConfigurationError, format_problem, problem_of
from icha.configuration.plausibility import (
    CONFIRMED,
    needless_confirmations,
    plausibility_problems,
    sticky_runs,
    unusual_topography,
    unusual_values,
)
from icha.configuration.topographies import inspect_topographies
from icha.configuration.yaml_files import (
    apply_defaults,
    dump_yaml,
    excessive_size,
    location_in_defaults,
    merge,
    read_yaml,
)
from icha.support.values import Problem


@dataclass(frozen=True)
class Configuration:
    """A valid campaign and its source.

    Parameters
    ----------
    campaign : in SI units, with the resolved paths of its files.
    text : the merged configuration as its author wrote it, units included.
    origin : path of its file.
    warnings : warnings about coarse grids and unusual values.
    """

    campaign: Campaign
    text: str
    origin: str = field(compare=False)
    warnings: tuple[str, ...] = field(compare=False, default=())


@dataclass(frozen=True)
class _Source:
    """Origin of the values of a configuration: its file, and overrides of single values.

    Parameters
    ----------
    path : the file.
    from_file : content of the file.
    overrides : values that replace those of the file.
    """

    path: Path
    from_file: Mapping
    overrides: Mapping

    def format(self, location: tuple, value: Any, reason: str) -> str:
        """Format a problem, or an unusual value, with its source: the file or the command line."""
        overridden = bool(location) and _has(self.overrides, location)
        by_option = overridden or not _has(self.from_file, location[:-1])
        return format_problem("--config" if by_option else str(self.path), location, value, reason)

    def fail(self, problems: Iterable[Problem], implausible: Iterable[Problem] = ()) -> None:
        """Raise ConfigurationError if there are problems; list implausible values, which may be their cause, too."""
        found = list(itertools.islice(problems, MOST_PROBLEMS + 1))
        if not found:
            return
        found += itertools.islice(implausible, MOST_PROBLEMS + 1)
        lines = list(dict.fromkeys(self.format(*problem) for problem in found))
        if len(lines) > MOST_PROBLEMS:
            lines[MOST_PROBLEMS:] = [f"{self.path}: there are more problems; correct these first"]
        raise ConfigurationError("\n".join(lines))


def _has(content: Any, keys: tuple) -> bool:
    """Return whether nested mappings have a value at a path of keys, or a value other than a mapping before its end."""
    for key in keys:
        if not isinstance(content, Mapping):
            return True
        if key not in content:
            return False
        content = content[key]
    return True


def load_configuration(
    path: str | os.PathLike, overrides: Mapping[str, Any] | None = None, *, within: str | os.PathLike | None = None
) -> Configuration:
    """Read and check a configuration file and the files that it names.

    The text alone is checked first, because this finds most errors at once.

    Parameters
    ----------
    path : YAML file.
    overrides : values that replace those of the file, key by key, as given by `snakemake --config`.
    within : folder that must contain all files that it names, for files of strangers; None for any folder.

    Raises
    ------
    ConfigurationError
        If any key or file is wrong; the message has a line for each.
    """
    source = _Source(Path(path), read_yaml(Path(path)), overrides or {})
    written = merge(source.from_file, source.overrides)
    campaign, unusual = _check_text(source, written), unusual_values(written)
    text, confirmed = dump_yaml(written, str(path)), written.get(CONFIRMED)
    source.fail(_files_outside(campaign, within) if within is not None else ())
    topographies, unread = inspect_topographies(campaign)
    source.fail(itertools.chain(unread, campaign.measurement_problems()))
    campaign = campaign.with_topographies(topographies)
    for name, each in topographies.items():
        location = "surfaces", campaign.origin("surfaces", name)
        unusual += unusual_topography(location, campaign.surfaces[name], each.period, each.rms_slope)
    sticky = list(sticky_runs(campaign))
    # A contact may be sticky because of another unusual value.
    implausible = list(plausibility_problems(unusual, confirmed)) or plausibility_problems(sticky, confirmed)
    unusual += sticky
    source.fail(itertools.chain(campaign.problems(), implausible, needless_confirmations(unusual, confirmed)))
    accepted = [
        source.format(each.location, each.value, f"is unusual{each.source}, but confirmed; expected {each.usual}")
        for each in unusual
    ]
    return Configuration(campaign, text, str(path), (*campaign.warnings(), *accepted))


def _check_text(source: _Source, written: Mapping) -> Campaign:
    """Return the campaign of a text, before the files that it names are read."""

    def implausible():
        return plausibility_problems(unusual_values(written), written.get(CONFIRMED))

    def located(problems):
        return ((location_in_defaults(location, written), value, reason) for location, value, reason in problems)

    content = apply_defaults(written)
    if excess := excessive_size(content):
        raise ConfigurationError(f"{source.path}: {excess}; expected fewer")
    try:
        campaign = Campaign.model_validate(content)
    except ValidationError as error:
        source.fail(located(map(problem_of, error.errors())), implausible())
    campaign, problems = expand_design(campaign.resolve_paths(source.path.parent), content)
    source.fail(located(problems), implausible())
    source.fail(located(itertools.chain(campaign.problems(), implausible())))
    return campaign


def _named_files(campaign: Campaign) -> dict[tuple[str, str], str]:
    """Return the files that a campaign names, by section and entry."""
    files = {("surfaces", name): each.path for name, each in campaign.surfaces.items() if not each.random}
    return files | {("measurements", name): each.path for name, each in campaign.measurements.items()}


def _files_outside(campaign: Campaign, folder: str | os.PathLike) -> list[Problem]:
    """Report files of a campaign that are not in a folder, after resolving links."""
    return [
        ((section, campaign.origin(section, name), "path"), path, "is in another folder; expected files beside it")
        for (section, name), path in _named_files(campaign).items()
        if not Path(path).resolve().is_relative_to(Path(folder).resolve())
    ]


# Folder, beside the copy of a configuration with its results, of the files that it names.
INPUTS = "inputs"


def collect_inputs(configuration: Configuration) -> tuple[str, dict[str, str]]:
    """Return the text of a configuration as used, and the files to store beside it.

    Returns
    -------
    text : the configuration with the paths `inputs/<section>/<entry>/<name>` of its files.
    files : present paths of these files, by their paths in the text; without surfaces that no study uses.
    """
    campaign = configuration.campaign
    # Variants of a surface have its file.
    named = {key: path for key, path in _named_files(campaign).items() if campaign.origin(*key) == key[1]}
    if not named:
        return configuration.text, {}
    content = yaml.safe_load(configuration.text)
    surfaces = {each.surface for study in campaign.studies for each in campaign.contacts(study)}
    used = {("surfaces", campaign.origin("surfaces", name)) for name in surfaces}
    files = {}
    for (section, name), path in named.items():
        stored = str(PurePosixPath(INPUTS, section, name, Path(path).name))
        content[section][name] = (content[section][name] or {}) | {"path": stored}
        if section == "measurements" or (section, name) in used:
            files[stored] = path
    # Every surface has its own path now.
    (content.get("defaults") or {}).get("surfaces", {}).pop("path", None)
    return dump_yaml(content, configuration.origin), files
