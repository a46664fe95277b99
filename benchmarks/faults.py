"""Disturb a small campaign in every way that happens to campaigns, and see what becomes of it.

    python benchmarks/faults.py [--parts PART ...] [--trials N] [--seed N] [--scratch FOLDER]

Processes are killed, the power is cut, the disk is full, results are read-only, files are cut off and bits flipped,
results are those of other settings, folders have odd names, and two calls are made at once. Whatever happens, no
result may be there that is not, byte for byte, that of an undisturbed campaign; and the next call goes on to the end
by itself, or says what to do. The counts go to benchmarks/results/faults.json, and from there to docs/faults.md
(benchmarks/faults_page.py). Needs Linux, and for disks the right to mount: power cuts need root, disks that are full
or read-only do with user namespaces.
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
from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

HERE = Path(__file__).resolve().parent
CAMPAIGN = "faults"
RESULTS = f"results/{CAMPAIGN}"
# What the outside sees of a campaign: everything but measurements of time, and what is said on the way.
MEASURED = ("logs", "benchmarks", "checksums", "run_times.tsv")
# Seconds after which what is left of a killed call is taken for left behind.
MOMENT = 5.0
LONGEST = 600.0
WENT_ON, REFUSED = "went on", "said what to do"
WAYS = ("snakemake", "icha run")


@dataclass(frozen=True)
class Trial:
    """What was done to the campaign, how it ended, the words of the refusal if any, and what was wrong with it."""

    part: str
    fault: str
    ended: str
    said: str = ""
    violations: tuple[str, ...] = ()


class Place:
    """A folder in which the campaign is run, by the program in `project`."""

    def __init__(self, project: Path, folder: Path, targets=("all", "publish"), configuration=HERE / "faults.yaml"):
        self.project, self.folder, self.targets, self.configuration = project, folder, targets, configuration
        folder.mkdir(parents=True, exist_ok=True)
        # All processes of this place, and no others, have it in their environment.
        self.mark = f"ICHA_TEST_PLACE={folder}"

    @property
    def results(self) -> Path:
        return self.folder / RESULTS

    def command(self, way: str = "snakemake", *arguments: str) -> list[str]:
        """A call that makes everything; `icha run` calls Snakemake in its turn."""
        if way == "icha run":
            program = [sys.executable, "-c", "from icha.cli import main; main()", "run", str(self.configuration)]
            program += ["--anyway"]  # on disks that are too small from the beginning, too
            return [*program, *self.targets, "--plain", "--cores", "2", "--directory", str(self.folder), *arguments]
        program = [sys.executable, "-m", "snakemake", *self.targets, "--cores", "2"]
        place = ["--snakefile", str(self.project / "Snakefile"), "--directory", str(self.folder)]
        return [*program, *place, *arguments, "--configfile", str(self.configuration)]

    def start(
        self, way: str = "snakemake", *arguments: str, before: Iterable[str] = (), **variables: str
    ) -> subprocess.Popen:
        """Start a call in a session of its own; what it says goes to a file outside of the place."""
        name, _, value = self.mark.partition("=")
        found = os.pathsep.join([str(self.project), str(self.project / "workflow/plugins")])
        environment = os.environ | {"PYTHONPATH": found, "OMP_NUM_THREADS": "1", name: value} | variables
        said = tempfile.TemporaryFile("w+", encoding="utf-8")
        process = subprocess.Popen(
            [*before, *self.command(way, *arguments)],
            cwd=self.project,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        process.said = said
        return process

    def run(
        self, way: str = "snakemake", *arguments: str, before: Iterable[str] = (), **variables: str
    ) -> tuple[int, str]:
        """A call to its end: its status, and all that it said."""
        return self.end(self.start(way, *arguments, before=before, **variables))

    def end(self, process: subprocess.Popen) -> tuple[int, str]:
        """Wait for a call; its status, and all that it said."""
        try:
            process.wait(LONGEST)
        except subprocess.TimeoutExpired:
            for pid in self.processes():
                _kill(pid)
            process.wait()
        process.said.seek(0)
        # Wherever it is, what it says is the same.
        text = process.said.read().replace(f"{self.folder}/", "").replace(str(self.folder), "FOLDER")
        process.said.close()
        return process.returncode, text

    def processes(self) -> dict[int, tuple[int, list[str]]]:
        """Its processes that have not ended: their parents and command lines."""
        found = {}
        for entry in Path("/proc").iterdir():
            if not entry.name.isdigit():
                continue
            try:
                if self.mark.encode() not in (entry / "environ").read_bytes().split(b"\0"):
                    continue
                state, parent = (entry / "stat").read_text().rsplit(")", 1)[1].split()[:2]
                line = (entry / "cmdline").read_bytes().decode(errors="replace").split("\0")
            except OSError:
                continue
            if state != "Z":
                found[int(entry.name)] = int(parent), line
        return found

    def left_behind(self) -> list[str]:
        """Command lines of what still runs a moment later."""
        until = time.monotonic() + MOMENT
        while (there := self.processes()) and time.monotonic() < until:
            time.sleep(0.05)
        for pid in there:
            _kill(pid)
        return [" ".join(line)[:200] for _, line in there.values()]

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

    def contents(self) -> dict[str, str]:
        """Checksums of all results that anybody would take for whole."""
        return {
            str(path): hashlib.sha256((self.results / path).read_bytes()).hexdigest() for path in self.result_files()
        }

    def result_files(self) -> Iterator[Path]:
        """All results by their path, without measurements, hidden files and what was set aside."""
        for file in sorted(self.results.rglob("*")):
            path = file.relative_to(self.results)
            hidden = any(part.startswith(".") for part in path.parts if part != ".zenodo.json")
            aside = any(".damaged" in part for part in path.parts)
            if file.is_file() and not hidden and not aside and path.parts[0] not in MEASURED:
                yield path

    def times(self) -> dict[str, int]:
        """When each result was written, of the jobs that Snakemake knows to have ended well."""
        unfinished = tuple(self._unfinished())
        deposit = self.results / f"publish/{CAMPAIGN}-1.0"
        if not (deposit / "SHA256SUMS").is_file():  # of a job that failed Snakemake removes this, its output
            unfinished += (f"{RESULTS}/publish/{deposit.name}/",)
        return {
            str(path): (self.results / path).stat().st_mtime_ns
            for path in self.result_files()
            if not f"{RESULTS}/{path}".startswith(unfinished)
        }

    def _unfinished(self):
        top = self.folder / ".snakemake/incomplete"
        for file in top.rglob("*"):
            if file.is_file():
                name = "".join(part.removeprefix("@") for part in file.relative_to(top).parts)
                path = urlsafe_b64decode(name).decode()
                # All of a deposit is the result of one job.
                yield path.removesuffix("SHA256SUMS")


def _kill(pid):
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


class Reference:
    """The campaign undisturbed: its bytes, and how long it takes."""

    def __init__(self, project: Path, scratch: Path, **options):
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

    def copy(self, inside: Path | None = None) -> Place:
        """A place where everything was computed."""
        place = self.empty(inside)
        shutil.copytree(self.place.folder, place.folder, dirs_exist_ok=True, symlinks=True)
        return place

    def half_written(self, place: Place) -> list[str]:
        """Results that are there but are not those of the reference."""
        there = place.contents()
        return [f"{path} passes for whole" for path in there if there[path] != self.contents.get(path)]

    def unequal(self, place: Place) -> list[str]:
        """What differs from the reference at the end, and what was left lying about."""
        there = place.contents()
        wrong = [f"{path} differs" for path in self.contents if path in there and there[path] != self.contents[path]]
        wrong += [f"{path} is missing" for path in self.contents if path not in there]
        wrong += [f"{path} is not of the campaign" for path in there if path not in self.contents]
        rests = place.results.rglob("*.part")
        return [*wrong, *(f"{rest.relative_to(place.results)} is left" for rest in rests)]

    def goes_on(self, place: Place, way: str = "snakemake") -> list[str]:
        """Give the same command again; what is wrong with its end."""
        status, said = place.run(way)
        return [*([f"the next call failed: {last_words(said)}"] if status else []), *self.unequal(place)]


def last_words(said: str, lines: int = 3) -> str:
    """The end of what a call said."""
    return " / ".join([line.strip() for line in said.splitlines() if line.strip()][-lines:])


def sentence(said: str, *words: str) -> str:
    """The first line that holds one of some words."""
    return next((line.strip() for line in said.splitlines() if any(word in line for word in words)), "")


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
        _kill(chance.choice(found))
    place.end(process)
    wrong = [f"{line} is left running" for line in place.left_behind()]
    return [*wrong, *reference.half_written(place), *computed_again(before, place)]


def computed_again(before: dict[str, int], place: Place) -> list[str]:
    """Results that were complete and are not as they were."""
    after = place.times()
    return [f"{path} was computed again" for path in before if after.get(path) != before[path]]


def kills(reference: Reference, trials: int, chance: random.Random) -> Iterator[Trial]:
    """Some trials in which processes are killed at random moments, as many of each kind.

    The call that goes on is killed in its turn, up to three times in a row; then it may run to its end.
    """
    victims = itertools.cycle(VICTIMS)
    made = 0
    while made < trials:
        place, row = reference.empty(), []
        for _ in range(chance.randint(1, min(3, trials - made))):
            victim = next(victims)
            wrong = kill(place, reference, victim, chance.uniform(0.1, 0.7) * reference.seconds, chance)
            if wrong is None:  # it was over before, which is no trial
                break
            row.append(Trial("kill", victim, WENT_ON, violations=tuple(wrong)))
        before = place.times()
        wrong = [*reference.goes_on(place), *computed_again(before, place)]
        made += len(row)
        if row:
            row[-1] = replace(row[-1], violations=(*row[-1].violations, *wrong))
        _end(place, None)
        yield from row


# --- disks --------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def disk(folder: Path, size: int) -> Iterator[Callable[[str], None]]:
    """A small disk at `folder`; gives a function that mounts it anew with other options."""
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size},mode=755", "none", str(folder)], check=True)
    try:
        yield lambda options: subprocess.run(["mount", "-o", f"remount,{options}", str(folder)], check=True)
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def full_disk(reference: Reference, what: str, room: float | None, moment: float, way: str) -> Trial:
    """Run with `results`, or the whole working folder, on a disk that becomes full.

    `room` is the size of the disk, 1 being enough for everything but the deposit; None for a large one, which something
    else fills up at a fraction `moment` of the campaign's time.
    """
    place = reference.empty()
    below, whole = (
        (place.results.parent, reference.place.results.parent)
        if what == "results"
        else (place.folder, reference.place.folder)
    )
    needed = disk_use(file for file in whole.rglob("*") if "publish" not in file.parts)
    large = 4 * disk_use(whole.rglob("*")) + 2**24
    fault = "filled up by others" if room is None else "full from the start" if room == 0 else "full on the way"
    with disk(below, large if room is None else max(int(room * needed), 8192)) as mount:
        filler = below / "something.else"
        if room == 0:
            fill(filler)
        process = place.start(way)
        if room is None:
            time.sleep(moment * reference.seconds)
            fill(filler)
        status, said = place.end(process)
        wrong = [f"{line} is left running" for line in place.left_behind()]
        wrong += reference.half_written(place)
        words = "".join(sentence(said, "No space left on device").partition("No space left on device")[:2])
        if status and not words:
            wrong.append(f"not told that the disk is full: {last_words(said, 6)}")
        filler.unlink(missing_ok=True)
        mount(f"size={large}")
        wrong += reference.goes_on(place, way) if status else reference.unequal(place)
    ended = REFUSED if status else WENT_ON
    return _end(place, Trial("full disk", f"{what}: {fault}", ended, words[:200], tuple(wrong)))


def disk_use(files: Iterable[Path]) -> int:
    """Bytes that files take on a disk of pages."""
    return sum(-(-file.stat().st_size // 4096) * 4096 for file in files if file.is_file())


def fill(file: Path) -> None:
    """Write to a file until the disk is full."""
    with contextlib.suppress(OSError), file.open("wb", buffering=0) as stream:
        while True:
            stream.write(bytes(4096))


def full_disks(reference: Reference, chance: random.Random) -> Iterator[Trial]:
    """Disks that are full from the start, on the way, and filled up by others."""
    for what in ("results", "working folder"):
        rooms = [0.0, *(chance.uniform(0.05, 1.0) for _ in range(4)), chance.uniform(1.0, 1.5), None, None]
        for number, room in enumerate(rooms):
            yield full_disk(reference, what, room, chance.uniform(0.1, 0.6), WAYS[number % 2])


# --- power cuts -----------------------------------------------------------------------------------------------------

# ext4 as it is hardest for programs: names may be on the disk before the data that they stand for.
HARDEST = "loop,noauto_da_alloc,data=writeback"
# EXT4_IOC_SHUTDOWN with EXT4_GOING_FLAGS_NOLOGFLUSH (Linux, fs/ext4/ext4.h): from now on nothing gets to the disk.
_SHUTDOWN, _WITHOUT_FLUSH = 0x8004587D, struct.pack("I", 2)


@contextlib.contextmanager
def power(folder: Path, image: Path) -> Iterator[tuple[Callable[[], None], Callable[[], None]]]:
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


def power_cut(reference: Reference, moment: float, way: str) -> Trial:
    """Run on a disk whose power is cut after `moment` seconds: what was not forced to it by then is lost."""
    place = reference.empty()
    with power(place.folder, place.folder.with_suffix(".disk")) as (cut, mount):
        process = place.start(way)
        time.sleep(moment)
        cut()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        place.end(process)
        wrong = [f"{line} is left running" for line in place.left_behind()]
        unmount(place.folder)
        mount()
        wrong += reference.half_written(place)
        wrong += reference.goes_on(place, way)
    return _end(place, Trial("power cut", "the disk of the working folder", WENT_ON, violations=tuple(wrong)))


def power_cuts(reference: Reference, trials: int, chance: random.Random) -> Iterator[Trial]:
    """Power cuts at random moments."""
    for number in range(trials):
        yield power_cut(reference, chance.uniform(0.1, 0.95) * reference.seconds, WAYS[number % 2])


# --- odd places -----------------------------------------------------------------------------------------------------


def odd_name(reference: Reference, name: str, way: str) -> Trial:
    """Run in a folder, and from a clone, with a name that a shell would take for something else."""
    folder = reference.scratch / f"{name}{next(reference.numbers)}"
    place = reference.empty(folder)
    place.project = shutil.copytree(reference.project, folder.with_name(f"{folder.name} clone"), symlinks=True)
    wrong = tuple(reference.goes_on(place, way))
    shutil.rmtree(place.project)
    return _end(place, Trial("odd place", "names of folders", WENT_ON, violations=wrong))


def odd_modules(reference: Reference, way: str) -> Trial:
    """Run in a folder whose files have the names of modules."""
    place = reference.empty()
    for name in ("icha", "json", "numpy", "socket", "snakemake"):
        (place.folder / f"{name}.py").write_text("raise SystemExit('imported from the working folder')\n")
    return _end(place, Trial("odd place", "modules in it", WENT_ON, violations=tuple(reference.goes_on(place, way))))


def long_temporary(reference: Reference, way: str) -> Trial:
    """Run with a folder for temporary files whose path is too long for a socket."""
    place = reference.empty()
    folder = reference.scratch / ("temporary" * 12)
    folder.mkdir(exist_ok=True)
    status, said = place.run(way, TMPDIR=str(folder))
    wrong = [f"the call failed: {last_words(said)}"] if status else []
    wrong += reference.unequal(place)
    return _end(place, Trial("odd place", "long path of temporary files", WENT_ON, violations=tuple(wrong)))


OBSTACLES = {
    "results are a file": RESULTS,
    "results are a link to nothing": RESULTS,
    "all results are a link to nothing": "results",
    "Snakemake's records are a file": ".snakemake",
}


def obstacle(reference: Reference, what: str) -> Trial:
    """Run where something else is in the place of a folder."""
    place = reference.empty()
    file = place.folder / OBSTACLES[what]
    file.parent.mkdir(parents=True, exist_ok=True)
    if "link" in what:
        file.symlink_to("nowhere")
    else:
        file.write_text("something else")
    status, said = place.run("icha run")
    words = sentence(said, "which is not there", "and no folder")
    wrong = [] if status and words and "Traceback" not in said else [f"not told: {last_words(said)}"]
    file.unlink()
    wrong += reference.goes_on(place, "icha run")
    return _end(place, Trial("odd place", what, REFUSED, words[:200], tuple(wrong)))


def odd_places(reference: Reference) -> Iterator[Trial]:
    """Names that shells and Python take for something else, paths that are too long, obstacles."""
    names = ("a space", "it's", 'a "quote"', "R&D", "a;b", "(copy", "$HOME", "a*b", "both' of \"them & ($*;")
    for number, name in enumerate(names):
        yield odd_name(reference, name, WAYS[number % 2])
    for way in WAYS:
        yield odd_modules(reference, way)
        yield long_temporary(reference, way)
    for what in OBSTACLES:
        yield obstacle(reference, what)


# --- read-only ----------------------------------------------------------------------------------------------------

# The right to write everywhere, which root has, is taken away.
WITHOUT_RIGHTS = ("setpriv", "--bounding-set=-dac_override,-dac_read_search,-fowner", "--inh-caps=-all")


def read_only(reference: Reference, what: str, state: str, way: str) -> Trial:
    """Run where nothing can be written: on a disk, or by permissions; with everything there, or something missing."""
    by_permission = what.startswith("permissions")
    with contextlib.ExitStack() as stack:
        place = reference.copy()
        folder = place.folder if "working" in what else place.results.parent
        missing = place.results / "figures/fig10_model_error.png"
        damaged = place.results / "surfaces/rough/seed1.nc"
        if state == "a figure is missing":
            missing.unlink()
        elif state == "a surface is damaged":
            flip(damaged, "middle")
        if by_permission:
            folders = [folder, *(each for each in folder.rglob("*") if each.is_dir())]
            for each in folders:
                each.chmod(0o555)
        else:
            subprocess.run(["mount", "--bind", str(folder), str(folder)], check=True)
            stack.callback(subprocess.run, ["umount", "--lazy", str(folder)], check=True)
            subprocess.run(["mount", "-o", "remount,bind,ro", str(folder)], check=True)
        before = place.times()
        status, said = place.run(way, before=WITHOUT_RIGHTS if by_permission and os.getuid() == 0 else ())
        wrong = [f"{path} was computed" for path, time in place.times().items() if before.get(path) != time]
        words = sentence(said, "cannot be written to", "cannot be set aside")
        if state == "everything is there" and not status:
            ended = WENT_ON
        else:
            ended = REFUSED
            if not status:
                wrong.append("it did as if it had written")
            if not words:
                wrong.append(f"not told that it is read-only: {last_words(said, 6)}")
            if "Traceback" in said:
                wrong.append(f"a traceback: {last_words(said)}")
        if by_permission:
            for each in folders:
                each.chmod(0o755)
        else:
            subprocess.run(["mount", "-o", "remount,bind,rw", str(folder)], check=True)
        wrong += reference.goes_on(place, way)
        trial = Trial("read-only", f"{what}: {state}", ended, words[:200], tuple(wrong))
    return _end(place, trial)


def read_onlys(reference: Reference) -> Iterator[Trial]:
    """Results, or the whole working folder, that cannot be written to, on a disk or by permissions."""
    states = ("everything is there", "a figure is missing", "a surface is damaged")
    for what in ("results on a disk", "working folder on a disk", "permissions of results"):
        for state, way in itertools.product(states, WAYS):
            yield read_only(reference, what, state, way)


# --- damage -------------------------------------------------------------------------------------------------------

KINDS = {
    "surface": f"{RESULTS}/surfaces/rough/seed1.nc",
    "run": f"{RESULTS}/runs/load/rough/seed1/slope1/soft.nc",
    "boundary elements": f"{RESULTS}/references/boundary_elements/truth/rough/seed1/slope1/bare/p0.01.nc",
    "theories": f"{RESULTS}/references/rough.nc",
    "campaign dataset": f"{RESULTS}/dataset/{CAMPAIGN}.nc",
    "comparison": f"{RESULTS}/aggregated/{CAMPAIGN}.nc",
    "checks": f"{RESULTS}/checks.json",
    "figure": f"{RESULTS}/figures/fig10_model_error.png",
    "report": f"{RESULTS}/report.html",
    "configuration as used": f"{RESULTS}/config.used.yaml",
    "file of the deposit": f"{RESULTS}/publish/{CAMPAIGN}-1.0/dataset/{CAMPAIGN}.nc",
    "archive of the deposit": f"{RESULTS}/publish/{CAMPAIGN}-1.0.zip",
    "checksum record": f"{RESULTS}/checksums/runs/load/rough/seed1/slope1/soft.nc.json",
    "Snakemake's record": ".snakemake/metadata/"
    + urlsafe_b64encode(f"{RESULTS}/runs/load/rough/seed1/slope1/soft.nc".encode()).decode(),
}
DAMAGES = ("empty", "cut in half", "last byte lost", "bit flipped at the start", "in the middle", "at the end")


def flip(file: Path, place: str, bit: int = 0) -> None:
    """Flip a bit of a file at the start, in the middle or at the end."""
    content = bytearray(file.read_bytes())
    content[{"start": 0, "middle": len(content) // 2, "end": -1}[place]] ^= 1 << bit
    file.write_bytes(content)


def spoil(file: Path, damage: str, bit: int) -> None:
    """Damage a file."""
    size = file.stat().st_size
    if "start" in damage or "middle" in damage or "at the end" in damage:
        flip(file, damage.rsplit(" ", 1)[1], bit)
    else:
        os.truncate(file, {"empty": 0, "cut in half": size // 2, "last byte lost": size - 1}[damage])


def damage(reference: Reference, kind: str, how: str, bit: int, way: str) -> Trial:
    """Damage one file of a finished campaign, and run it again."""
    place = reference.copy()
    spoil(place.folder / KINDS[kind], how, bit)
    wrong = reference.goes_on(place, way)
    return _end(place, Trial("damage", kind, WENT_ON, violations=tuple(f"{how}, {way}: {each}" for each in wrong)))


def silent_damage(reference: Reference, kind: str, lost: str, way: str) -> Trial:
    """Flip a bit as a failing disk does, without a new time of change, where a job is still to read the file."""
    place = reference.copy()
    file = place.folder / KINDS[kind]
    status = file.stat()
    flip(file, "middle")
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
    (place.folder / KINDS[lost]).unlink()
    failed, said = place.run(way)
    words = sentence(said, "not what was written")
    wrong = [] if failed and words else [f"not told: {last_words(said)}"]
    wrong += [
        each for each in reference.half_written(place) if not each.startswith(os.path.relpath(file, place.results))
    ]
    wrong += reference.goes_on(place, way)
    return _end(place, Trial("damage", f"{kind}, by the disk", REFUSED, words[:200], tuple(wrong)))


def damage_everything(reference: Reference, turn: int, bit: int, way: str) -> Trial:
    """Damage all kinds of files at once, each in another way; all that can be are to be found and kept."""
    place = reference.copy()
    spoilt = {}
    for number, kind in enumerate(KINDS):
        file = place.folder / KINDS[kind]
        spoil(file, DAMAGES[(turn + number) % len(DAMAGES)], bit)
        spoilt[kind] = file.read_bytes()
    wrong = reference.goes_on(place, way)
    for kind in KINDS:
        if kind in ("checksum record", "Snakemake's record", "file of the deposit"):
            continue  # not results, and a result whose folder is set aside
        file = place.folder / KINDS[kind]
        aside = file.with_name(f"{file.name}.damaged")
        if not aside.is_file() or aside.read_bytes() != spoilt[kind]:
            wrong.append(f"damaged {kind} was not kept")
    return _end(place, Trial("damage", "all of these at once", WENT_ON, violations=tuple(wrong)))


def damages(reference: Reference, chance: random.Random) -> Iterator[Trial]:
    """Every kind of file, damaged in three ways by itself and in all ways together with the others."""
    for number, kind in enumerate(KINDS):
        for turn in (0, 2, 4):
            how = DAMAGES[(turn + number) % len(DAMAGES)]
            yield damage(reference, kind, how, chance.randrange(8), WAYS[(number + turn // 2) % 2])
    for turn in range(len(DAMAGES)):
        yield damage_everything(reference, turn, chance.randrange(8), WAYS[turn % 2])
    for number, (kind, lost) in enumerate(
        {"surface": "run", "run": "campaign dataset", "campaign dataset": "figure", "comparison": "report"}.items()
    ):
        yield silent_damage(reference, kind, lost, WAYS[number % 2])


# --- other settings -------------------------------------------------------------------------------------------------

# For what the reference has 25 MPa.
OTHER = "materials={bare: {contact_modulus: 20 MPa}, soft: {contact_modulus: 20 MPa}}"


def orphan(reference: Reference, moment: float) -> Trial:
    """Kill Snakemake while it computes with other settings, and run with the reference's at once."""
    place = reference.empty()
    process = place.start("snakemake", "--config", OTHER)
    time.sleep(moment)
    _kill(process.pid)
    wrong = reference.goes_on(place)
    place.end(process)
    wrong += [f"{line} is left running" for line in place.left_behind()]
    wrong += reference.unequal(place)
    return _end(place, Trial("other settings", "killed at them", WENT_ON, violations=tuple(wrong)))


def restored(reference: Reference, others: Place, what: str, way: str) -> Trial:
    """Put results of other settings in the place of the reference's, whole or one run, with or without records."""
    place = reference.copy()
    if what == "all restored":
        shutil.rmtree(place.results)
        shutil.copytree(others.results, place.results)
    elif what == "all restored, no records":
        shutil.rmtree(place.folder)
        shutil.copytree(others.folder, place.folder)
        shutil.rmtree(place.folder / ".snakemake")
    else:
        run = KINDS["run"]
        record = KINDS["checksum record"]
        for path in (run, record, *([KINDS["Snakemake's record"]] if "all its records" in what else [])):
            shutil.copy2(others.folder / path, place.folder / path)
    if "no records" in what:
        # A deposit needs records of how all was made. This is said, and how to have them.
        status, said = place.run(way)
        wrong = [] if status and NO_RECORD in said else [f"it did not say what to do: {last_words(said)}"]
        targets, place.targets = place.targets, ("all",)
        status, _ = place.run(way, *(["--"] if way == "icha run" else []), "--touch", "--forceall")
        wrong += ["records could not be made"] if status else []
        place.targets = targets
        wrong += reference.goes_on(place, way)
        return _end(place, Trial("other settings", what, REFUSED, sentence(said, NO_RECORD), tuple(wrong)))
    wrong = reference.goes_on(place, way)
    return _end(place, Trial("other settings", what, WENT_ON, violations=tuple(wrong)))


NO_RECORD = "there is no record of how it was made"
RESTORED = ("all restored", "all restored, no records", "one run restored", "one run restored with all its records")


def other_settings(reference: Reference, chance: random.Random) -> Iterator[Trial]:
    """Results of other settings, by jobs that outlive their Snakemake, and restored from a backup."""
    for number in range(8):
        yield orphan(reference, chance.uniform(0.2, 0.7) * reference.seconds * (number > 0) + 0.1)
    others = reference.empty()
    others.run("snakemake", "--config", OTHER)
    for what, way in itertools.product(RESTORED, WAYS):
        yield restored(reference, others, what, way)
    _end(others, None)


# --- two at once --------------------------------------------------------------------------------------------------


def two_at_once(reference: Reference, pause: float, ways: tuple[str, str]) -> Trial:
    """Two calls for the same campaign, one after the other."""
    place = reference.empty()
    first = place.start(ways[0])
    time.sleep(pause)
    second = place.start(ways[1])
    ends = [place.end(first), place.end(second)]
    refusals = [sentence(said, "is running this campaign") for status, said in ends if status]
    wrong = [f"a call failed: {last_words(said)}" for status, said in ends if status and "is running this" not in said]
    wrong += ["both calls were refused"] if len(refusals) == 2 else []
    wrong += reference.unequal(place)
    ended = REFUSED if refusals else WENT_ON
    words = " ".join("N" if word.isdigit() else word for word in "".join(refusals).split())
    return _end(place, Trial("two at once", "the same campaign", ended, words[:200], tuple(wrong)))


def two_campaigns(reference: Reference, pause: float) -> Trial:
    """Two campaigns in the same folder, one after the other."""
    place = reference.empty()
    first = place.start()
    time.sleep(pause)
    targets, place.targets = place.targets, ("all",)
    second = place.start("snakemake", "--config", "name=others")
    place.targets = targets
    ends = [place.end(first), place.end(second)]
    wrong = [f"a call failed: {last_words(said)}" for status, said in ends if status]
    wrong += reference.unequal(place)
    # The other one is the same but for its name.
    surface = "surfaces/rough/seed1.nc"
    if not (place.folder / "results/others" / surface).is_file():
        wrong.append("the other campaign is not there")
    return _end(place, Trial("two at once", "two campaigns in one folder", WENT_ON, violations=tuple(wrong)))


def both(reference: Reference, trials: int, chance: random.Random) -> Iterator[Trial]:
    """Two calls at once, with random pauses between them."""
    for number in range(trials):
        ways = (WAYS[number % 2], WAYS[number // 2 % 2])
        yield two_at_once(reference, chance.uniform(0, 0.8) * reference.seconds * (number > 1), ways)
    for _ in range(3):
        yield two_campaigns(reference, chance.uniform(0, 0.5) * reference.seconds)


def _end(place, trial):
    shutil.rmtree(place.folder, ignore_errors=True)
    return trial


# --- all of it ----------------------------------------------------------------------------------------------------

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
    file = HERE / "results/faults.json"
    rows = json.loads(file.read_text(encoding="utf-8"))["rows"] if file.is_file() else []
    new = {row["part"] for row in found["rows"]}
    rows = [row for row in rows if row["part"] not in new] + found["rows"]
    rows.sort(key=lambda row: PARTS.index(row["part"]))
    text = json.dumps(found | {"rows": rows}, indent=1, ensure_ascii=False)
    file.write_text(text + "\n", encoding="utf-8")


def main() -> None:
    """Make all trials and keep their counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--trials", type=int, default=52, help="kills, and power cuts")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scratch", type=Path, default=None, help="an empty folder")
    parser.add_argument("--in-namespace", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if not options.in_namespace:
        # Disks that are mounted here are seen by nobody else, and end with the process.
        unshare = ["unshare", "--mount", *([] if os.getuid() == 0 else ["--map-root-user"])]
        os.execvp(unshare[0], [*unshare, sys.executable, *sys.argv, "--in-namespace"])
    scratch = Path(tempfile.mkdtemp(prefix="icha-faults-", dir=options.scratch))
    try:
        reference = Reference(clone(HERE.parent, scratch / "project"), scratch)
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
        print(table(rows))
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    keep({"seed": options.seed, "moment": MOMENT, "results": len(reference.contents), "rows": rows})
    if any(row["violations"] for row in rows):
        raise SystemExit("Not everything ended as wanted.")


if __name__ == "__main__":
    main()
