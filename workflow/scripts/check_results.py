"""Check the results of a campaign: identities, residuals, monotonicity, completeness."""

from job import job_context

from icha.analysis.checks import check_campaign, worst, write_checks
from icha.datasets.files import read_campaign


def check_results(dataset, output, *, labels):
    """Check the results of a campaign and write all checks to a file.

    Parameters
    ----------
    dataset : file of the campaign dataset.
    output : file to write.
    labels : labels of the runs that the dataset should contain.
    """
    checks = check_campaign(read_campaign(dataset), labels)
    for check in worst(checks):
        print(f"{check.name}: {check.value:.3g}, at most {check.limit:g} ({check.subject})")
    write_checks(checks, output)


if "snakemake" in globals():
    with job_context(snakemake):
        check_results(snakemake.input[0], snakemake.output[0], labels=snakemake.params.labels)
