"""Check the results of a campaign: identities, residuals, monotonicity, completeness."""

from job import logged

from icha.checks import check_campaign, worst, write_checks
from icha.records import read_campaign


def check_results(dataset, output, *, labels):
    """Write all checks of the campaign dataset, which should hold the runs of the given labels, to `output`."""
    checks = check_campaign(read_campaign(dataset), labels)
    for check in worst(checks):
        print(f"{check.name}: {check.value:.3g}, at most {check.limit:g} ({check.subject})")
    write_checks(checks, output)


if "snakemake" in globals():
    with logged(snakemake.log[0]):
        check_results(snakemake.input[0], snakemake.output[0], labels=snakemake.params.labels)
