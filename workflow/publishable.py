"""Check whether a campaign can be published, before its results are computed."""

from pathlib import Path

from icha.configuration.load import Configuration
from icha.configuration.publication import missing_metadata
from icha.deposit.metadata import licence_problem
from icha.deposit.program import Source, program_source, refuse_other_environment


def publishable_source(configuration: Configuration, project: str) -> Source:
    """Return the source that a deposit will contain; end if metadata or locked packages are missing."""
    campaign = configuration.campaign
    problems = [f"{configuration.origin}: {line}" for line in missing_metadata(campaign.deposit_metadata())]
    if problem := licence_problem(campaign):
        problems.append(": ".join([configuration.origin, *problem]))
    try:
        refuse_other_environment(Path(project))
    except ValueError as error:
        problems.append(str(error))
    if problems:
        raise SystemExit("\n".join(["The campaign cannot be published:", *problems]))
    return program_source(project)
