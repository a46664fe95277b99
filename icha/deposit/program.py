"""The program that made the results: its source, as committed or as installed, and the packages of its environment.

`python -m icha.deposit.program` prints the locked versions for `pip install --constraint`.
"""

import contextlib
import hashlib
import importlib.metadata
import importlib.util
import os
import subprocess
import tomllib
from base64 import urlsafe_b64decode
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

from packaging.markers import Marker
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from icha.support.atomic_files import whole_file
from icha.support.checksums import sha256_of
from icha.support.program import INSTALLED, is_installed, own_workflow, package_of

# Files and folders that compute the results: everything in them must be committed.
PROGRAM = ("Snakefile", "icha/", "workflow/", "profiles/default/")
# Configurations of campaigns, which may be changed or new; a deposit has the one that was used.
_CONFIGURATIONS = "config/"
# In a campaign's folder of results: the versions of packages with which some of them may have been made.
MADE_WITH = "made_with.txt"
# No setting of user, system or repository may change what git reports as committed.
_GIT = (
    *("git", "-c", "core.fsmonitor=false", "-c", "core.quotePath=false", "-c", "core.untrackedCache=false"),
    *("-c", f"core.excludesFile={os.devnull}", "-c", "safe.directory=*"),
)
_GIT_ENVIRONMENT = {
    "LC_ALL": "C",
    "GIT_CONFIG_GLOBAL": os.devnull,
    "GIT_CONFIG_NOSYSTEM": "1",
    "GIT_NO_REPLACE_OBJECTS": "1",
    "GIT_OPTIONAL_LOCKS": "0",
    "GIT_TERMINAL_PROMPT": "0",
}
# Mode of git for an executable file.
_EXECUTABLE = "100755"
# Longest list of names in a message.
_MOST_NAMES = 20


class Source(NamedTuple):
    """The source of the program in an identified state.

    Attributes
    ----------
    revision : the commit, or version and checksum of what was installed.
    export : function that writes all files to a new folder.
    """

    revision: str
    export: Callable[[Path], None]


def program_source(project: str | os.PathLike) -> Source:
    """Return the source of the program whose Snakefile is in the folder `project`, as committed or as installed.

    Raises
    ------
    ValueError
        If the files differ from what was committed or installed; the message lists them and what to do.
    """
    project = Path(project).resolve()
    return _installed_source(project.parent) if is_installed(project) else _committed_source(project)


def _committed_source(project: Path) -> Source:
    """The source at the commit that is checked out; the project may be a folder of a larger repository."""
    commit = (_git(project, "rev-parse", "--verify", "--quiet", "HEAD^{commit}") or b"").decode("ascii").strip()
    if not commit:
        raise ValueError(
            f"{project}: is not under git, or nothing is committed yet, so the program that made the data cannot be "
            "identified; needed: a clone of the repository, or `git init`, `git add` and `git commit` of this folder"
        )
    files = _committed_files(project)
    committed = {name: blob for name, (_, blob) in files.items() if not name.startswith(_CONFIGURATIONS)}
    there = [name for name in committed if (project / name).is_file() and not (project / name).is_symlink()]
    # A deposit holds neither links nor submodules. Git itself makes the objects to compare with, since attributes may
    # ask for other line ends in the folder than are committed. It takes paths from the top of the repository.
    above = (_git(project, "rev-parse", "--show-prefix") or b"").decode("utf-8").rstrip("\n")
    blobs = _git(project, "hash-object", "--stdin-paths", entered="".join(f"{above}{name}\n" for name in there)) or b""
    present = dict(zip(there, blobs.decode("ascii").split(), strict=True))
    wrong = [f"changed: {name}" for name, blob in committed.items() if present.get(name) != blob]
    wrong += [f"not committed: {name}" for name in _program_files(project) if name not in files]
    if wrong:
        raise ValueError(
            f"{project}: differs from commit {commit[:12]}, so the deposit would not hold the program that made the "
            f"data; needed: `git commit` these changes, or undo them:\n{_listed(wrong)}"
        )
    return Source(commit, partial(_export_committed, project, files))


def _committed_files(project: Path) -> dict[str, tuple[str, str]]:
    """Mode and object of every committed file of a folder, by its path there."""
    files = {}
    for entry in (_git(project, "ls-tree", "-r", "-z", "HEAD") or b"").split(b"\0")[:-1]:
        facts, name = entry.split(b"\t", 1)
        mode, _, blob = facts.decode("ascii").split()
        files[name.decode("utf-8", errors="replace")] = mode, blob
    return files


def _program_files(project: Path) -> list[str]:
    """Files of the program, committed or not, except those that the project's own .gitignore names."""
    command = ("ls-files", "-z", "--cached", "--others", "--exclude-per-directory=.gitignore", "--", *PROGRAM)
    names = (_git(project, *command) or b"").decode("utf-8", errors="replace").split("\0")[:-1]
    return sorted(name for name in names if (project / name).exists() or (project / name).is_symlink())


def _export_committed(project: Path, files: dict[str, tuple[str, str]], folder: Path) -> None:
    """Write the committed bytes, whatever attributes ask for."""
    batch = _git(project, "cat-file", "--batch", entered="".join(f"{blob}\n" for _, blob in files.values())) or b""
    start = 0
    for name, (mode, blob) in files.items():
        end_of_header = batch.index(b"\n", start)
        found, _, size = batch[start:end_of_header].decode("ascii").split()
        if found != blob:
            raise ValueError(f"{project}: git cannot read {name}")
        start = end_of_header + 1 + int(size) + 1
        _write(folder / name, batch[end_of_header + 1 : start - 1], 0o755 if mode == _EXECUTABLE else 0o644)


def _write(path: Path, content: bytes, mode: int = 0o644) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    path.chmod(mode)


def _git(project: Path, *arguments: str, entered: str = "") -> bytes | None:
    """Return the output of git for what is `entered`; None if it fails."""
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    try:
        done = subprocess.run(
            [*_GIT, *arguments],
            cwd=project,
            env=inherited | _GIT_ENVIRONMENT,
            input=entered.encode(),
            capture_output=True,
        )
    except FileNotFoundError:
        raise ValueError("git: no such program; needed: git, which identifies the source of the program") from None
    return done.stdout if done.returncode == 0 else None


def _installed_source(place: Path) -> Source:
    """The source as it was installed from a wheel, in the folder of packages `place`.

    Its revision is the version with the checksum of a list of all its files, as `sha256sum` would print it.
    """
    installed = next(iter(importlib.metadata.distributions(name="icha", path=[str(place)])), None)
    if installed is None:
        raise ValueError(
            f"{place}: no distribution `icha` is installed here, so the program that made the data cannot be "
            "identified; needed: pip install 'icha[workflow]'"
        )
    recorded = {
        str(file): urlsafe_b64decode(f"{file.hash.value}=").hex()
        for file in installed.files or ()
        if file.parts[0] in ("icha", INSTALLED) and file.hash and file.hash.mode == "sha256" and file.suffix != ".pyc"
    }
    there = [
        file.relative_to(place).as_posix()
        for folder in ("icha", INSTALLED)
        for file in (place / folder).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    ]
    wrong = [f"changed: {name}" for name in recorded if name not in there or sha256_of(place / name) != recorded[name]]
    wrong += [f"not of the installed version: {name}" for name in there if name not in recorded]
    if wrong:
        raise ValueError(
            f"{place}: differs from icha {installed.version}, so the deposit would not hold the program that made the "
            "data; needed: `pip install --force-reinstall icha`, or a clone of the repository for changes of the "
            f"program:\n{_listed(sorted(wrong))}"
        )
    sums = "".join(f"{recorded[name]}  {name}\n" for name in sorted(recorded))
    revision = f"icha-{installed.version}-{hashlib.sha256(sums.encode()).hexdigest()}"
    return Source(revision, partial(_export_installed, place, sorted(recorded)))


def _export_installed(place: Path, names: list[str], folder: Path) -> None:
    """Write the installed files to their places in the repository."""
    for name in names:
        _write(folder / name.removeprefix(f"{INSTALLED}/"), (place / name).read_bytes())


def _listed(names: list[str]) -> str:
    more = [f"  and {len(names) - _MOST_NAMES} more"] if len(names) > _MOST_NAMES else []
    return "\n".join([*(f"  {name}" for name in names[:_MOST_NAMES]), *more])


def note_versions(results: Path) -> None:
    """Add the installed versions of the packages that ICHA requires to those noted before."""
    noted, now = _noted(results), set()
    for line in importlib.metadata.requires("icha") or ():
        name = canonicalize_name(Requirement(line).name)
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            if name != "icha":
                now.add(f"{name}=={importlib.metadata.version(name)}")
    if not now <= noted:
        with whole_file(results / MADE_WITH) as temporary:
            temporary.write_text("".join(f"{line}\n" for line in sorted(noted | now)), encoding="utf-8")


def _noted(results: Path) -> set[str]:
    try:
        return set((results / MADE_WITH).read_text(encoding="utf-8").split())
    except OSError:
        return set()  # no file, or not readable


def refuse_other_environment(project: Path, results: Path) -> None:
    """Refuse to publish in another environment than the one that the deposit promises.

    Parameters
    ----------
    project : the folder of the workflow, with uv.lock.
    results : the campaign's folder of results.

    Raises
    ------
    ValueError
        If a package is installed in another version than locked, if the imported package `icha` is not the project's,
        or if results may have been made with other versions (`note_versions`).
    """
    lock = (project / "uv.lock").read_text(encoding="utf-8")
    wrong = differences(lock)
    own, imported = package_of(project.resolve()), Path(importlib.util.find_spec("icha").origin).resolve().parent
    if imported != own:
        wrong = [f"  icha: imported from {imported}, and not from {own}", *wrong]
    if wrong:
        needed = (
            "`python -m icha.deposit.program > locked.txt`, then `pip install --constraint locked.txt 'icha[workflow]'`"
            if is_installed(project)
            else "`make environment`, and no other one"
        )
        raise ValueError(
            f"the environment is not that of uv.lock, which the deposit would promise; needed: {needed}:\n"
            + "\n".join(wrong)
        )
    locked = _locked(lock)
    made_with = (line.partition("==")[::2] for line in sorted(_noted(results)))
    if other := [f"{name} {version}" for name, version in made_with if version not in locked.get(name, {version})]:
        raise ValueError(
            f"{results}: some of it may have been made with versions that are not those of uv.lock, which the deposit "
            f"would promise; needed: remove {results}, and run the campaign again:\n{_listed(other)}"
        )


def differences(lock: str) -> list[str]:
    """List the packages that are installed in another version than locked.

    Packages that are locked but not installed are left out, since no environment has all optional parts.

    Parameters
    ----------
    lock : the text of uv.lock.
    """
    locked = _locked(lock)
    installed = {canonicalize_name(each.name): each.version for each in importlib.metadata.distributions() if each.name}
    return [
        f"  {name}: {version} is installed, {' or '.join(sorted(locked[name]))} is locked"
        for name, version in sorted(installed.items())
        if name in locked and version not in locked[name]
    ]


def _locked(lock: str) -> dict[str, set[str]]:
    """Versions of every locked package; a name may have several, for several Pythons and systems."""
    locked: dict[str, set[str]] = {}
    for package in _packages(lock):
        locked.setdefault(canonicalize_name(package["name"]), set()).add(package["version"])
    return locked


def _packages(lock: str) -> Iterator[dict]:
    """Packages of a lock, except the project itself, which has no version there."""
    return (package for package in tomllib.loads(lock)["package"] if "editable" not in package["source"])


def constraints(lock: str) -> list[str]:
    """Return the versions of a lock for this Python and system, as pip takes them."""
    found = []
    for package in _packages(lock):
        markers = package.get("resolution-markers")
        if markers is None or any(Marker(marker).evaluate() for marker in markers):
            found.append(f"{package['name']}=={package['version']}")
    return found


if __name__ == "__main__":
    print("\n".join(constraints((own_workflow() / "uv.lock").read_text(encoding="utf-8"))))
