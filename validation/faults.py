"""A small campaign that is disturbed, as campaigns are: tables of docs/faults.md.

    python -m validation.faults [--parts PART ...] [--trials N] [--seed N] [--scratch FOLDER]

Processes are killed, the power is cut, the disk is full, and files are damaged. Whatever happens, no result may be
there that is not, byte for byte, that of an undisturbed campaign; and the next call goes on to the end by itself, or
says what to do. The counts go to validation/results/faults.json. Needs Linux, and for disks the right to mount: power
cuts need root, full disks do with user namespaces. What is tried no longer keeps its counts of version 0.1.0; short
trials of more kinds are among the tests (tests/workflow/test_faults.py).
"""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import hashlib
import itertools
import json
import os
import random
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
from base64 import urlsafe_b64decode
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from validation.tables import Table, write_tables

HERE = Path(__file__).resolve().parent
KEPT = HERE / "results/faults.json"
CAMPAIGN = "faults"
CONFIGURATION = HERE / "faults.yaml"
RESULTS = f"results/{CAMPAIGN}"
# What the outside does not see of a campaign: measurements of time, and what is said on the way.
MEASURED = ("logs", "benchmarks", "checksums", "run_times.tsv")
# Seconds after which what is left of a killed call is taken for left behind.
MOMENT = 5.0
LONGEST = 600.0
WENT_ON, REFUSED = "went on", "said what to do"
WAYS = ("snakemake", "icha run")


class Trial(NamedTuple):
    """What was done to the campaign, how it ended, the words of the refusal if any, and what was wrong with it."""

    fault: str
    ended: str
    violations: list[str]
    said: str = ""


class Place:
    """A folder in which the campaign is run, by the program in `project`."""

    def __init__(self, project: Path, folder: Path, targets=("all", "publish")):
        """Make the folder."""
        self.project, self.folder, self.targets = project, folder, targets
        self.results = folder / RESULTS
        folder.mkdir(parents=True, exist_ok=True)
        # All processes of this place, and no others, have it in their environment.
        self.mark = f"ICHA_TEST_PLACE={folder}"

    def command(self, way: str) -> list[str]:
        """A call that makes everything; `icha run` calls Snakemake in its turn."""
        if way == "icha run":
            program = [sys.executable, "-c", "from icha.cli import main; main()", "run", str(CONFIGURATION)]
            program += ["--anyway"]  # on disks that are too small from the beginning, too
            return [*program, *self.targets, "--plain", "--cores", "2", "--directory", str(self.folder)]
        program = [sys.executable, "-m", "snakemake", *self.targets, "--cores", "2", "--configfile", str(CONFIGURATION)]
        return [*program, "--snakefile", str(self.project / "Snakefile"), "--directory", str(self.folder)]

    def start(self, way: str = "snakemake", *arguments: str, **variables: str) -> subprocess.Popen:
        """Start a call in a session of its own; what it says goes to a file outside of the place."""
        name, _, value = self.mark.partition("=")
        found = os.pathsep.join([str(self.project), str(self.project / "workflow/plugins")])
        said = tempfile.TemporaryFile("w+", encoding="utf-8")
        process = subprocess.Popen(
            [*self.command(way), *arguments],
            cwd=self.project,
            env=os.environ | {"PYTHONPATH": found, "OMP_NUM_THREADS": "1", name: value} | variables,
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        process.said = said
        return process

    def end(self, process: subprocess.Popen) -> tuple[int, str]:
        """Wait for a call; its status, and all that it said."""
        try:
            process.wait(LONGEST)
        except subprocess.TimeoutExpired:
            self.left_behind()
            process.wait()
        process.said.seek(0)
        # Wherever it is, what it says is the same.
        text = process.said.read().replace(f"{self.folder}/", "").replace(str(self.folder), "FOLDER")
        process.said.close()
        return process.returncode, text

    def run(self, way: str = "snakemake", *arguments: str, **variables: str) -> tuple[int, str]:
        """A call to its end: its status, and all that it said."""
        return self.end(self.start(way, *arguments, **variables))

    def processes(self) -> dict[int, tuple[int, list[str]]]:
        """Its processes that have not ended: their parents and command lines."""
        found = {}
        for entry in Path("/proc").iterdir():
            with contextlib.suppress(OSError):
                if entry.name.isdigit() and self.mark.encode() in (entry / "environ").read_bytes().split(b"\0"):
                    state, parent = (entry / "stat").read_text().rsplit(")", 1)[1].split()[:2]
                    line = (entry / "cmdline").read_bytes().decode(errors="replace").split("\0")
                    if state != "Z":
                        found[int(entry.name)] = int(parent), line
        return found

    def left_behind(self) -> list[str]:
        """What still runs a moment later, and is ended now."""
        until = time.monotonic() + MOMENT
        while (there := self.processes()) and time.monotonic() < until:
            time.sleep(0.05)
        for pid in there:
            kill_process(pid)
        return [f"{' '.join(line)[:200]} is left running" for _, line in there.values()]

    def server(self) -> list[int]:
        """The process with everything imported."""
        there = self.processes()
        warm = {pid for pid, (_, line) in there.items() if any("multiprocessing.forkserver" in part for part in line)}
        return [pid for pid in warm if there[pid][0] not in warm]

    def jobs(self) -> list[int]:
        """Processes in which jobs do their work: forks, and those that run by themselves."""
        there, server = self.processes(), set(self.server())
        alone = [pid for pid, (_, line) in there.items() if any("/.snakemake/scripts/" in part for part in line)]
        return sorted([*alone, *(pid for pid, (parent, _) in there.items() if parent in server)])

    def result_files(self) -> Iterator[str]:
        """All results that anybody would take for whole: no measurements, no hidden files, nothing set aside."""
        for file in sorted(self.results.rglob("*")):
            path = file.relative_to(self.results)
            hidden = any(part.startswith(".") for part in path.parts if part != ".zenodo.json")
            aside = any(".damaged" in part for part in path.parts)
            if file.is_file() and not hidden and not aside and path.parts[0] not in MEASURED:
                yield str(path)

    def contents(self) -> dict[str, str]:
        """Checksums of all results."""
        return {path: hashlib.sha256((self.results / path).read_bytes()).hexdigest() for path in self.result_files()}

    def times(self) -> dict[str, int]:
        """When each result was written, of the jobs that Snakemake knows to have ended well."""
        unfinished = []
        top = self.folder / ".snakemake/incomplete"
        for file in (each for each in top.rglob("*") if each.is_file()):
            name = "".join(part.removeprefix("@") for part in file.relative_to(top).parts)
            # All of a deposit is the result of one job.
            unfinished.append(urlsafe_b64decode(name).decode().removesuffix("SHA256SUMS"))
        deposit = self.results / f"publish/{CAMPAIGN}-1.0"
        if not (deposit / "SHA256SUMS").is_file():  # of a job that failed Snakemake removes this, its output
            unfinished.append(f"{RESULTS}/publish/{deposit.name}/")
        whole = (path for path in self.result_files() if not f"{RESULTS}/{path}".startswith(tuple(unfinished)))
        return {path: (self.results / path).stat().st_mtime_ns for path in whole}


def kill_process(pid: int) -> None:
    """End a process without giving it a chance to react."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


class Reference:
    """The campaign undisturbed: its bytes, and how long it takes."""

    def __init__(self, project: Path, scratch: Path, **options):
        """Run it."""
        self.project, self.scratch, self.options = project, scratch, options
        self.numbers = itertools.count()
        self.place = Place(project, scratch / "reference", **options)
        started = time.monotonic()
        status, said = self.place.run()
        self.seconds = time.monotonic() - started
        if status:
            raise SystemExit(f"The campaign does not run undisturbed:\n{said}")
        self.contents = self.place.contents()

    def empty(self, inside: Path | None = None) -> Place:
        """A place where nothing was computed yet."""
        return Place(self.project, inside or self.scratch / f"trial{next(self.numbers)}", **self.options)

    def copy(self) -> Place:
        """A place where everything was computed."""
        place = self.empty()
        shutil.copytree(self.place.folder, place.folder, dirs_exist_ok=True, symlinks=True)
        return place

    def half_written(self, place: Place) -> list[str]:
        """Results that are there but are not those of the reference."""
        there = place.contents()
        return [f"{path} passes for whole" for path in there if there[path] != self.contents.get(path)]

    def unequal(self, place: Place) -> list[str]:
        """What differs from the reference at the end, and what was left lying about."""
        there = place.contents()
        wrong = [f"{path} is missing" for path in self.contents if path not in there]
        rests = place.results.rglob("*.part")
        return [*wrong, *self.half_written(place), *(f"{rest.relative_to(place.results)} is left" for rest in rests)]

    def goes_on(self, place: Place, way: str = "snakemake") -> list[str]:
        """Give the same command again; what is wrong with its end."""
        status, said = place.run(way)
        return [*([f"the next call failed: {said[-500:]}"] if status else []), *self.unequal(place)]


def sentence(said: str, words: str) -> str:
    """The first line that holds some words."""
    return next((line.strip()[:200] for line in said.splitlines() if words in line), "")


# --- kills --------------------------------------------------------------------------------------------------------

VICTIMS = ("Snakemake", "the whole session", "a job", "the process that the jobs are forked from", "icha run")


def kill(place: Place, reference: Reference, victim: str, moment: float, chance: random.Random) -> list[str] | None:
    """Start the campaign and kill a process after `moment` seconds; what is wrong with what is left.

    None if the call ended before.
    """
    before = place.times()
    process = place.start("icha run" if victim == VICTIMS[4] else "snakemake")
    time.sleep(moment)
    found: list[int] = []
    while not found and process.poll() is None:
        found = place.jobs() if victim == VICTIMS[2] else place.server() if victim == VICTIMS[3] else [process.pid]
        time.sleep(0.0 if found else 0.02)
    if process.poll() is not None:
        place.end(process)
        return None
    if victim == VICTIMS[1]:
        os.killpg(process.pid, signal.SIGKILL)
    else:
        kill_process(chance.choice(found))
    place.end(process)
    return [*place.left_behind(), *reference.half_written(place), *computed_again(before, place)]


def computed_again(before: dict[str, int], place: Place) -> list[str]:
    """Results that were complete and are not as they were."""
    after = place.times()
    return [f"{path} was computed again" for path in before if after.get(path) != before[path]]


def kills(reference: Reference, place: Place, number: int, chance: random.Random) -> Trial:
    """Kill a process at a random moment; what is left goes on."""
    victim = VICTIMS[number % len(VICTIMS)]
    wrong = kill(place, reference, victim, chance.uniform(0.1, 0.7) * reference.seconds, chance)
    before = place.times()
    return Trial(victim, WENT_ON, [*(wrong or []), *reference.goes_on(place), *computed_again(before, place)])


# --- disks --------------------------------------------------------------------------------------------------------

# ext4 as it is hardest for programs: names may be on the disk before the data that they stand for.
HARDEST = "loop,noauto_da_alloc,data=writeback"
# EXT4_IOC_SHUTDOWN with EXT4_GOING_FLAGS_NOLOGFLUSH (Linux, fs/ext4/ext4.h): from now on nothing gets to the disk.
_SHUTDOWN, _WITHOUT_FLUSH = 0x8004587D, struct.pack("I", 2)


@contextlib.contextmanager
def power(folder: Path, image: Path):
    """A disk of its own at `folder`; gives functions that cut its power, and mount it again."""

    def mount():
        subprocess.run(["mount", "-o", HARDEST, str(image), str(folder)], check=True)

    def cut():
        top = os.open(folder, os.O_RDONLY)
        fcntl.ioctl(top, _SHUTDOWN, _WITHOUT_FLUSH)
        os.close(top)

    with image.open("wb") as file:
        file.truncate(2**28)
    subprocess.run(["mkfs.ext4", "-q", "-F", str(image)], check=True)
    folder.mkdir(parents=True, exist_ok=True)
    mount()
    try:
        yield cut, mount
    finally:
        unmount(folder)
        image.unlink()


def unmount(folder: Path) -> None:
    """Unmount a disk, once what was killed has let go of it."""
    until = time.monotonic() + LONGEST
    while subprocess.run(["umount", str(folder)], stderr=subprocess.DEVNULL).returncode:
        if time.monotonic() > until:
            raise SystemExit(f"{folder} cannot be unmounted")
        time.sleep(0.1)


def power_cuts(reference: Reference, place: Place, number: int, chance: random.Random) -> Trial:
    """Run on a disk whose power is cut at a random moment: what was not forced to it by then is lost."""
    with power(place.folder, place.folder.with_suffix(".disk")) as (cut, mount):
        process = place.start(WAYS[number % 2])
        time.sleep(chance.uniform(0.1, 0.95) * reference.seconds)
        cut()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        place.end(process)
        wrong = place.left_behind()
        unmount(place.folder)
        mount()
        wrong += [*reference.half_written(place), *reference.goes_on(place, WAYS[number % 2])]
    return Trial("the disk of the working folder", WENT_ON, wrong)


def full_disks(reference: Reference, place: Place, number: int, chance: random.Random) -> Trial:
    """Run with the results, or the whole folder, on a disk that is full from the start, or too small."""
    what, below = (("results", place.results.parent), ("working folder", place.folder))[number % 2]
    size = 4096 + 4096 * sum(1 + file.stat().st_size // 4096 for file in reference.place.folder.rglob("*"))
    room = 0.0 if number < 2 else chance.uniform(0.05, 0.7)
    below.mkdir(parents=True, exist_ok=True)
    options = f"size={max(int(room * size), 8192)},mode=755"
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "none", str(below)], check=True)
    try:
        status, said = place.run(WAYS[number // 2 % 2])
        words = sentence(said, "No space left on device")
        wrong = [*place.left_behind(), *reference.half_written(place)]
        wrong += [] if not status or words else [f"not told that the disk is full: {said[-500:]}"]
        subprocess.run(["mount", "-o", f"remount,size={4 * size + 2**24}", str(below)], check=True)
        wrong += reference.goes_on(place)
    finally:
        subprocess.run(["umount", "--lazy", str(below)], check=True)
    fault = f"{what}: full {'on the way' if room else 'from the start'}"
    return Trial(fault, REFUSED if status else WENT_ON, wrong, words)


# --- files --------------------------------------------------------------------------------------------------------

KINDS = {
    "surface": "surfaces/rough/seed1.nc",
    "run": "runs/load/rough/seed1/slope1/soft.nc",
    "boundary elements": "references/boundary_elements/truth/rough/seed1/slope1/bare/p0.01.nc",
    "theories": "references/rough.nc",
    "campaign dataset": f"dataset/{CAMPAIGN}.nc",
    "comparison": f"aggregated/{CAMPAIGN}.nc",
    "checks": "checks.json",
    "figure": "figures/fig10_model_error.png",
    "report": "report.html",
    "configuration as used": "config.used.yaml",
    "file of the deposit": f"publish/{CAMPAIGN}-1.0/dataset/{CAMPAIGN}.nc",
    "archive of the deposit": f"publish/{CAMPAIGN}-1.0.zip",
    "checksum record": "checksums/runs/load/rough/seed1/slope1/soft.nc.json",
}


def flip(file: Path, place: str, bit: int = 0) -> None:
    """Flip a bit of a file at the start, in the middle or at the end."""
    content = bytearray(file.read_bytes())
    content[{"start": 0, "middle": len(content) // 2, "end": -1}[place]] ^= 1 << bit
    file.write_bytes(content)


def damages(reference: Reference, place: Place, number: int, chance: random.Random) -> Trial:
    """Empty, cut or flip one file of a finished campaign, and run it again."""
    shutil.copytree(reference.place.folder, place.folder, dirs_exist_ok=True, symlinks=True)
    kind = list(KINDS)[number % len(KINDS)]
    file = place.results / KINDS[kind]
    how = chance.choice(("empty", "cut", "start", "middle", "end"))
    if how in ("empty", "cut"):
        os.truncate(file, 0 if how == "empty" else file.stat().st_size // 2)
    else:
        flip(file, how, chance.randrange(8))
    return Trial(kind, WENT_ON, [f"{how}: {wrong}" for wrong in reference.goes_on(place, WAYS[number % 2])])


# --- counts -------------------------------------------------------------------------------------------------------

PARTS = {
    "kill": kills,
    "power cut": power_cuts,
    "full disk": full_disks,
    "damage": damages,
}


def kept() -> dict:
    """What was counted."""
    return json.loads(KEPT.read_text(encoding="utf-8"))


def tables(found: dict) -> dict[str, Table]:
    """The counts of all parts, and of each by what was done."""

    def counts(rows):
        trials, on, refused = (sum(row[name] for row in rows) for name in ("trials", WENT_ON, REFUSED))
        return [str(number) for number in (trials, on, refused, trials - on - refused)]

    head = ["trials", WENT_ON, REFUSED, "wrong"]
    parts = {
        part: [row for row in found["rows"] if row["part"] == part]
        for part in dict.fromkeys(r["part"] for r in found["rows"])
    }
    all_parts = [[part, *counts(rows)] for part, rows in parts.items()]
    own = {
        part.replace(" ", "_").replace("-", "_"): [[row["fault"], *counts([row])] for row in rows]
        for part, rows in parts.items()
    }
    tables = {name: Table(["of what", *head], rows, numbers=True) for name, rows in own.items()}
    tables["all"] = Table(["disturbance", *head], all_parts, numbers=True)
    return {f"faults_{name}": table for name, table in tables.items()}


def counted(part: str, trials: list[Trial]) -> list[dict]:
    """What became of the trials of a part, by what was done."""
    rows: dict[str, dict] = {}
    for trial in trials:
        new = {
            "part": part,
            "fault": trial.fault,
            "trials": 0,
            WENT_ON: 0,
            REFUSED: 0,
            "messages": [],
            "violations": [],
        }
        row = rows.setdefault(trial.fault, new)
        row["trials"] += 1
        row["violations"] += trial.violations
        if not trial.violations:
            row[trial.ended] += 1
        if trial.said and trial.said not in row["messages"]:
            row["messages"].append(trial.said)
    return list(rows.values())


def main() -> None:
    """Make all trials, keep their counts, and write the tables."""
    parser = argparse.ArgumentParser("python -m validation.faults", description=__doc__.splitlines()[0])
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--trials", type=int, default=50, help="of each part")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scratch", type=Path, default=None, help="an empty folder")
    parser.add_argument("--in-namespace", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if not options.in_namespace:
        # Disks that are mounted here are seen by nobody else, and end with the process.
        unshare = ["unshare", "--mount", *([] if os.getuid() == 0 else ["--map-root-user"])]
        os.execvp(unshare[0], [*unshare, sys.executable, "-m", "validation.faults", *sys.argv[1:], "--in-namespace"])
    with tempfile.TemporaryDirectory(prefix="icha-faults-", dir=options.scratch) as name:
        scratch = Path(name)
        # The committed state of the program, so that edits while it runs do not matter.
        subprocess.run(["git", "clone", "--quiet", str(HERE.parent), str(scratch / "project")], check=True)
        reference = Reference(scratch / "project", scratch)
        for part in options.parts:
            chance, trials = random.Random(f"{options.seed} {part}"), []
            for number in range(options.trials):
                place = reference.empty()
                trials.append(PARTS[part](reference, place, number, chance))
                shutil.rmtree(place.folder, ignore_errors=True)
                print(part, *trials[-1], sep=": ", flush=True)
            found = kept()
            found["rows"] = [row for row in found["rows"] if row["part"] != part] + counted(part, trials)
            KEPT.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    write_tables(tables(kept()))


if __name__ == "__main__":
    main()
