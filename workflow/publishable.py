"""Whether a campaign can be published, before anything of it is computed."""

from pathlib import Path

from icha.configuration.load import Configuration
from icha.configuration.publication import missing_metadata
from icha.deposit.metadata import licence_problem
from icha.deposit.program import Source, program_source, refuse_other_environment


def publishable_source(configuration: Configuration, project: str, results: str) -> Source:
    """The source that a deposit is to hold.

    Ends the program with a message if metadata are missing, the source is not committed, or the lock not kept to,
    now or when any of the results was made.
    """
    publication = configuration.campaign.published()
    wrong = [f"{configuration.origin}: {line}" for line in missing_metadata(publication)]
    if problem := licence_problem(configuration.campaign):
        wrong.append(": ".join([configuration.origin, *problem]))
    try:
        source = program_source(project)
    except ValueError as error:
        wrong.append(str(error))
    try:
        refuse_other_environment(Path(project), Path(results))
    except ValueError as error:
        wrong.append(str(error))
    if wrong:
        raise SystemExit("\n".join(["The campaign cannot be published:", *wrong]))
    return source
