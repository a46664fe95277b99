"""Disturb a small campaign and check that it recovers: tables of docs/faults.md.

    python -m validation.faults [--parts PART ...] [--trials N] [--seed N]

Processes are killed, the power is cut, the disk is full, and files are damaged. Afterwards every result must be, byte
for byte, that of an undisturbed campaign, and the next call must finish the campaign or print what to do. Counts are
saved in validation/results/faults.json. Needs Linux and the right to mount disks: power cuts need root, full disks work
with user namespaces. Counts of other disturbances are those of version 0.1.0; tests/workflow/test_faults.py has short
trials of more kinds.
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
COUNTS = HERE / "results/faults.json"
CAMPAIGN = "faults"
CONFIGURATION = HERE / "faults.yaml"
RESULTS = f"results/{CAMPAIGN}"
# Files that may differ from call to call: times, and the output of jobs.
NOT_RESULTS = ("logs", "benchmarks", "checksums", "run_times.tsv")
# Seconds in which the processes of a killed call must end.
GRACE_PERIOD = 5.0
# Seconds that a call may take.
TIME_LIMIT = 600.0
RESUMED, REFUSED = "resumed", "refused"
CALLS = ("snakemake", "icha run")


class Trial(NamedTuple):
    """One disturbance of the campaign and its consequences.

    Attributes
    ----------
    fault : what was done.
    outcome : `RESUMED` or `REFUSED`.
    violations : requirements that were not met.
    output : the message of a refusal.
    """

    fault: str
    outcome: str
    violations: list[str]
    output: str = ""


class Place:
    """A folder in which the program in `project` runs the campaign."""

    def __init__(self, project: Path, folder: Path, targets=("all", "publish")):
        """Create the folder."""
        self.project, self.folder, self.targets = project, folder, targets
        self.results = folder / RESULTS
        folder.mkdir(parents=True, exist_ok=True)
        # An environment variable that only the processes of this place have.
        self.marker = f"ICHA_TEST_PLACE={folder}"

    def command(self, call: str) -> list[str]:
        """Return the command that makes all targets, with Snakemake itself or with `icha run`."""
        if call == "icha run":
            program = [sys.executable, "-c", "from icha.cli import main; main()", "run", str(CONFIGURATION)]
            program += ["--anyway"]  # also on disks that are too small
            return [*program, *self.targets, "--cores", "2", "--directory", str(self.folder)]
        program = [sys.executable, "-m", "snakemake", *self.targets, "--cores", "2", "--configfile", str(CONFIGURATION)]
        return [*program, "--snakefile", str(self.project / "Snakefile"), "--directory", str(self.folder)]

    def start(self, call: str = "snakemake", *arguments: str, **variables: str) -> subprocess.Popen:
        """Start a call in a new session; its output goes to a file outside of the place."""
        name, _, value = self.marker.partition("=")
        modules = os.pathsep.join([str(self.project), str(self.project / "workflow/plugins")])
        output = tempfile.TemporaryFile("w+", encoding="utf-8")
        process = subprocess.Popen(
            [*self.command(call), *arguments],
            cwd=self.project,
            env=os.environ | {"PYTHONPATH": modules, "OMP_NUM_THREADS": "1", name: value} | variables,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        process.output_file = output
        return process

    def end(self, process: subprocess.Popen) -> tuple[int, str]:
        """Wait for a call; return its exit status and its output."""
        try:
            process.wait(TIME_LIMIT)
        except subprocess.TimeoutExpired:
            self.end_remaining()
            process.wait()
        process.output_file.seek(0)
        text = process.output_file.read().replace(f"{self.folder}/", "").replace(str(self.folder), "FOLDER")
        process.output_file.close()
        return process.returncode, text

    def run(self, call: str = "snakemake", *arguments: str, **variables: str) -> tuple[int, str]:
        """Run a call; return its exit status and its output."""
        return self.end(self.start(call, *arguments, **variables))

    def processes(self) -> dict[int, tuple[int, list[str]]]:
        """Return the running processes of this place: parent and command line by process id."""
        found = {}
        for entry in Path("/proc").iterdir():
            with contextlib.suppress(OSError):
                if entry.name.isdigit() and self.marker.encode() in (entry / "environ").read_bytes().split(b"\0"):
                    state, parent = (entry / "stat").read_text().rsplit(")", 1)[1].split()[:2]
                    line = (entry / "cmdline").read_bytes().decode(errors="replace").split("\0")
                    if state != "Z":
                        found[int(entry.name)] = int(parent), line
        return found

    def end_remaining(self) -> list[str]:
        """Wait for the processes of this place, kill those that remain, and return a line about each."""
        until = time.monotonic() + GRACE_PERIOD
        while (remaining := self.processes()) and time.monotonic() < until:
            time.sleep(0.05)
        for pid in remaining:
            kill_process(pid)
        return [f"{' '.join(line)[:200]} is still running" for _, line in remaining.values()]

    def fork_servers(self) -> list[int]:
        """Return the processes from which jobs are forked."""
        processes = self.processes()
        forks = {
            pid for pid, (_, line) in processes.items() if any("multiprocessing.forkserver" in word for word in line)
        }
        return [pid for pid in forks if processes[pid][0] not in forks]

    def jobs(self) -> list[int]:
        """Return the processes of jobs: forks, and scripts that run by themselves."""
        processes, servers = self.processes(), set(self.fork_servers())
        scripts = [pid for pid, (_, line) in processes.items() if any("/.snakemake/scripts/" in word for word in line)]
        return sorted([*scripts, *(pid for pid, (parent, _) in processes.items() if parent in servers)])

    def result_files(self) -> Iterator[str]:
        """Yield the paths of all results: no measurements, no hidden files, no damaged files."""
        for file in sorted(self.results.rglob("*")):
            path = file.relative_to(self.results)
            hidden = any(name.startswith(".") for name in path.parts if name != ".zenodo.json")
            damaged = any(".damaged" in name for name in path.parts)
            if file.is_file() and not hidden and not damaged and path.parts[0] not in NOT_RESULTS:
                yield str(path)

    def contents(self) -> dict[str, str]:
        """Return the checksums of all results."""
        return {path: hashlib.sha256((self.results / path).read_bytes()).hexdigest() for path in self.result_files()}

    def times(self) -> dict[str, int]:
        """Return the modification times of the results whose jobs Snakemake has recorded as complete."""
        unfinished = []
        top = self.folder / ".snakemake/incomplete"
        for file in (each for each in top.rglob("*") if each.is_file()):
            name = "".join(name.removeprefix("@") for name in file.relative_to(top).parts)
            # A whole deposit is the result of one job.
            unfinished.append(urlsafe_b64decode(name).decode().removesuffix("SHA256SUMS"))
        deposit = self.results / f"publish/{CAMPAIGN}-1.0"
        if not (deposit / "SHA256SUMS").is_file():  # Snakemake removes it if the job failed
            unfinished.append(f"{RESULTS}/publish/{deposit.name}/")
        complete = (path for path in self.result_files() if not f"{RESULTS}/{path}".startswith(tuple(unfinished)))
        return {path: (self.results / path).stat().st_mtime_ns for path in complete}


def kill_process(pid: int) -> None:
    """Kill a process with SIGKILL."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


class Reference:
    """The undisturbed campaign: its bytes and its duration."""

    def __init__(self, project: Path, scratch: Path, **options):
        """Run it."""
        self.project, self.scratch, self.options = project, scratch, options
        self.numbers = itertools.count()
        self.place = Place(project, scratch / "reference", **options)
        started = time.monotonic()
        status, output = self.place.run()
        self.seconds = time.monotonic() - started
        if status:
            raise SystemExit(f"The campaign does not run undisturbed:\n{output}")
        self.contents = self.place.contents()

    def empty(self, inside: Path | None = None) -> Place:
        """Return a new place without results."""
        return Place(self.project, inside or self.scratch / f"trial{next(self.numbers)}", **self.options)

    def copy(self) -> Place:
        """Return a new place with all results."""
        place = self.empty()
        shutil.copytree(self.place.folder, place.folder, dirs_exist_ok=True, symlinks=True)
        return place

    def foreign_results(self, place: Place) -> list[str]:
        """Return the results whose bytes differ from those of the reference."""
        contents = place.contents()
        return [f"{path} has other bytes" for path in contents if contents[path] != self.contents.get(path)]

    def differences(self, place: Place) -> list[str]:
        """Return all differences from the reference: missing and foreign results, and temporary files."""
        contents = place.contents()
        missing = [f"{path} is missing" for path in self.contents if path not in contents]
        temporary = [f"{file.relative_to(place.results)} is temporary" for file in place.results.rglob("*.part")]
        return [*missing, *self.foreign_results(place), *temporary]

    def resume(self, place: Place, call: str = "snakemake") -> list[str]:
        """Give the same command again; return a failure of it and all differences."""
        status, output = place.run(call)
        return [*([f"the next call failed: {output[-500:]}"] if status else []), *self.differences(place)]


# --- kills --------------------------------------------------------------------------------------------------------

VICTIMS = ("Snakemake", "the whole session", "a job", "the process that the jobs are forked from", "icha run")


def kill(place: Place, reference: Reference, victim: str, moment: float, chance: random.Random) -> list[str] | None:
    """Start the campaign and kill a process after `moment` seconds; return the violations.

    Returns None if the call ended before.
    """
    before = place.times()
    process = place.start("icha run" if victim == VICTIMS[4] else "snakemake")
    time.sleep(moment)
    found: list[int] = []
    while not found and process.poll() is None:
        found = (
            place.jobs() if victim == VICTIMS[2] else place.fork_servers() if victim == VICTIMS[3] else [process.pid]
        )
        time.sleep(0.0 if found else 0.02)
    if process.poll() is not None:
        place.end(process)
        return None
    if victim == VICTIMS[1]:
        os.killpg(process.pid, signal.SIGKILL)
    else:
        kill_process(chance.choice(found))
    place.end(process)
    return [*place.end_remaining(), *reference.foreign_results(place), *recomputed(before, place)]


def recomputed(before: dict[str, int], place: Place) -> list[str]:
    """Return the complete results that were written again."""
    after = place.times()
    return [f"{path} was recomputed" for path in before if after.get(path) != before[path]]


def disturb_by_kill(reference: Reference, place: Place, number: int, chance: random.Random) -> Trial:
    """Kill a process at a random moment, and resume."""
    victim = VICTIMS[number % len(VICTIMS)]
    wrong = kill(place, reference, victim, chance.uniform(0.1, 0.7) * reference.seconds, chance)
    before = place.times()
    return Trial(victim, RESUMED, [*(wrong or []), *reference.resume(place), *recomputed(before, place)])


# --- disks --------------------------------------------------------------------------------------------------------

# The least safe mode of ext4: a file may have its new name on the disk before its data.
MOUNT_OPTIONS = "loop,noauto_da_alloc,data=writeback"
# EXT4_IOC_SHUTDOWN with EXT4_GOING_FLAGS_NOLOGFLUSH (Linux, fs/ext4/ext4.h): nothing more reaches the disk.
_SHUTDOWN, _WITHOUT_FLUSH = 0x8004587D, struct.pack("I", 2)


@contextlib.contextmanager
def disk_with_power(folder: Path, image: Path):
    """Mount a separate disk at `folder`; yield functions that cut its power and mount it again."""

    def mount():
        subprocess.run(["mount", "-o", MOUNT_OPTIONS, str(image), str(folder)], check=True)

    def cut():
        descriptor = os.open(folder, os.O_RDONLY)
        fcntl.ioctl(descriptor, _SHUTDOWN, _WITHOUT_FLUSH)
        os.close(descriptor)

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
    """Unmount a disk as soon as the killed processes have released it."""
    until = time.monotonic() + TIME_LIMIT
    while subprocess.run(["umount", str(folder)], stderr=subprocess.DEVNULL).returncode:
        if time.monotonic() > until:
            raise SystemExit(f"{folder} cannot be unmounted")
        time.sleep(0.1)


def disturb_by_power_cut(reference: Reference, place: Place, number: int, chance: random.Random) -> Trial:
    """Run on a disk whose power is cut at a random moment."""
    with disk_with_power(place.folder, place.folder.with_suffix(".disk")) as (cut, mount):
        process = place.start(CALLS[number % 2])
        time.sleep(chance.uniform(0.1, 0.95) * reference.seconds)
        cut()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        place.end(process)
        wrong = place.end_remaining()
        unmount(place.folder)
        mount()
        wrong += [*reference.foreign_results(place), *reference.resume(place, CALLS[number % 2])]
    return Trial("the disk of the working folder", RESUMED, wrong)


def disturb_by_full_disk(reference: Reference, place: Place, number: int, chance: random.Random) -> Trial:
    """Run with the results, or the whole folder, on a disk that is full from the start, or too small."""
    name, folder = (("results", place.results.parent), ("working folder", place.folder))[number % 2]
    size = 4096 + 4096 * sum(1 + file.stat().st_size // 4096 for file in reference.place.folder.rglob("*"))
    room = 0.0 if number < 2 else chance.uniform(0.05, 0.7)
    folder.mkdir(parents=True, exist_ok=True)
    options = f"size={max(int(room * size), 8192)},mode=755"
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "none", str(folder)], check=True)
    try:
        status, output = place.run(CALLS[number // 2 % 2])
        words = next((line.strip()[:200] for line in output.splitlines() if "No space left on device" in line), "")
        wrong = [*place.end_remaining(), *reference.foreign_results(place)]
        wrong += [] if not status or words else [f"no message about the full disk: {output[-500:]}"]
        subprocess.run(["mount", "-o", f"remount,size={4 * size + 2**24}", str(folder)], check=True)
        wrong += reference.resume(place)
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)
    fault = f"{name}: full {'during the run' if room else 'from the start'}"
    return Trial(fault, REFUSED if status else RESUMED, wrong, words)


# --- files --------------------------------------------------------------------------------------------------------

KINDS = {
    "surface": "surfaces/rough/seed1.nc",
    "run": "runs/load/rough/seed1/slope1/soft.nc",
    "boundary elements": "runs/load/rough/seed1/slope1/boundary_elements/soft.nc",
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


def disturb_by_damage(reference: Reference, place: Place, number: int, chance: random.Random) -> Trial:
    """Empty, cut or flip one file of a finished campaign, and run it again."""
    shutil.copytree(reference.place.folder, place.folder, dirs_exist_ok=True, symlinks=True)
    kind = list(KINDS)[number % len(KINDS)]
    file = place.results / KINDS[kind]
    how = chance.choice(("empty", "cut", "start", "middle", "end"))
    if how in ("empty", "cut"):
        os.truncate(file, 0 if how == "empty" else file.stat().st_size // 2)
    else:
        flip(file, how, chance.randrange(8))
    return Trial(kind, RESUMED, [f"{how}: {wrong}" for wrong in reference.resume(place, CALLS[number % 2])])


# --- counts -------------------------------------------------------------------------------------------------------

PARTS = {
    "kill": disturb_by_kill,
    "power cut": disturb_by_power_cut,
    "full disk": disturb_by_full_disk,
    "damage": disturb_by_damage,
}


def read_counts() -> dict:
    """Read the counts of all trials."""
    return json.loads(COUNTS.read_text(encoding="utf-8"))


def tables(found: dict) -> dict[str, Table]:
    """Return the tables of all parts: trials by outcome for each fault."""

    def counts(rows):
        trials, resumed, refused = (sum(row[name] for row in rows) for name in ("trials", RESUMED, REFUSED))
        return [str(number) for number in (trials, resumed, refused, trials - resumed - refused)]

    head = ["trials", RESUMED, REFUSED, "wrong"]
    parts: dict[str, list[dict]] = {}
    for row in found["rows"]:
        parts.setdefault(row["part"], []).append(row)
    tables = {
        "all": Table(["disturbance", *head], [[part, *counts(rows)] for part, rows in parts.items()], numbers=True)
    }
    for part, rows in parts.items():
        name = part.replace(" ", "_").replace("-", "_")
        tables[name] = Table(["fault", *head], [[row["fault"], *counts([row])] for row in rows], numbers=True)
    return {f"faults_{name}": table for name, table in tables.items()}


def count_trials(part: str, trials: list[Trial]) -> list[dict]:
    """Count the outcomes of the trials of a part for each fault."""
    rows: dict[str, dict] = {}
    for trial in trials:
        new = {"part": part, "fault": trial.fault, "messages": [], "violations": []}
        new |= dict.fromkeys(("trials", RESUMED, REFUSED), 0)
        row = rows.setdefault(trial.fault, new)
        row["trials"] += 1
        row["violations"] += trial.violations
        if not trial.violations:
            row[trial.outcome] += 1
        if trial.output and trial.output not in row["messages"]:
            row["messages"].append(trial.output)
    return list(rows.values())


def main() -> None:
    """Make all trials, save their counts, and write the tables."""
    parser = argparse.ArgumentParser("python -m validation.faults", description=__doc__.splitlines()[0])
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--trials", type=int, default=50, help="of each part")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--in-namespace", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if not options.in_namespace:
        # In a mount namespace no other process sees the disks, and they end with this process.
        unshare = ["unshare", "--mount", *([] if os.getuid() == 0 else ["--map-root-user"])]
        os.execvp(unshare[0], [*unshare, sys.executable, "-m", "validation.faults", *sys.argv[1:], "--in-namespace"])
    with tempfile.TemporaryDirectory(prefix="icha-faults-") as name:
        scratch = Path(name)
        # The committed state of the program, so that edits during the trials have no effect.
        subprocess.run(["git", "clone", "--quiet", str(HERE.parent), str(scratch / "project")], check=True)
        reference = Reference(scratch / "project", scratch)
        for part in options.parts:
            chance, trials = random.Random(f"{options.seed} {part}"), []
            for number in range(options.trials):
                place = reference.empty()
                trials.append(PARTS[part](reference, place, number, chance))
                shutil.rmtree(place.folder, ignore_errors=True)
                print(part, *trials[-1], sep=": ", flush=True)
            found = read_counts()
            found["rows"] = [row for row in found["rows"] if row["part"] != part] + count_trials(part, trials)
            COUNTS.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    write_tables(tables(read_counts()))


if __name__ == "__main__":
    main()
