"""Whether a campaign can be published, before anything of it is computed."""

from pathlib import Path

from icha.configuration.load import Configuration
from icha.configuration.publication import needed


def refuse_unpublishable(configuration: Configuration, project: str) -> None:
    """End the program with a message if metadata are missing, the source is not committed, or the lock not kept to."""
    # For this target only.
    from icha.publication.environment import refuse_other_environment
    from icha.publication.licences import known_licence
    from icha.publication.source import committed_source

    publication = configuration.campaign.published()
    wrong = [f"{configuration.origin}: {line}" for line in needed(publication)]
    try:
        known_licence(publication.license)
    except ValueError as error:
        key = "publication.license" if configuration.campaign.publication.license else "license"
        wrong.append(f"{configuration.origin}: {key}: {publication.license!r} {error}")
    for refuse in (committed_source, refuse_other_environment):
        try:
            refuse(Path(project))
        except ValueError as error:
            wrong.append(str(error))
    if wrong:
        raise SystemExit("\n".join(["The campaign cannot be published:", *wrong]))
