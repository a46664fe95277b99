"""Write the verdict on the checks, and the checksums of all results before figures and report.

The job fails if a check has failed, except for known failures.
"""

from job import job_context

from icha.analysis.checks import read_checks, refuse_unknown_failures
from icha.support.atomic_files import whole_file
from icha.support.checksums import write_checksums


def judge_results(checks, output, *, known):
    """Read the checks of a campaign and write the verdict: how many checks passed, and the known failures.

    `known` has a reason for each run that is known to fail. Raise ValueError with the failed checks of other runs.
    """
    found = read_checks(checks)
    failed = sum(not check.passed for check in found)
    try:
        refuse_unknown_failures(found, known)
    except ValueError as error:
        raise ValueError(f"{failed} of {len(found)} checks failed\n{error}") from None
    text = f"all {len(found)} checks passed\n"
    if failed:
        reasons = [f"{run}: {reason}\n" for run, reason in known.items()]
        text = "".join([f"{len(found) - failed} of {len(found)} checks passed; known failures:\n", *reasons])
    with whole_file(output) as temporary:
        temporary.write_text(text, encoding="utf-8")


if "snakemake" in globals():
    with job_context(snakemake):
        params, outputs = snakemake.params, snakemake.output
        judge_results(snakemake.input[0], outputs.verdict, known=params.known)
        write_checksums(params.results, [*params.files, outputs.verdict], outputs.checksums)
