"""Make the deposit of a campaign from its results."""

import sys
from pathlib import Path

from job import guarded


def publish(archive, *, results, files, named_files, project):
    """Write the deposit of `files` below the folder `results` to `archive`, and to the folder of that name beside it.

    `named_files` are the files that the configuration names, by their places beside the configuration as used.
    """
    # What is imported at the top is imported for every job of a campaign.
    from icha.configuration.load import load_configuration
    from icha.planning.plan import whole_cost
    from icha.publication.deposit import make_deposit
    from icha.publication.environment import refuse_other_environment
    from icha.publication.source import program_source

    refuse_other_environment(Path(project))
    used = "config.used.yaml"
    places = {file: str(Path(file).relative_to(results)) for file in files}
    given = {file: place for place, file in named_files.items()} | {f"{results}/{used}": used}
    made = {file: place for file, place in places.items() if place not in given.values()}
    campaign = load_configuration(Path(results, used)).campaign
    make_deposit(
        archive.removesuffix(".zip"),
        archive,
        results=results,
        files=places.values(),
        publication=campaign.published(),
        campaign=campaign,
        source=program_source(project),
        jobs=_recorded_jobs(Path(project, "workflow"), made, given),
        cost=whole_cost(campaign, Path(results)),
    )


def _recorded_jobs(workflow, made, given):
    # Beside the rules, which it belongs to, and not beside the scripts.
    sys.path.insert(0, str(workflow))
    from provenance import recorded_jobs

    return recorded_jobs(Path(".snakemake/metadata"), made, given, scripts=workflow / "scripts")


if "snakemake" in globals():
    with guarded(snakemake):
        publish(
            snakemake.output.archive,
            results=snakemake.params.results,
            files=snakemake.input,
            named_files=snakemake.params.named_files,
            project=snakemake.params.project,
        )
