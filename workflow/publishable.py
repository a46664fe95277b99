"""Whether a campaign can be published, before anything of it is computed."""

from pathlib import Path

from icha.configuration.load import Configuration
from icha.configuration.publication import needed
from icha.publication.environment import refuse_other_environment
from icha.publication.licences import known_licence
from icha.publication.source import Source, committed_source


def publishable_source(configuration: Configuration, project: str) -> Source:
    """The source that a deposit is to hold.

    Ends the program with a message if metadata are missing, the source is not committed, or the lock not kept to.
    """
    publication = configuration.campaign.published()
    wrong = [f"{configuration.origin}: {line}" for line in needed(publication)]
    try:
        known_licence(publication.license)
    except ValueError as error:
        key = "publication.license" if configuration.campaign.publication.license else "license"
        wrong.append(f"{configuration.origin}: {key}: {publication.license!r} {error}")
    try:
        source = committed_source(project)
    except ValueError as error:
        wrong.append(str(error))
    try:
        refuse_other_environment(Path(project))
    except ValueError as error:
        wrong.append(str(error))
    if wrong:
        raise SystemExit("\n".join(["The campaign cannot be published:", *wrong]))
    return source
