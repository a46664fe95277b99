"""From the text of a configuration file to a campaign, or to a list of everything that is wrong with it.

`parse_configuration` reads the text alone, so that mistakes in it are found at once; `load_configuration` also inspects
the files that it names.
"""

import itertools
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

import yaml
from pydantic import ValidationError

from icha.configuration.campaign import Campaign
from icha.configuration.design import designed
from icha.configuration.errors import MOST_TOLD, ConfigurationError, line, problem_of
from icha.configuration.plausibility import (
    CONFIRMED,
    Unusual,
    needless_confirmations,
    plausibility_problems,
    sticky_runs,
    unusual_topography,
    unusual_values,
)
from icha.configuration.topographies import inspect_topographies
from icha.configuration.yaml_files import (
    dumped,
    excessive_defaults,
    merged,
    place_in_defaults,
    read_yaml,
    with_defaults,
)
from icha.support.values import Problem


@dataclass(frozen=True)
class Configuration:
    """A valid campaign and where it came from.

    Parameters
    ----------
    campaign : what the text means, in SI units and with the paths of its files resolved.
    text : the merged configuration as its author wrote it, units included.
    origin : its file.
    warnings : what is allowed but not advisable, or unusual.
    """

    campaign: Campaign
    text: str
    origin: str = field(compare=False)
    warnings: tuple[str, ...] = field(compare=False, default=())


@dataclass(frozen=True)
class Draft:
    """A configuration of which only the text is known.

    Parameters
    ----------
    path : its file.
    from_file : content of the file.
    overrides : values that replace those of the file.
    written : both together, without defaults.
    campaign : what the text means; None until it is known.
    """

    path: Path
    from_file: Mapping
    overrides: Mapping
    written: Mapping
    campaign: Campaign | None = None

    @property
    def confirmed(self) -> Any:
        """Keys of unusual values that are meant, as they are written."""
        return self.written.get(CONFIRMED)

    def worded(self, location: tuple, *what: Any) -> str:
        """A problem, or something unusual, as a line that says who gave the value: the file or the command line."""
        given = bool(location) and _holds(self.overrides, location)
        by_option = given or not _holds(self.from_file, location[:-1])
        return line("--config" if by_option else str(self.path), location, *what)

    def fail(self, problems: Iterable[Problem], unusual: Iterable[Unusual] = ()) -> None:
        """Raise ConfigurationError if there are problems.

        Unusual values are told with them, since they may be their cause.
        """
        found = list(itertools.islice(problems, MOST_TOLD + 1))
        if not found:
            return
        found = [(place_in_defaults(location, self.written), value, reason) for location, value, reason in found]
        slips = itertools.islice(plausibility_problems(unusual, self.confirmed), MOST_TOLD + 1)
        lines = list(dict.fromkeys(self.worded(*problem) for problem in [*found, *slips]))
        if len(lines) > MOST_TOLD:
            lines[MOST_TOLD:] = [f"{self.path}: more is wrong, which is told once this is right"]
        raise ConfigurationError("\n".join(lines))


def _holds(content: Any, keys: tuple) -> bool:
    """Whether nested mappings have a value at some keys, or anything else in the place of one of the mappings."""
    for key in keys:
        if not isinstance(content, Mapping):
            return True
        if key not in content:
            return False
        content = content[key]
    return True


def parse_configuration(path: str | os.PathLike, overrides: Mapping[str, Any] | None = None) -> Draft:
    """Read the text of a configuration and check all that can be checked without the files that it names.

    Parameters and errors as in `load_configuration`.
    """
    path = Path(path)
    from_file = read_yaml(path)
    written = merged(from_file, overrides or {})
    draft = Draft(path, from_file, overrides or {}, written)
    unusual = unusual_values(written)
    draft.fail(excessive_defaults(written), unusual)
    content = with_defaults(written)
    try:
        campaign = Campaign.model_validate(content)
    except ValidationError as error:
        draft.fail((problem_of(details, content) for details in error.errors()), unusual)
    campaign, design_problems = designed(campaign.with_files_beside(path.parent), content)
    draft.fail(design_problems, unusual)
    draft.fail(itertools.chain(campaign.problems(), plausibility_problems(unusual, draft.confirmed)))
    return Draft(path, from_file, overrides or {}, written, campaign)


def load_configuration(
    path: str | os.PathLike, overrides: Mapping[str, Any] | None = None, *, within: str | os.PathLike | None = None
) -> Configuration:
    """Read and check a configuration file and the files that it names.

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
    draft = parse_configuration(path, overrides)
    text, campaign = dumped(draft.written, str(draft.path)), draft.campaign
    draft.fail(_files_outside(campaign, within) if within is not None else ())
    topographies, unread = inspect_topographies(campaign)
    draft.fail(itertools.chain(unread, campaign.measurement_problems()))
    campaign = campaign.with_topographies(topographies)
    unusual = unusual_values(draft.written)
    for name, each in topographies.items():
        location = "surfaces", campaign.origin("surfaces", name)
        unusual += unusual_topography(location, campaign.surfaces[name], each.period, each.rms_slope)
    sticky, confirmed = list(sticky_runs(campaign)), draft.confirmed
    # A slip may be why a contact is sticky.
    slips = list(plausibility_problems(unusual, confirmed)) or plausibility_problems(sticky, confirmed)
    unusual += sticky
    draft.fail(itertools.chain(campaign.problems(), slips, needless_confirmations(unusual, confirmed)))
    meant = [
        draft.worded(each.location, each.value, f"is unusual{each.how}, but confirmed; usual: {each.usual}")
        for each in unusual
    ]
    return Configuration(campaign, text, str(draft.path), (*campaign.warnings(), *meant))


def _named_files(campaign: Campaign) -> dict[tuple[str, str], str]:
    """The files that a campaign names, by section and entry."""
    files = {("surfaces", name): each.path for name, each in campaign.surfaces.items() if not each.random}
    return files | {("measurements", name): each.path for name, each in campaign.measurements.items()}


def _files_outside(campaign: Campaign, folder: str | os.PathLike) -> list[Problem]:
    """Files that a campaign names and that do not lie in a folder, links followed."""
    return [
        ((section, campaign.origin(section, name), "path"), path, "lies elsewhere; allowed: files beside it")
        for (section, name), path in _named_files(campaign).items()
        if not Path(path).resolve().is_relative_to(Path(folder).resolve())
    ]


# Folder of the files that a configuration names, beside that configuration as it is kept with its results.
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
    # Variants of a surface have its file.
    named = {key: path for key, path in _named_files(campaign).items() if campaign.origin(*key) == key[1]}
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
