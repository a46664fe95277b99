"""Check a deposit with the validators of other projects, without network.

    .venv-validators/bin/python tests/validators/validate.py DEPOSIT

DEPOSIT is its folder or its zip archive. It is verified first; validators read only a whole deposit. The program prints
one line for each validator; its status is 1 if one of them fails.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import functools
import io
import logging
import re
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from importlib import resources
from pathlib import Path
from typing import NamedTuple

# The package is not installed beside the validators.
sys.path.insert(0, str(Path(__file__).parents[2]))

CRATE = "ro-crate-metadata.json"
PROFILE = "ro-crate-1.1"
CONVENTIONS = "cf:1.11"
# Attributes by which a variable names others (CF 1.11, appendix A).
NAMING = "ancillary_variables bounds cell_measures climatology coordinates formula_terms grid_mapping".split()
# Functions that compliance-checker calls some thousand times for a file, each time searching all variables.
ASKED = (
    "auxiliary_coordinate_variables axis_variables cell_boundary_variables climatology_variable coordinate_variables "
    "geophysical_variables latitude_variables longitude_variables time_variable time_variables z_variables".split()
)


class Outcome(NamedTuple):
    """The result of a validator.

    Attributes
    ----------
    counted : what it checked, with numbers.
    problems, remarks : errors, and recommendations.
    """

    counted: str
    problems: list[str]
    remarks: tuple[str, ...] | list[str] = ()


def check_crate(folder: Path) -> Outcome:
    """roc-validator: the crate is an RO-Crate 1.1; what is only recommended is a remark."""
    from rocrate_validator import services
    from rocrate_validator.models import Severity

    with tempfile.TemporaryDirectory() as scratch:
        cache = Path(scratch, "cache")
        _cache_contexts(cache)
        settings = services.ValidationSettings(
            rocrate_uri=str(folder),
            profile_identifier=PROFILE,
            requirement_severity=Severity.RECOMMENDED,
            offline=True,
            cache_path=cache,
        )
        result = services.validate(settings)
        found: dict[Severity, list[str]] = {Severity.REQUIRED: [], Severity.RECOMMENDED: []}
        for issue in result.get_issues(Severity.RECOMMENDED):
            found[issue.severity].append(f"{issue.violatingEntity or './'}: {issue.message}")
        checks = len(result.executed_checks)
    return Outcome(
        f"{checks} checks of {PROFILE}", sorted(found[Severity.REQUIRED]), sorted(found[Severity.RECOMMENDED])
    )


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


def check_conventions(folder: Path) -> Outcome:
    """compliance-checker: every group of every netCDF file keeps to CF 1.11; what it only recommends is a remark."""
    paths = sorted(folder.rglob("*.nc"))
    with ProcessPoolExecutor(initializer=stay_off_the_network) as processes:
        answers = [answer for found in processes.map(_conventions_of, paths) for answer in found]
    problems, remarks = [], []
    for answer in answers:
        problems += [f"{answer.place.relative_to(folder)}: {problem}" for problem in answer.problems]
        remarks += [f"{answer.place.relative_to(folder)}: {remark}" for remark in answer.remarks]
    score, out_of = (sum(points) for points in zip(*(answer.points for answer in answers), strict=True))
    return Outcome(f"{score} of {out_of} points, {len(answers)} groups of {len(paths)} files", problems, remarks)


class Conformance(NamedTuple):
    """The verdict of compliance-checker on one group of a file."""

    place: Path
    points: tuple[int, int]
    problems: list[str]
    remarks: list[str]


def _conventions_of(path: Path) -> list[Conformance]:
    """CF of one netCDF file, group by group."""
    from compliance_checker.base import BaseCheck
    from compliance_checker.suite import CheckSuite

    remember_answers()
    suite = CheckSuite()
    suite.load_all_available_checkers()
    answers = []
    with tempfile.TemporaryDirectory() as scratch:
        for group, file in flat_files(path, Path(scratch)):
            with suite.load_dataset(str(file)) as data:
                results, failed = suite.run_all(data, [CONVENTIONS])[CONVENTIONS]
            problems, remarks = [f"{name} could not be run" for name in failed], []
            score, out_of = 0, 0
            for result in results:
                points = result.value if isinstance(result.value, tuple) else (int(bool(result.value)), 1)
                score, out_of = score + points[0], out_of + points[1]
                if points[0] < points[1]:
                    messages = problems if result.weight == BaseCheck.HIGH else remarks
                    messages += [f"{result.name}: {message}" for message in result.msgs or ["failed"]]
            answers.append(Conformance(path / group.strip("/"), (score, out_of), problems, remarks))
    return answers


@functools.cache
def remember_answers() -> None:
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


def stay_off_the_network() -> None:
    """From now on, refuse connections of this process to other machines, which attributes of files may cause.

    The attribute `standard_name_vocabulary`, for instance, makes compliance-checker download a table.
    """

    def refuse(event, arguments):
        abroad = event in ("socket.connect", "socket.sendto") and not isinstance(arguments[1], str | bytes)
        if abroad or event == "socket.getaddrinfo":
            raise PermissionError("validators have no network")

    sys.addaudithook(refuse)


VALIDATORS: dict[str, Callable[[Path], Outcome]] = {
    "roc-validator": check_crate,
    "compliance-checker": check_conventions,
}


def validate(folder: Path, names: list[str], most: int) -> bool:
    """Run validators and print their results; return True if none found a problem."""
    from icha.support.formatting import printable

    good = True
    for name in names:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            try:
                outcome = VALIDATORS[name](folder)
            except FileNotFoundError as error:
                outcome = Outcome("could not be run", [f"{error.filename} is missing"])
            except Exception as error:
                outcome = Outcome("could not be run", ["".join(traceback.format_exception(error)).strip()])
        good &= not outcome.problems
        verdict = "failed" if outcome.problems else "passed"
        print(f"{name}: {verdict}; {outcome.counted}, {len(outcome.problems)} problems, {len(outcome.remarks)} remarks")
        for kind, messages in (("problem", outcome.problems), ("remark", outcome.remarks)):
            for message in messages[:most]:
                print(f"  {kind}: {printable(message)}")
            if len(messages) > most:
                print(f"  … and {len(messages) - most} more (--all)")
    return good


def main() -> int:
    """Validate the deposit on the command line."""
    from icha.deposit.verify import DamagedDeposit, whole_deposit
    from icha.support.formatting import printable
    from icha.support.input_files import refuse_traps

    parser = argparse.ArgumentParser(
        description="Check a deposit with the validators of other projects, without network."
    )
    parser.add_argument("deposit", type=Path, help="a folder or a zip archive")
    parser.add_argument("--only", nargs="+", choices=VALIDATORS, default=list(VALIDATORS), metavar="NAME")
    parser.add_argument("--all", action="store_true", help="all messages, and not the first five of a kind")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    name = printable(arguments.deposit)
    try:
        with whole_deposit(arguments.deposit.absolute()) as folder:
            if not (folder / CRATE).is_file():
                sys.exit(f"{name}: is not a deposit, because it has no {CRATE}")
            for file in sorted(folder.rglob("*.nc")):
                try:
                    refuse_traps(file)
                except (OSError, ValueError) as error:
                    sys.exit(f"{name}: {printable(file.relative_to(folder))}: {printable(error)}")
            stay_off_the_network()
            return 0 if validate(folder, arguments.only, sys.maxsize if arguments.all else 5) else 1
    except DamagedDeposit as damaged:
        print(*damaged.args, sep="\n")
        sys.exit(f"{name}: is not whole, so no validator was run")
    except OSError as error:
        sys.exit(f"{name}: {printable(error)}")


if __name__ == "__main__":
    sys.exit(main())
