"""Check the results of a campaign: identities, residuals, monotonicity, completeness."""

from job import job_context

from icha.analysis.checks import check_campaign, check_solution, worst, write_checks
from icha.datasets.files import read_campaign, read_dataset
from icha.datasets.labels import SolutionLabels


def check_results(dataset, solutions, output, *, labels, solution_labels):
    """Check the results of a campaign and write all checks to a file.

    Parameters
    ----------
    dataset : file of the campaign dataset.
    solutions : files of solutions by boundary elements at a finite range.
    output : file to write.
    labels : labels of the runs that the dataset should contain.
    solution_labels : labels of the solutions, in the order of the files.
    """
    checks = list(check_campaign(read_campaign(dataset), labels))
    for label, path in zip(solution_labels, solutions, strict=True):
        checks += check_solution(read_dataset(path), str(SolutionLabels(*label)))
    for check in worst(checks):
        print(f"{check.name}: {check.value:.3g}, at most {check.limit:g} ({check.subject})")
    write_checks(checks, output)


if "snakemake" in globals():
    with job_context(snakemake):
        check_results(
            snakemake.input.dataset,
            snakemake.input.solutions,
            snakemake.output[0],
            labels=snakemake.params.labels,
            solution_labels=snakemake.params.solution_labels,
        )
