"""Identify the program that made the results: its source as it ran, its revision, and the locked packages.

`python -m icha.deposit.program` prints the locked versions for `pip install --constraint`.
"""

import hashlib
import importlib.metadata
import os
import shutil
import subprocess
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from packaging.markers import Marker
from packaging.utils import canonicalize_name

import icha
from icha.support.checksums import sha256_of
from icha.support.program import own_workflow

# Folder of configurations, which are not part of the source: a deposit contains the configuration that was used.
_CONFIGURATIONS = "config"


class Source(NamedTuple):
    """Source of the program as it ran.

    Attributes
    ----------
    revision : git commit, or version and checksum of all files.
    files : file on this machine, by path in the repository.
    """

    revision: str
    files: Mapping[str, Path]

    def export(self, folder: Path) -> None:
        """Copy all files to a folder."""
        for name, file in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, folder / name)


def program_source(workflow: str | os.PathLike) -> Source:
    """Return the source of the program: the package that runs, and the workflow in the folder `workflow`.

    The files are those of a wheel, except configurations, so a clone and an installation have the same source. The
    revision is the git commit if all files are committed. Otherwise it consists of the version of ICHA and the SHA-256
    of the list that `sha256sum` prints for all files.
    """
    workflow = Path(workflow).resolve()
    build = tomllib.loads((workflow / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["build"]
    names = build["targets"]["wheel"]["hooks"]["custom"]["files"]
    tops = {"icha": Path(icha.__file__).parent} | {name: workflow / name for name in names if name != _CONFIGURATIONS}
    files = {}
    for name, top in tops.items():
        for file in [top] if top.is_file() else sorted(top.rglob("*")):
            if file.is_file() and "__pycache__" not in file.parts:
                files[(Path(name) / file.relative_to(top)).as_posix()] = file
    files = dict(sorted(files.items()))
    commit = _git(workflow, "rev-parse", "--verify", "HEAD^{commit}")
    tracked = (_git(workflow, "ls-files", "-z") or "").split("\0")
    changes = _git(workflow, "status", "--porcelain", "--untracked-files=no", "--", *map(str, tops.values()))
    if commit and changes == "" and set(files) <= set(tracked):
        return Source(commit, files)
    sums = "".join(f"{sha256_of(file)}  {name}\n" for name, file in files.items())
    version = importlib.metadata.version("icha")
    return Source(f"icha-{version}-{hashlib.sha256(sums.encode()).hexdigest()}", files)


def _git(folder: Path, *arguments: str) -> str | None:
    """Return the output of a git command in a folder; None if the command fails, for example without a repository."""
    # Git sets variables for its hooks, which name another repository.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    try:
        done = subprocess.run(["git", *arguments], cwd=folder, env=environment, capture_output=True, text=True)
    except FileNotFoundError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def refuse_other_environment(workflow: Path) -> None:
    """Raise ValueError if installed packages differ from the lock file `uv.lock` in the folder of the workflow."""
    wrong = version_differences((workflow / "uv.lock").read_text(encoding="utf-8"))
    if wrong:
        listed = "\n".join(f"  {name}: {text}" for name, text in wrong.items())
        raise ValueError(
            "the installed packages are not those of uv.lock in the deposit. Use `make environment` in a clone; "
            "otherwise `python -m icha.deposit.program > locked.txt`, then "
            f"`pip install --constraint locked.txt 'icha[workflow]'`:\n{listed}"
        )


def version_differences(lock: str) -> dict[str, str]:
    """Return a text for each installed package whose version is not the locked version; `lock` is the text of uv.lock.

    Locked packages that are not installed are left out, since no environment has all optional packages.
    """
    installed = {canonicalize_name(each.name): each.version for each in importlib.metadata.distributions() if each.name}
    locked = locked_versions(lock)
    return {
        name: f"{version} is installed, {locked[name]} is locked"
        for name, version in sorted(installed.items())
        if locked.get(name, version) != version
    }


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
