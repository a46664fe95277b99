"""Identify the program that made the results: its source, as committed or installed, and the installed packages.

`python -m icha.deposit.program` prints the locked versions for `pip install --constraint`.
"""

import hashlib
import importlib.metadata
import importlib.util
import io
import os
import subprocess
import tarfile
import tomllib
from base64 import urlsafe_b64decode
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from packaging.markers import Marker
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from icha.support.atomic_files import whole_file
from icha.support.checksums import sha256_of
from icha.support.program import INSTALLED, is_installed, own_workflow, package_of

# Files and folders of the program that computes results. Every file in these folders must be committed.
PROGRAM = ("Snakefile", "icha/", "workflow/", "profiles/default/")
# Folder of configurations, which need no commit, because a deposit contains the configuration that was used.
_CONFIGURATIONS = "config/"
# File in the folder of results. It lists all package versions that were installed when results were computed.
MADE_WITH = "made_with.txt"
# With this environment, settings of the user or the system do not change what git reads.
_GIT_ENVIRONMENT = {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1", "GIT_NO_REPLACE_OBJECTS": "1"}
# Largest number of names in a message.
_MOST_NAMES = 20


class Source(NamedTuple):
    """Source of the program at one revision.

    Attributes
    ----------
    revision : git commit, or version and checksum of the installed files.
    files : content and permissions of every file, by path in the repository.
    """

    revision: str
    files: Mapping[str, tuple[bytes, int]]

    def export(self, folder: Path) -> None:
        """Write all files to a folder."""
        for name, (content, mode) in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            path.chmod(mode)


def program_source(project: str | os.PathLike) -> Source:
    """Return the source of the program whose Snakefile is in the folder `project`, as committed or as installed.

    Raises
    ------
    ValueError
        If files differ from the committed or installed files. The message lists these files and advises what to do.
    """
    project = Path(project).resolve()
    return _installed_source(project.parent) if is_installed(project) else _committed_source(project)


def program_files(workflow: Path) -> dict[str, Path]:
    """Return the files of the workflow and of the package, except bytecode, by path in the repository."""
    found = {}
    for name in PROGRAM:
        top = package_of(workflow) if name == "icha/" else workflow / name
        for file in [top] if top.is_file() else sorted(top.rglob("*")):
            if "__pycache__" not in file.parts and not file.is_dir():
                found[(Path(name) / file.relative_to(top)).as_posix()] = file
    return found


def _committed_source(project: Path) -> Source:
    """Return the source at the current git commit; the project may be a folder inside a larger repository."""
    commit = _git(project, "rev-parse", "--verify", "--quiet", "HEAD^{commit}").decode("ascii").strip()
    packed = _git(project, "archive", "--format=tar", "HEAD")
    if not commit or not packed:
        raise ValueError(
            f"{project}: is not a git repository or has no commit, so the program that made the data cannot be "
            "identified. Use a clone of the repository, or `git init`, `git add` and `git commit` this folder"
        )
    files, links = {}, []
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        for member in archive:
            if member.isfile():
                files[member.name] = archive.extractfile(member).read(), 0o755 if member.mode & 0o100 else 0o644
            elif not member.isdir():
                links.append(f"a link: {member.name}")
    recorded = {
        name: hashlib.sha256(content).hexdigest()
        for name, (content, _) in files.items()
        if not name.startswith(_CONFIGURATIONS)
    }
    present = {name: project / name for name in recorded if (project / name).is_file()} | program_files(project)
    if wrong := [*links, *_changes(recorded, present, "not committed")]:
        raise ValueError(
            f"{project}: differs from commit {commit[:12]}, so the deposit would not contain the program that made the "
            f"data. Commit these changes with `git commit`, or undo the changes:\n{_listed(wrong)}"
        )
    return Source(commit, files)


def _git(project: Path, *arguments: str) -> bytes:
    """Return the output of a git command; empty if the command fails."""
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    command = ["git", "-c", "safe.directory=*", *arguments]
    try:
        done = subprocess.run(command, cwd=project, env=inherited | _GIT_ENVIRONMENT, capture_output=True)
    except FileNotFoundError:
        raise ValueError("git: no such program; install git, which identifies the source of the program") from None
    return done.stdout if done.returncode == 0 else b""


def _changes(recorded: Mapping[str, str], present: Mapping[str, Path], added: str) -> list[str]:
    """List changed or missing files of `recorded`, then files that are only in `present` (label `added`)."""
    changed = [
        f"changed: {name}"
        for name, digest in recorded.items()
        if name not in present or sha256_of(present[name]) != digest
    ]
    return changed + [f"{added}: {name}" for name in present if name not in recorded]


def _installed_source(packages: Path) -> Source:
    """Return the source of the program that was installed from a wheel into the folder `packages`.

    The revision contains the version and a checksum: the SHA-256 of the list that `sha256sum` prints for all files.
    """
    installed = next(iter(importlib.metadata.distributions(name="icha", path=[str(packages)])), None)
    if installed is None:
        raise ValueError(
            f"{packages}: the package `icha` is not installed here, so the program that made the data cannot be "
            "identified. Install it: pip install 'icha[workflow]'"
        )
    recorded = {
        str(file): urlsafe_b64decode(f"{file.hash.value}=").hex()
        for file in sorted(installed.files or (), key=str)
        if file.parts[0] in ("icha", INSTALLED) and file.hash and file.hash.mode == "sha256" and file.suffix != ".pyc"
    }
    present = {
        file.relative_to(packages).as_posix(): file
        for folder in ("icha", INSTALLED)
        for file in (packages / folder).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    if wrong := _changes(recorded, present, "not of the installed version"):
        raise ValueError(
            f"{packages}: differs from icha {installed.version}, so the deposit would not contain the program that "
            "made the data. Use `pip install --force-reinstall icha`, or change the program in a clone of the "
            f"repository. The differences are:\n{_listed(wrong)}"
        )
    sums = "".join(f"{digest}  {name}\n" for name, digest in recorded.items())
    files = {name.removeprefix(f"{INSTALLED}/"): (present[name].read_bytes(), 0o644) for name in recorded}
    return Source(f"icha-{installed.version}-{hashlib.sha256(sums.encode()).hexdigest()}", files)


def _listed(names: list[str]) -> str:
    more = [f"  and {len(names) - _MOST_NAMES} more"] if len(names) > _MOST_NAMES else []
    return "\n".join([*(f"  {name}" for name in names[:_MOST_NAMES]), *more])


def note_versions(results: Path) -> None:
    """Add the installed versions of required packages to the list `MADE_WITH` in the folder of results."""
    noted, installed = _noted(results), installed_versions()
    required = {canonicalize_name(Requirement(line).name) for line in importlib.metadata.requires("icha") or ()}
    now = {f"{name}=={installed[name]}" for name in required - {"icha"} if name in installed}
    if not now <= noted:
        with whole_file(results / MADE_WITH) as temporary:
            temporary.write_text("".join(f"{line}\n" for line in sorted(noted | now)), encoding="utf-8")


def _noted(results: Path) -> set[str]:
    file = results / MADE_WITH
    return set(file.read_text(encoding="utf-8").split()) if file.is_file() else set()


def refuse_other_environment(project: Path, results: Path) -> None:
    """Raise ValueError if the installed packages differ from the lock file that the deposit contains.

    Parameters
    ----------
    project : folder of the workflow, with uv.lock.
    results : folder of results of the campaign.

    Raises
    ------
    ValueError
        If the version of an installed package is not the locked version, if the imported package `icha` is not that of
        the project, or if results may have been made with other versions (`note_versions`).
    """
    lock = (project / "uv.lock").read_text(encoding="utf-8")
    wrong = [f"  {name}: {text}" for name, text in version_differences(lock).items()]
    expected, imported = package_of(project.resolve()), Path(importlib.util.find_spec("icha").origin).resolve().parent
    if imported != expected:
        wrong.insert(0, f"  icha: imported from {imported}; expected from {expected}")
    if wrong:
        command = "`make environment`"
        if is_installed(project):
            command = (
                "`python -m icha.deposit.program > locked.txt`, then "
                "`pip install --constraint locked.txt 'icha[workflow]'`"
            )
        problems = "\n".join(wrong)
        raise ValueError(f"the installed packages are not those of uv.lock in the deposit. Use {command}:\n{problems}")
    locked = locked_versions(lock)
    made_with = (line.partition("==")[::2] for line in sorted(_noted(results)))
    if other := [f"{name} {version}" for name, version in made_with if locked.get(name, version) != version]:
        raise ValueError(
            f"{results}: some results may have been made with other versions than those of uv.lock in the deposit. "
            f"Remove {results}, and run the campaign again:\n{_listed(other)}"
        )


def version_differences(lock: str) -> dict[str, str]:
    """Return a text for each installed package whose version is not the locked version; `lock` is the text of uv.lock.

    Locked packages that are not installed are left out, since no environment has all optional packages.
    """
    locked = locked_versions(lock)
    return {
        name: f"{version} is installed, {locked[name]} is locked"
        for name, version in sorted(installed_versions().items())
        if locked.get(name, version) != version
    }


def installed_versions() -> dict[str, str]:
    """Return the version of every installed package."""
    return {canonicalize_name(each.name): each.version for each in importlib.metadata.distributions() if each.name}


def locked_versions(lock: str) -> dict[str, str]:
    """Return the version of every package in the text of a lock file, for this Python and system.

    ICHA itself is left out, because the lock file does not contain the version of ICHA.
    """
    found = {}
    for package in tomllib.loads(lock)["package"]:
        markers = package.get("resolution-markers")
        applies = markers is None or any(Marker(marker).evaluate() for marker in markers)
        if applies and "editable" not in package["source"]:
            found[canonicalize_name(package["name"])] = package["version"]
    return found


if __name__ == "__main__":
    for name, version in locked_versions((own_workflow() / "uv.lock").read_text(encoding="utf-8")).items():
        print(f"{name}=={version}")
