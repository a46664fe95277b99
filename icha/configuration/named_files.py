"""The files that a configuration names, and the same configuration with these files beside it.

A configuration names its files as they lie where it was written, which is nobody else's place. Kept with its results it
names them in a folder beside itself, so that it can be used wherever both are.
"""

from pathlib import Path, PurePosixPath

import yaml

from icha.configuration.load import Configuration
from icha.configuration.yaml_files import dumped

FOLDER = "inputs"


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
        place = str(PurePosixPath(FOLDER, section, name, Path(path).name))
        content[section][name] = (content[section][name] or {}) | {"path": place}
        if section == "measurements" or (section, name) in used:
            files[place] = path
    # All surfaces have a path of their own now.
    (content.get("defaults") or {}).get("surfaces", {}).pop("path", None)
    return dumped(content, configuration.origin), files
