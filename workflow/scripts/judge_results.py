"""Say whether every check of the results passed; fail if one did not."""

from job import guarded

from icha.checks import read_checks, told
from icha.files import whole_file


def judge_results(checks, output):
    """Write the verdict on the file of checks to `output`.

    Raises
    ------
    ValueError
        Listing the checks that failed.
    """
    found = read_checks(checks)
    failed = [told(check) for check in found if not check.passed]
    if failed:
        raise ValueError("\n".join([f"{len(failed)} of {len(found)} checks failed", *failed]))
    with whole_file(output) as temporary:
        temporary.write_text(f"all {len(found)} checks passed\n", encoding="utf-8")


if "snakemake" in globals():
    with guarded(snakemake):
        judge_results(snakemake.input[0], snakemake.output[0])
