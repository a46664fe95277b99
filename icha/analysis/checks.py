"""Check campaigns with equalities and bounds that datasets must satisfy."""

import json
import os
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

import xarray as xr

from icha.checks.findings import Check, compare_with_limit
from icha.checks.run import check_variables
from icha.datasets.attributes import why_failed, why_no_result
from icha.datasets.campaign import run_labels, runs_of_status, variables_of_run
from icha.datasets.variables.campaign import MISSING
from icha.support.atomic_files import whole_file

# Name of the check that a run reached the end of its path and passed the checks of its job.
COMPLETED = "completed"


def check_campaign(tree: xr.DataTree) -> tuple[Check, ...]:
    """Check that a campaign dataset has all runs that were requested, and check every run (`check_run`).

    An incomplete run, or a run that failed the checks of its job, gets a single failed check that gives the reason.
    """
    checks = []
    for study, node in tree.children.items():
        missing = [str(labels) for labels in runs_of_status(node.to_dataset(), study, (MISSING,))]
        description = "number of requested runs that are missing"
        checks.append(compare_with_limit("no run missing", len(missing), 0, description, ", ".join(missing) or study))
    for labels in run_labels(tree):
        variables, attrs = variables_of_run(tree, labels)
        if reason := why_failed(attrs):
            checks.append(Check(COMPLETED, 1.0, 0.0, False, reason, str(labels)))
            # No result uses the values of a failed run, so these values are not checked.
            if why_no_result(attrs):
                continue
        else:
            end = attrs.get("beyond_model", "the run reached the end of its path")
            checks.append(Check(COMPLETED, 0.0, 0.0, True, end, str(labels)))
        if "beyond_model" in attrs and not variables["mean_separation"].size:
            continue  # no state was reached
        checks.extend(check_variables(variables, attrs, str(labels)))
    return tuple(checks)


def worst(checks: Iterable[Check]) -> tuple[Check, ...]:
    """Return the check with the largest value for each name; if checks of a name failed, only failed checks count."""
    found: dict[str, Check] = {}
    for check in checks:
        best = found.get(check.name)
        if best is None or (not check.passed, check.value) > (not best.passed, best.value):
            found[check.name] = check
    return tuple(found.values())


def describe_failure(check: Check) -> str:
    """Describe a failed check in one line, with its value and its limit."""
    if check.name == COMPLETED:
        return f"{check.subject}: the run failed: {check.description}"
    return f"{check.subject}: {check.name}: {check.value:.3g} ({check.description}); expected at most {check.limit:g}"


def refuse_unknown_failures(checks: Iterable[Check], known: Iterable[str]) -> None:
    """Raise ValueError if a run that is not in `known` failed, or if a run in `known` passed all checks."""
    failed = [check for check in checks if not check.passed]
    known = list(known)
    passing = sorted(set(known) - {check.subject for check in failed})
    lines = [describe_failure(check) for check in failed if check.subject not in known]
    lines += [f"{subject}: is listed as a known failure, but all checks of this run passed" for subject in passing]
    if lines:
        raise ValueError("\n".join(lines))


def write_checks(checks: Iterable[Check], path: str | os.PathLike) -> None:
    """Write checks to a JSON file."""
    rows = [asdict(check) for check in checks]
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(rows, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def read_checks(path: str | os.PathLike) -> tuple[Check, ...]:
    """Read checks from a JSON file."""
    return tuple(Check(**row) for row in json.loads(Path(path).read_text(encoding="utf-8")))
