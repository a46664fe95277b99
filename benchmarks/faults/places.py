"""Where a campaign is disturbed: a folder and its processes, and the campaign undisturbed to compare with."""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from base64 import urlsafe_b64decode
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

CAMPAIGN = "faults"
CONFIGURATION = Path(__file__).resolve().parent / "campaign.yaml"
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

    def __init__(self, project: Path, folder: Path, targets=("all", "publish"), configuration=CONFIGURATION):
        self.project, self.folder, self.targets, self.configuration = project, folder, targets, configuration
        folder.mkdir(parents=True, exist_ok=True)
        # All processes of this place, and no others, have it in their environment.
        self.mark = f"ICHA_TEST_PLACE={folder}"

    @property
    def results(self) -> Path:
        return self.folder / RESULTS

    def remove(self) -> None:
        """Remove the folder and all that is in it."""
        shutil.rmtree(self.folder, ignore_errors=True)

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
                kill_process(pid)
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
            kill_process(pid)
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


def kill_process(pid):
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


def ended(place: Place, trial: Trial) -> Trial:
    """A trial, once its place is removed."""
    place.remove()
    return trial
