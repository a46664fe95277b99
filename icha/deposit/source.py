"""The source of the program as it was committed or installed, and whether it is the one that runs."""

import hashlib
import os
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from icha.deposit.installed_source import installed_source
from icha.support.program import is_installed

# What computes the results: nothing may lie here that is not committed.
PROGRAM = ("Snakefile", "icha", "workflow", "profiles/default")
# Configurations of campaigns; a deposit has the one that was used.
CONFIGURATIONS = "config"
# Git is asked for what is committed only: no setting of the user, the system or the repository may change the answer.
_SETTINGS = (
    *("-c", "core.fsmonitor=false"),
    *("-c", "core.quotePath=false"),
    *("-c", "core.untrackedCache=false"),
    *("-c", f"core.excludesFile={os.devnull}"),
    *("-c", "safe.directory=*"),
)
_FILE, _EXECUTABLE, _LINK, _SUBMODULE = "100644", "100755", "120000", "160000"
_MOST_NAMES = 20


class Source(Protocol):
    """The files of the program in a state that can be told from any other."""

    @property
    def revision(self) -> str:
        """What tells the state from others: a commit, or version and checksum of what was installed."""

    def export(self, folder: Path) -> None:
        """Write all files to a new folder."""


def program_source(project: str | os.PathLike) -> Source:
    """The source of the program that belongs to a Snakefile in the folder `project`: as committed, or as installed.

    Raises
    ------
    ValueError
        If what is there is not what was committed or installed; the message says what to do.
    """
    return installed_source(project) if is_installed(Path(project)) else committed_source(project)


@dataclass(frozen=True)
class CommittedSource:
    """The files of a project at a commit: mode and object of git by their paths in the project."""

    revision: str
    project: Path
    files: dict[str, tuple[str, str]]

    def export(self, folder: Path) -> None:
        """Write all files, with the bytes that are committed, to a new folder."""
        names = list(self.files)
        for name, content in zip(names, self._contents(names), strict=True):
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            path.chmod(0o755 if self.files[name][0] == _EXECUTABLE else 0o644)

    def _contents(self, names: list[str]) -> Iterator[bytes]:
        command = ["git", *_SETTINGS, "cat-file", "--batch"]
        with subprocess.Popen(
            command, cwd=self.project, env=_environment(), stdin=subprocess.PIPE, stdout=subprocess.PIPE
        ) as git:
            for name in names:
                git.stdin.write(f"{self.files[name][1]}\n".encode("ascii"))
                git.stdin.flush()
                header = git.stdout.readline().split()
                if len(header) != 3:
                    raise ValueError(f"{self.project}: git cannot read {name} of commit {self.revision}")
                content = git.stdout.read(int(header[2]))
                git.stdout.read(1)
                yield content
            git.stdin.close()


def committed_source(project: str | os.PathLike) -> CommittedSource:
    """The source of the program, at the commit that is checked out.

    A configuration below config/ may be changed or new: it is not part of the program.

    Parameters
    ----------
    project : the folder with the Snakefile; it may lie in a larger repository.

    Raises
    ------
    ValueError
        If the folder is not under git or has no commit, if a file differs from the commit, or if there are files
        among those of the program that are not committed; the message lists them and says what to do.
    """
    project = Path(project).resolve()
    if _git(project, "rev-parse", "--is-inside-work-tree") != b"true\n":
        raise ValueError(
            f"{project}: is not under git, so nobody could tell which program made the data; "
            "needed: a clone of the repository, or `git init`, `git add` and `git commit` of this folder"
        )
    commit = (_git(project, "rev-parse", "--verify", "--quiet", "HEAD^{commit}") or b"").decode("ascii").strip()
    if not commit:
        raise ValueError(f"{project}: nothing is committed yet; needed: `git add` and `git commit`")
    files = dict(_tree(project))
    if "Snakefile" not in files:
        raise ValueError(f"{project}: its Snakefile is not committed; needed: `git add` and `git commit`")
    if odd := [name for name, (mode, _) in files.items() if mode in (_LINK, _SUBMODULE)]:
        raise ValueError(
            f"{project}: a deposit holds files only; needed: the files themselves in the place of these links and "
            f"submodules:\n{_listed(odd)}"
        )
    program = {name: digest for name, (_, digest) in files.items() if not name.startswith(f"{CONFIGURATIONS}/")}
    changed = [name for name, digest in program.items() if _digest(project / name, len(digest)) != digest]
    # Attributes may want other ends of lines in the folder than are committed; git knows.
    changed = [name for name in changed if _digest_by_git(project, name) != program[name]]
    added = [name for name in _others(project) if name not in files]
    if changed or added:
        listed = [*(f"changed: {name}" for name in changed), *(f"not committed: {name}" for name in added)]
        raise ValueError(
            f"{project}: differs from commit {commit[:12]}, so the deposit would not hold the program that made the "
            f"data; needed: `git commit` these changes, or undo them:\n{_listed(listed)}"
        )
    return CommittedSource(commit, project, files)


def _tree(project: Path) -> Iterator[tuple[str, tuple[str, str]]]:
    """Path, mode and object of every file that is committed, in the order of the paths."""
    # Of a folder within a repository git lists the folder's files, with their paths from there.
    entries = (_git(project, "ls-tree", "-r", "-z", "HEAD") or b"").split(b"\0")
    for entry in sorted(entries[:-1], key=lambda entry: entry.split(b"\t", 1)[1]):
        facts, name = entry.split(b"\t", 1)
        mode, _, digest = facts.decode("ascii").split()
        yield _path(project, name), (mode, digest)


def _others(project: Path) -> list[str]:
    """Files among those of the program, but those that the project's own .gitignore names."""
    found = _git(
        project,
        *("ls-files", "-z", "--cached", "--others", "--exclude-per-directory=.gitignore", "--", *PROGRAM),
    )
    names = [_path(project, name) for name in (found or b"").split(b"\0")[:-1]]
    return sorted(name for name in names if (project / name).is_file() or (project / name).is_symlink())


def _path(project: Path, name: bytes) -> str:
    try:
        text = name.decode("utf-8")
    except UnicodeDecodeError:
        text = ""
    if not text.isprintable() or "\\" in text or not text:
        raise ValueError(f"{project}: the name of file {name!r} holds characters that archives do not agree on")
    return text


def _digest(path: Path, length: int) -> str | None:
    """The object that git makes of a file as it is; None if there is no such file. Git has SHA-1 or SHA-256."""
    if path.is_symlink() or not path.is_file():
        return None
    digest = hashlib.sha1(usedforsecurity=False) if length == 40 else hashlib.sha256()
    digest.update(b"blob %d\0" % path.stat().st_size)
    with path.open("rb") as file:
        while block := file.read(2**20):
            digest.update(block)
    return digest.hexdigest()


def _digest_by_git(project: Path, name: str) -> str | None:
    """The object that git would commit for a file, by the attributes of its path; None if there is no such file."""
    if (project / name).is_symlink() or not (project / name).is_file():
        return None
    return (_git(project, "hash-object", "--", name) or b"").decode("ascii").strip()


def _git(project: Path, *arguments: str) -> bytes | None:
    """What git says; None if it fails.

    Raises
    ------
    ValueError
        If there is no git.
    """
    try:
        done = subprocess.run(["git", *_SETTINGS, *arguments], cwd=project, env=_environment(), capture_output=True)
    except FileNotFoundError:
        raise ValueError("git: no such program; needed: git, which knows the source that made the data") from None
    return done.stdout if done.returncode == 0 else None


def _environment() -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    return kept | {
        "LC_ALL": "C",
        "GIT_CONFIG_GLOBAL": os.devnull,
        "GIT_CONFIG_NOSYSTEM": "1",
        "GIT_NO_REPLACE_OBJECTS": "1",
        "GIT_OPTIONAL_LOCKS": "0",
        "GIT_TERMINAL_PROMPT": "0",
    }


def _listed(names: list[str]) -> str:
    more = [f"  and {len(names) - _MOST_NAMES} more"] if len(names) > _MOST_NAMES else []
    return "\n".join([*(f"  {name}" for name in names[:_MOST_NAMES]), *more])
