"""Say whether every check of the results passed; fail if one did not."""

from job import logged

from icha.checks import COMPLETED, read_checks
from icha.files import whole_file


def judge_results(checks, output):
    """Write the verdict on the file of checks to `output`.

    Raises
    ------
    ValueError
        Listing the checks that failed.
    """
    found = read_checks(checks)
    failed = [_said(check) for check in found if not check.passed]
    if failed:
        raise ValueError("\n".join([f"{len(failed)} of {len(found)} checks failed", *failed]))
    with whole_file(output) as temporary:
        temporary.write_text(f"all {len(found)} checks passed\n", encoding="utf-8")


def _said(check):
    if check.name == COMPLETED:
        return f"{check.subject}: the run failed: {check.description}"
    return f"{check.subject}: {check.name}: {check.value:.3g} ({check.description}); allowed: at most {check.limit:g}"


if "snakemake" in globals():
    with logged(snakemake.log[0]):
        judge_results(snakemake.input[0], snakemake.output[0])
