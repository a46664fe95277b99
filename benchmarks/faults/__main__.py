"""Disturb a small campaign in every way that happens to campaigns, and see what becomes of it.

    python -m benchmarks.faults [--parts PART ...] [--trials N] [--seed N] [--scratch FOLDER]

Processes are killed, the power is cut, the disk is full, results are read-only, files are cut off and bits flipped,
results are those of other settings, folders have odd names, and two calls are made at once. Whatever happens, no
result may be there that is not, byte for byte, that of an undisturbed campaign; and the next call goes on to the end
by itself, or says what to do. The counts go to benchmarks/results/faults.json, and from there to docs/faults.md
(benchmarks/faults/page.py). Needs Linux, and for disks the right to mount: power cuts need root, disks that are full
or read-only do with user namespaces.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from benchmarks.faults.damages import damages
from benchmarks.faults.full_disks import full_disks
from benchmarks.faults.kills import kills
from benchmarks.faults.odd_places import odd_places
from benchmarks.faults.other_settings import other_settings
from benchmarks.faults.places import (
    MOMENT,
    REFUSED,
    WENT_ON,
    Reference,
    Trial,
)
from benchmarks.faults.power_cuts import power_cuts
from benchmarks.faults.read_only import read_onlys
from benchmarks.faults.two_at_once import both

BENCHMARKS = Path(__file__).resolve().parents[1]
PARTS = ("kill", "power cut", "full disk", "read-only", "odd place", "damage", "other settings", "two at once")


def trials_of(part: str, reference: Reference, trials: int, seed: int) -> Iterator[Trial]:
    """The trials of a part, the same ones for the same seed."""
    chance = random.Random(f"{seed} {part}")
    match part:
        case "kill":
            return kills(reference, trials, chance)
        case "power cut":
            return power_cuts(reference, trials, chance)
        case "odd place":
            return odd_places(reference)
        case "other settings":
            return other_settings(reference, chance)
        case "full disk":
            return full_disks(reference, chance)
        case "read-only":
            return read_onlys(reference)
        case "damage":
            return damages(reference, chance)
        case "two at once":
            return both(reference, 10, chance)
    raise ValueError(part)


def counts(trials: Iterable[Trial]) -> list[dict]:
    """What became of the trials, by what was done."""
    found: dict[tuple[str, str], dict] = {}
    for trial in trials:
        row = found.setdefault(
            (trial.part, trial.fault),
            {
                "part": trial.part,
                "fault": trial.fault,
                "trials": 0,
                WENT_ON: 0,
                REFUSED: 0,
                "messages": [],
                "violations": [],
            },
        )
        row["trials"] += 1
        if trial.violations:
            row["violations"] += list(trial.violations)
            continue
        row[trial.ended] += 1
        if trial.said and trial.said not in row["messages"]:
            row["messages"].append(trial.said)
    return list(found.values())


def table(rows: list[dict]) -> str:
    """The counts for people."""
    lines = [f"{'':<66}{'trials':>7}{'went on':>9}{'said':>6}{'wrong':>7}"]
    for row in rows:
        wrong = row["trials"] - row[WENT_ON] - row[REFUSED]
        what = f"{row['part']}: {row['fault']}"
        lines.append(f"{what:<66}{row['trials']:>7}{row[WENT_ON]:>9}{row[REFUSED]:>6}{wrong:>7}")
    return "\n".join(lines)


def clone(project: Path, folder: Path) -> Path:
    """The committed state of the program, so that edits while it runs do not matter."""
    subprocess.run(["git", "clone", "--quiet", str(project), str(folder)], check=True)
    return folder


def keep(found: dict) -> None:
    """Write what was found, in the place of what was found for the same parts before."""
    file = BENCHMARKS / "results/faults.json"
    rows = json.loads(file.read_text(encoding="utf-8"))["rows"] if file.is_file() else []
    new = {row["part"] for row in found["rows"]}
    rows = [row for row in rows if row["part"] not in new] + found["rows"]
    rows.sort(key=lambda row: PARTS.index(row["part"]))
    text = json.dumps(found | {"rows": rows}, indent=1, ensure_ascii=False)
    file.write_text(text + "\n", encoding="utf-8")


def main() -> None:
    """Make all trials and keep their counts."""
    parser = argparse.ArgumentParser("python -m benchmarks.faults", description=__doc__.splitlines()[0])
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--trials", type=int, default=52, help="kills, and power cuts")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scratch", type=Path, default=None, help="an empty folder")
    parser.add_argument("--in-namespace", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if not options.in_namespace:
        # Disks that are mounted here are seen by nobody else, and end with the process.
        unshare = ["unshare", "--mount", *([] if os.getuid() == 0 else ["--map-root-user"])]
        os.execvp(unshare[0], [*unshare, sys.executable, "-m", "benchmarks.faults", *sys.argv[1:], "--in-namespace"])
    scratch = Path(tempfile.mkdtemp(prefix="icha-faults-", dir=options.scratch))
    try:
        reference = Reference(clone(BENCHMARKS.parent, scratch / "project"), scratch)
        print(f"undisturbed: {reference.seconds:.1f} s, {len(reference.contents)} results", flush=True)
        rows = []
        for part in options.parts:
            made, started = [], time.monotonic()
            for trial in trials_of(part, reference, options.trials, options.seed):
                made.append(trial)
                print(f"{trial.part}: {trial.fault}: {trial.ended} {trial.said}", flush=True)
                for violation in trial.violations:
                    print(f"    WRONG: {violation}", flush=True)
            print(f"{part}: {len(made)} trials, {time.monotonic() - started:.0f} s", flush=True)
            rows += counts(made)
            keep({"seed": options.seed, "moment": MOMENT, "results": len(reference.contents), "rows": rows})
        print(table(rows))
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    if any(row["violations"] for row in rows):
        raise SystemExit("Not everything ended as wanted.")


if __name__ == "__main__":
    main()
