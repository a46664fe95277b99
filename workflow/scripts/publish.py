"""Make the deposit of a campaign from its results."""

import sys
from pathlib import Path

from job import job_context


def publish(archive, *, results, files, named_files, project):
    """Write the deposit as a zip and as a folder.

    Parameters
    ----------
    archive : zip file to write.
    results : folder of the results.
    files : files of the results that the deposit includes.
    named_files : files that the configuration names, by their paths relative to the configuration as used.
    project : folder of the workflow.
    """
    # These imports are inside the function, because the fork server imports top-level modules for every campaign.
    from icha.configuration.load import load_configuration
    from icha.deposit.make import make_deposit, refuse_mixed
    from icha.deposit.program import program_source, refuse_other_environment
    from icha.planning.plan import whole_cost
    from icha.support.checksums import hash_parameters

    # `provenance` is a module of the rules, one folder above the scripts.
    sys.path.insert(0, str(Path(project, "workflow")))
    from provenance import recorded_jobs, recorded_parameters

    refuse_other_environment(Path(project), Path(results))
    used = "config.used.yaml"
    places = {file: str(Path(file).relative_to(results)) for file in files}
    given = {file: place for place, file in named_files.items()} | {f"{results}/{used}": used}
    made = {file: place for file, place in places.items() if place not in given.values()}
    campaign = load_configuration(Path(results, used)).campaign
    records = Path(".snakemake/metadata")
    jobs = recorded_jobs(records, made, given, scripts=Path(project, "workflow/scripts"))
    asked = {place: hash_parameters(recorded_parameters(records, file)) for file, place in made.items()}
    refuse_mixed(Path(results), campaign, asked)
    make_deposit(
        archive.removesuffix(".zip"),
        archive,
        results=results,
        files=places.values(),
        campaign=campaign,
        source=program_source(project),
        jobs=jobs,
        cost=whole_cost(campaign, Path(results)),
    )


if "snakemake" in globals():
    with job_context(snakemake):
        publish(
            snakemake.output.archive,
            results=snakemake.params.results,
            files=snakemake.input,
            named_files=snakemake.params.named_files,
            project=snakemake.params.project,
        )
