"""Check a deposit with the validators of other projects, without network.

    .venv-validators/bin/python tests/validators/validate.py DEPOSIT [VALIDATOR]

DEPOSIT is its folder or its zip archive, which is verified first. The program prints the problems that each validator
finds; its status is 1 if there are any.
"""

from __future__ import annotations

import contextlib
import copy
import functools
import io
import logging
import re
import sys
import tempfile
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from importlib import resources
from pathlib import Path

# The package is not installed beside the validators.
sys.path.insert(0, str(Path(__file__).parents[2]))

# Attributes by which a variable names others (CF 1.11, appendix A).
NAMING = "ancillary_variables bounds cell_measures climatology coordinates formula_terms grid_mapping".split()
# Functions that compliance-checker calls some thousand times for a file, each time searching all variables.
ASKED = (
    "auxiliary_coordinate_variables axis_variables cell_boundary_variables climatology_variable coordinate_variables "
    "geophysical_variables latitude_variables longitude_variables time_variable time_variables z_variables".split()
)


def check_crate(folder: Path) -> list[str]:
    """Return what roc-validator finds: violations of RO-Crate 1.1, without its recommendations."""
    from rocrate_validator import services

    with tempfile.TemporaryDirectory() as scratch:
        cache = Path(scratch, "cache")
        _cache_contexts(cache)
        settings = services.ValidationSettings(
            rocrate_uri=str(folder), profile_identifier="ro-crate-1.1", offline=True, cache_path=cache
        )
        issues = services.validate(settings).get_issues()
        return sorted(f"{issue.violatingEntity or './'}: {issue.message}" for issue in issues)


def _cache_contexts(path: Path) -> None:
    """Put the JSON-LD context of RO-Crate 1.1, which comes with `rocrate`, into the validator's cache."""
    from requests.adapters import HTTPAdapter
    from requests_cache import CachedSession
    from urllib3 import HTTPResponse

    context = (resources.files("rocrate") / "data" / "ro-crate.jsonld").read_bytes()

    class Shelf(HTTPAdapter):
        """Answers every request with the context."""

        def send(self, request, **_):
            headers = {"Content-Type": "application/ld+json"}
            body = HTTPResponse(io.BytesIO(context), headers, status=200, preload_content=False)
            return self.build_response(request, body)

    with CachedSession(str(path), backend="sqlite", expire_after=-1) as session:
        session.mount("https://", Shelf())
        session.get("https://w3id.org/ro/crate/1.1/context").raise_for_status()


def check_conventions(folder: Path) -> list[str]:
    """Return what compliance-checker finds: violations of CF 1.11, by file and group, without its recommendations."""
    paths = sorted(folder.rglob("*.nc"))
    with ProcessPoolExecutor() as processes:
        found = processes.map(_violations, paths)
        return [
            f"{path.relative_to(folder)}{problem}" for path, each in zip(paths, found, strict=True) for problem in each
        ]


def _violations(path: Path) -> list[str]:
    """Return the violations of CF in one netCDF file, group by group."""
    from compliance_checker.base import BaseCheck
    from compliance_checker.suite import CheckSuite

    _remember_answers()
    suite, conventions, problems = CheckSuite(), "cf:1.11", []
    suite.load_all_available_checkers()
    with tempfile.TemporaryDirectory() as scratch:
        for group, file in flat_files(path, Path(scratch)):
            with suite.load_dataset(str(file)) as data:
                results, failed = suite.run_all(data, [conventions])[conventions]
            problems += [f"{group}: {name} could not be run" for name in failed]
            for result in (each for each in results if each.weight == BaseCheck.HIGH):
                points = result.value if isinstance(result.value, tuple) else (int(bool(result.value)), 1)
                if points[0] < points[1]:
                    problems += [f"{group}: {result.name}: {message}" for message in result.msgs or ["failed"]]
    return problems


@functools.cache
def _remember_answers() -> None:
    """Cache results of compliance-checker for a file, which does not change meanwhile."""
    from compliance_checker.cf import util

    for name in ASKED:
        remembered = functools.cache(getattr(util, f"get_{name}"))
        setattr(util, f"get_{name}", lambda data, remembered=remembered: copy.copy(remembered(data)))


def flat_files(path: Path, folder: Path) -> Iterator[tuple[str, Path]]:
    """Write every group with variables to a separate file, for tools that know no groups; yield its name and file.

    The file also has what the group inherits. A file without groups is yielded unchanged.
    """
    import netCDF4

    with netCDF4.Dataset(path) as data:
        if not data.groups:
            yield "/", path
            return
        pending = [data]
        while pending:
            group = pending.pop(0)
            pending += group.groups.values()
            if group.variables:
                target = folder / f"{path.stem}{group.path.replace('/', '-').rstrip('-')}.nc"
                with netCDF4.Dataset(target, "w") as flat:
                    _copy_group(group, flat)
                yield group.path, target


def _copy_group(group, flat) -> None:
    """Copy a group with the attributes of the groups above, and with the variables there that its own ones name."""
    ancestry = [group]
    while ancestry[0].parent is not None:
        ancestry.insert(0, ancestry[0].parent)
    known = {name: variable for above in ancestry for name, variable in above.variables.items()}
    variables, pending = dict(group.variables), list(group.variables.values())
    while pending:
        variable = pending.pop()
        texts = [str(variable.getncattr(key)) for key in NAMING if key in variable.ncattrs()]
        for name in {*re.findall(r"\w+", " ".join(texts)), *variable.dimensions} & set(known) - set(variables):
            variables[name] = known[name]
            pending.append(known[name])
    for above in ancestry:
        flat.setncatts({key: above.getncattr(key) for key in above.ncattrs()})
    for name, variable in variables.items():
        for dimension in variable.get_dims():
            if dimension.name not in flat.dimensions:
                flat.createDimension(dimension.name, None if dimension.isunlimited() else dimension.size)
        attributes = {key: variable.getncattr(key) for key in variable.ncattrs()}
        fill = attributes.pop("_FillValue", None)
        made = flat.createVariable(name, variable.datatype, variable.dimensions, fill_value=fill)
        made.setncatts(attributes)
        for both in (variable, made):
            both.set_auto_maskandscale(False)
            both.set_auto_chartostring(False)
        made[...] = variable[...]


VALIDATORS = {"roc-validator": check_crate, "compliance-checker": check_conventions}


def main(deposit: str, *names: str) -> int:
    """Verify and validate a deposit; return 1 if there are problems."""
    from icha.deposit.verify import DamagedDeposit, whole_deposit

    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    status = 0
    try:
        with whole_deposit(Path(deposit).absolute()) as folder:
            for name in names or VALIDATORS:
                with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                    problems = VALIDATORS[name](folder)
                print(f"{name}: {len(problems)} problems", *problems, sep="\n  ")
                status |= bool(problems)
    except DamagedDeposit as damaged:
        sys.exit("\n".join(["The deposit is damaged, so no validator was run:", *damaged.args]))
    return status


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
