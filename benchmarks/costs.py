"""Expected over measured: processor time, memory and disk by `icha.planning.costs` against small cases, one at a time.

python benchmarks/costs.py [--fit] [--kept] [--only KIND ...]

Cases are drawn at random (`benchmarks/cost_cases.py`), with some numbers for the group `fitted` and another for
`others`, which no formula and no constant was made for: after a look at them, draw others. `--fit` measures the group
`fitted` and writes `icha/planning/constants.py` as fitted to it. Without, the group `others` is measured, and both are
compared with what is expected. `--kept` takes what was measured before, as after a change of a formula; with `--only`
the rest of the constants and of what was measured stays. So after a change of a solver:

    python benchmarks/costs.py --fit --only loading "both ways" patches "patches both ways" campaign
    python benchmarks/costs.py

Single jobs are forks of this process, which has everything imported, on one thread. Campaigns are run by `icha run`,
and their time is that of all processes. Linux only. Writes benchmarks/results/costs.json.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

import argparse
import ctypes
import inspect
import json
import math
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, fields, replace
from pathlib import Path, PurePath

import numpy as np
import psutil
import yaml
from cost_cases import Draw
from scipy.optimize import least_squares

from icha.configuration.load import load_configuration
from icha.datasets.results import job_file
from icha.planning.constants import FITTED, Constants
from icha.planning.costs import Cost
from icha.planning.plan import TO_DO, Item, plan, time_on

RESULT = Path(__file__).parent / "results/costs.json"
# What the cases of a group are drawn with.
DRAWS = {"fitted": (1, 2, 3), "others": (5,)}
# Which constants are fitted to which kinds of cases.
FITS = {
    "making": ("surface",),
    "loading": ("loading",),
    "cycle": ("both ways",),
    "patches": ("patches",),
    "patch_cycle": ("patches both ways",),
    "finite_range": ("finite range", "finite range both ways", "error sources"),
    "gathering": ("theories", "dataset and checks", "figures", "report"),
    "workflow": ("campaign",),
}
# What small cases say nothing about: it is from larger surfaces and campaigns, those of docs/benchmarks.md.
NOT_FITTED = (
    "breadth",
    "crowd",
    "two_cores",
    "own_process",
    "planned",
    "dataset_run",
    "comparison_run",
    "checks_run",
    "error_run",
    "figure_run",
    "map_node",
    "report_run",
)
# Deviations of constants that the cases say nothing about, in units of those of a case.
_STAY = 0.1
_SUBREAPER = 36  # of prctl


class Row:
    """A case, or a job of one, with what was measured of it."""

    def __init__(self, kind: str, title: str, cost: Callable[[Constants], Cost], found: dict):
        self.kind, self.title, self.cost, self.found = kind, title, cost, found

    def ratios(self) -> dict[str, float]:
        """Expected over measured."""
        cost = self.cost(FITTED)
        expected = {"time": cost.seconds, "memory": cost.memory, "disk": cost.disk}
        measured = {"time": "seconds", "memory": "memory", "disk": "disk"}
        return {
            name: value / self.found[measured[name]] for name, value in expected.items() if measured[name] in self.found
        }


def shared() -> float:
    """Bytes that this process has in memory together with others."""
    here = psutil.Process().memory_full_info()
    return here.rss - here.uss


def measured_fork(work, folder) -> dict:
    """Processor time (s), peak of its own memory and size of the file (bytes) of `work` in a fork of this process."""
    file = folder / "out.nc"
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        start, said = time.process_time(), {}
        try:
            work(file)
        except Exception as error:
            said["failure"] = f"{type(error).__name__}: {error}"
        said["seconds"] = time.process_time() - start
        said["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 - shared()
        os.write(writing, json.dumps(said).encode())
        os._exit(0)
    os.close(writing)
    with open(reading) as pipe:
        found = json.load(pipe)
    os.waitpid(child, 0)
    if file.exists():
        found["disk"] = file.stat().st_size
        file.unlink()
    return found


def measured_campaign(configuration: Path, folder: Path) -> dict:
    """Processor time of `icha run` and of all that it starts, and what its jobs say they took, by their paths."""
    # What outlives the one that started it (the process that jobs are forked from) becomes a child of this one.
    ctypes.CDLL(None).prctl(_SUBREAPER, 1)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    icha = [sys.executable, "-c", "from icha.cli import main; main()"]
    command = [*icha, "run", str(configuration), "--directory", str(folder), "--plain"]
    said = subprocess.run(command, capture_output=True, text=True)
    try:
        while True:
            os.waitpid(-1, 0)
    except ChildProcessError:
        pass
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    found = {"seconds": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, "jobs": {}}
    if said.returncode:
        found["failure"] = said.stdout[-300:] + said.stderr[-300:]
    results = folder / "results" / configuration.stem
    for path in sorted((results / "benchmarks").rglob("*.jsonl")):
        record = json.loads(path.read_text().splitlines()[-1])
        found["jobs"][str(path.relative_to(results))] = {
            "seconds": record["cpu_time"],
            "memory": record["max_uss"] * 2**20,
        }
    return found


def import_all(folder: Path) -> None:
    """Do a case of most kinds here, so that forks have imported what is imported late, as jobs have."""
    first = {case.kind: case for case in Draw(0).cases()}
    for kind in ("surface", "loading", "patches", "finite range"):
        first[kind].work(folder / "first.nc")


def rows_of_campaign(title: str, file: Path, found: dict, folder: Path) -> Iterator[Row]:
    """A campaign as a whole, and the jobs that make something of its runs."""
    campaign = load_configuration(file).campaign

    def items(constants) -> list[Item]:
        return [replace(item, state=TO_DO) for item in plan(campaign, folder / "nothing", constants)]

    def whole(constants):
        return Cost(time_on(items(constants), 1, constants), 0.0, 0.0)

    yield Row("campaign", title, whole, {"seconds": found["seconds"]})
    for index, item in enumerate(items(FITTED)):
        path = PurePath(item.path)
        own = (
            job_file(item.path, "benchmarks", ".jsonl"),
            *(f"benchmarks/{n}.jsonl" for n in (path.stem, path.parts[0])),
        )
        took = next((found["jobs"][name] for name in own if name in found["jobs"]), None)
        if took and item.part in FITS["gathering"] and took["seconds"] > 0.05:
            yield Row(item.part, f"{title}: {item.path}", lambda c, index=index: items(c)[index].cost, took)


def rows(group: str, before: dict, now: dict, only) -> Iterator[Row]:
    """The cases of a group; what was measured `before` is not measured again, and what is goes to `now`."""
    for number in DRAWS[group]:
        draw = Draw(number)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            import_all(folder)
            for case in draw.cases():
                if only and case.kind not in only:
                    continue
                found = now[case.title] = before.get(case.title) or measured_fork(case.work, folder)
                if "failure" in found or "disk" not in found:
                    print(f"{case.title:<110} failed: {found.get('failure', 'no file')}", flush=True)
                    continue
                yield Row(case.kind, case.title, case.cost, found)
            for text in draw.campaigns() if not only or "campaign" in only else ():
                title = f"campaign {text['name']}: {text['title']}"
                file = folder / f"{text['name']}.yaml"
                file.write_text(yaml.safe_dump(text))
                found = before.get(title) or measured_campaign(file, folder)
                if "failure" in found:
                    print(f"{title:<110} failed: {found['failure']}", flush=True)
                    continue
                now[title] = found
                yield from rows_of_campaign(title, file, found, folder)


def fitted(constants: Constants, measured: list[Row]) -> Constants:
    """The constants that expect what was measured, by least squares of logarithms, kind by kind."""
    for section, kinds in FITS.items():
        own = [row for row in measured if row.kind in kinds]
        if not own:
            continue
        constants = _fitted(constants, section, own)
    return constants


def _fitted(constants, section, rows):
    start = getattr(constants, section)
    # Bytes are no matter of time.
    names = [each.name for each in fields(start) if each.name not in NOT_FITTED and getattr(start, each.name) < 1e6]
    origin = np.log([getattr(start, name) for name in names])

    def with_values(logs):
        values = {name: float(f"{math.exp(log):.2g}") for name, log in zip(names, logs, strict=True)}
        return replace(constants, **{section: replace(start, **values)})

    def deviations(logs):
        values = dict(zip(names, np.exp(logs), strict=True))
        trial = replace(constants, **{section: replace(start, **values)})
        off = [math.log(row.cost(trial).seconds / row.found["seconds"]) for row in rows]
        return np.concatenate([off, _STAY * (logs - origin)])

    return with_values(least_squares(deviations, origin, loss="soft_l1", f_scale=0.3).x)


def write(constants: Constants) -> None:
    """Write the values of constants into their module, line by line."""
    file = Path(inspect.getfile(Constants))
    section, lines = None, file.read_text(encoding="utf-8").splitlines()
    by_class = {type(values).__name__: asdict(values) for values in vars(constants).values()}
    for number, line in enumerate(lines):
        if line.startswith("class "):
            section = by_class.get(line.removeprefix("class ").removesuffix(":"), {})
        name, _, value = line.strip().partition(": float = ")
        if value and section.get(name, 1e6) < 1e6:
            lines[number] = f"    {name}: float = {section[name]:g}"
    file.write_text("\n".join([*lines, ""]), encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fit", action="store_true", help="measure what is fitted to, and write fitted constants")
    parser.add_argument("--kept", action="store_true", help="take what was measured before")
    parser.add_argument("--only", nargs="+", metavar="KIND", help="kinds of cases, such as loading or campaign")
    options = parser.parse_args()
    known = json.loads(RESULT.read_text()) if RESULT.exists() else {"measured": {}}
    before = known["measured"]
    now: dict[str, dict] = {}
    found: dict[str, list[Row]] = {}
    print(f"{'case':<110} {'expected':>8} {'measured':>8}   time memory  disk", flush=True)
    for group in ["fitted"] if options.fit else DRAWS:
        found[group] = []
        again = not options.kept and (options.fit or group == "others")
        for row in rows(group, {} if again else before, now, options.only):
            found[group].append(row)
            ratios = " ".join(f"{ratio:6.2f}" for ratio in row.ratios().values())
            print(f"{row.title[:110]:<110} {row.cost(FITTED).seconds:>7.2f}s {row.found['seconds']:>7.2f}s {ratios}")
    for group, own in found.items():
        for name in ("time", "memory", "disk"):
            ratios = [row.ratios()[name] for row in own if row.ratios().get(name)]
            if ratios:
                print(f"{group}, {name}: {summary(ratios)}")
    if options.fit:
        write(fitted(FITTED, found["fitted"]))
    elif not options.only:
        before = {}  # nothing is left that was not looked at
        known["cases"] = [
            {"group": group, "kind": row.kind, "case": row.title, "ratios": row.ratios()}
            for group, own in found.items()
            for row in own
        ]
    known["measured"] = before | now
    RESULT.write_text(json.dumps(known, indent=1) + "\n")


def summary(ratios) -> str:
    """Median, spread and ends of ratios."""
    within = sum(0.5 <= ratio <= 2 for ratio in ratios)
    return (
        f"median {statistics.median(ratios):.2f}, {min(ratios):.2f} to {max(ratios):.2f}, {within} of {len(ratios)} "
        f"({within / len(ratios):.0%}) within a factor of two"
    )


if __name__ == "__main__":
    main()
