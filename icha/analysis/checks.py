"""Checks of campaigns and of boundary-element solutions: identities and bounds, evaluated on the datasets alone."""

import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
import xarray as xr

from icha.asperity.cohesive_zone import MAX_STRENGTH_NUMBER
from icha.checks.findings import IDENTITY_LIMIT, Check, Finding, compare_with_limit, count_not_finite
from icha.checks.run import check_variables
from icha.datasets.campaign import run_labels, variables_of_run
from icha.datasets.labels import RunLabels
from icha.datasets.variables.campaign import MISSING
from icha.support.atomic_files import whole_file

# Largest relative error of a load; the search for its mean gap stops at 2e-4.
LOAD_LIMIT = 1e-3
# Name of the check that a run reached its end and passed its checks.
COMPLETED = "completed"


def check_campaign(tree: xr.DataTree, expected: Iterable[RunLabels | tuple] | None = None) -> tuple[Check, ...]:
    """Check a campaign dataset: every run present and complete, every variable described, `check_run` for each run.

    A run that is incomplete or failed its own checks has one check, which fails and has the reason as its description.

    Parameters
    ----------
    tree : the campaign dataset.
    expected : labels of the runs of the campaign; by default those of the dataset's own design.
    """
    checks = []

    def require_none(name, count, description, subject):
        checks.append(Check(name, float(count), 0.0, bool(count == 0), description, subject))

    present = run_labels(tree)
    if expected is not None:
        lacking = sorted({str(RunLabels(*labels)) for labels in expected} - {str(labels) for labels in present})
        description = "number of runs that the campaign asks for and lacks"
        require_none("all runs", len(lacking), description, ", ".join(lacking))
    for study, node in tree.children.items():
        missing = np.count_nonzero(node["status"].values == MISSING)
        require_none("no run missing", missing, "number of runs of the design that are missing", study)
        variables = node.to_dataset().variables.values()
        bare = sum("units" not in v.attrs or "long_name" not in v.attrs for v in variables)
        require_none("described", bare, "number of variables without units or long name", study)
    for labels in present:
        variables, attrs = variables_of_run(tree, labels)
        # The values of a failed run are not used, so its reason is the only finding.
        if reason := attrs.get("incomplete") or attrs.get("failed_checks"):
            checks.append(Check(COMPLETED, 1.0, 0.0, False, reason, str(labels)))
            continue
        end = attrs.get("beyond_model", "the run reached the end of its path")
        checks.append(Check(COMPLETED, 0.0, 0.0, True, end, str(labels)))
        checks.extend(check_variables(variables, attrs, str(labels)))
    return tuple(checks)


def check_solution(solution: xr.Dataset, subject: str = "") -> tuple[Check, ...]:
    """Check a boundary-element solution: finite, converged, resolved, at its load, with consistent distributions.

    Parameters
    ----------
    solution : a dataset as `icha.references.finite_range.finite_range_solution` returns it.
    subject : name of the solution in the findings.
    """
    findings = (*_check_solver(solution), *_check_identities(solution))
    return tuple(compare_with_limit(f"boundary elements: {name}", *rest, subject) for name, *rest in findings)


def _check_solver(solution) -> Iterator[Finding]:
    """Yield findings on values, convergence, load and resolution."""
    values = (variable.values for variable in solution.variables.values())
    yield "finite", count_not_finite(values), 0, "number of values that are not finite"
    yield (
        "converged",
        float(solution["residual"]) / float(solution["tolerance"]),
        1,
        "error of the solver over the one at which it was to stop",
    )
    load_error = abs(float(solution["nominal_pressure"]) / _target_pressure(solution) - 1)
    yield "load", load_error, LOAD_LIMIT, "mean traction against the load asked for"
    yield (
        "resolved",
        float(solution["strength_number"]),
        MAX_STRENGTH_NUMBER,
        "sqrt(dgamma dx/E*)/range of the grid, 0 without adhesion",
    )


def _target_pressure(solution):
    """Return the prescribed nominal pressure, Pa."""
    unit = float(solution["contact_modulus"]) * float(solution["rms_slope"])
    return float(solution["target_reduced_pressure"]) * unit


def _check_identities(solution) -> Iterator[Finding]:
    """Yield the errors of the identities between distributions, area and load."""
    gaps = solution["gap_density"].values * np.diff(solution["gap_bin_edges"].values)
    pressures = solution["pressure_density"].values * np.diff(solution["pressure_bin_edges"].values)
    loads = pressures * solution["pressure_bin_mean"].values
    area, nominal = float(solution["contact_area_fraction_raw"]), float(solution["nominal_pressure"])
    yield (
        "P(u) complete",
        abs(gaps.sum() + area - 1),
        IDENTITY_LIMIT,
        "integral of P(u) over u, plus the nodes in contact, against 1",
    )
    yield (
        "area from P(p)",
        abs(pressures.sum() - area) / max(area, np.finfo(float).tiny),
        IDENTITY_LIMIT,
        "integral of P(p) over p against the nodes in contact",
    )
    yield (
        "load from P(p)",
        abs(loads.sum() + float(solution["outside_pressure"]) - nominal)
        / max(np.abs(loads).sum(), _target_pressure(solution)),
        IDENTITY_LIMIT,
        "integral of p P(p) over p, plus the traction outside contact, against F/A0, over the sum of both signs",
    )


def worst(checks: Iterable[Check]) -> tuple[Check, ...]:
    """Select one check per name: a failed one if there is one, then the one with the largest value."""
    found: dict[str, Check] = {}
    for check in checks:
        best = found.get(check.name)
        if best is None or (not check.passed, check.value) > (not best.passed, best.value):
            found[check.name] = check
    return tuple(found.values())


def describe_failure(check: Check) -> str:
    """Describe a failed check in one line."""
    if check.name == COMPLETED:
        return f"{check.subject}: the run failed: {check.description}"
    return f"{check.subject}: {check.name}: {check.value:.3g} ({check.description}); expected at most {check.limit:g}"


def refuse_unknown_failures(checks: Iterable[Check], known: Iterable[str]) -> None:
    """Raise ValueError unless exactly the known subjects fail; it lists the others, and known ones that passed."""
    failed = [check for check in checks if not check.passed]
    known = list(known)
    passing = sorted(set(known) - {check.subject for check in failed})
    lines = [describe_failure(check) for check in failed if check.subject not in known]
    lines += [f"{subject}: is listed as a known failure, but all of its checks passed" for subject in passing]
    if lines:
        raise ValueError("\n".join(lines))


def write_checks(checks: Iterable[Check], path: str | os.PathLike) -> None:
    """Write findings to a JSON file."""
    rows = [asdict(check) for check in checks]
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(rows, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def read_checks(path: str | os.PathLike) -> tuple[Check, ...]:
    """Read findings from a JSON file."""
    return tuple(Check(**row) for row in json.loads(Path(path).read_text(encoding="utf-8")))
