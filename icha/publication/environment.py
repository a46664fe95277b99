"""The environment that a deposit promises: the packages of the lock, and no other versions.

`python -m icha.publication.environment` prints these versions for `pip install --constraint`.
"""

import importlib.metadata
import importlib.util
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

from icha.support.program import is_installed, own_workflow, package_of

_MOST_NAMES = 20


def refuse_other_environment(project: Path) -> None:
    """Refuse to go on in an environment that is not the one that a deposit promises.

    Parameters
    ----------
    project : the folder of the workflow, with uv.lock.

    Raises
    ------
    ValueError
        If a package that is installed has another version than in the lock, or if the package `icha` that jobs import
        is not the one of the project.
    """
    wrong = differences(project / "uv.lock")
    own, imported = package_of(project.resolve()), Path(importlib.util.find_spec("icha").origin).resolve().parent
    if imported != own:
        wrong = [f"  icha: imported from {imported}, and not from {own}", *wrong]
    if wrong:
        needed = (
            "`python -m icha.publication.environment > locked.txt`, then `pip install --constraint locked.txt "
            "'icha[workflow]'`"
            if is_installed(project)
            else "`make environment`, and no other one"
        )
        raise ValueError(
            f"the environment is not that of uv.lock, which the deposit would promise; needed: {needed}:\n"
            + "\n".join(wrong)
        )


def differences(lock: Path) -> list[str]:
    """Packages that are installed in another version than in the lock, a line each.

    What is locked and not installed is left out (no environment has all optional parts), and so is what has no
    version there: the project itself.
    """
    locked: dict[str, set[str]] = {}
    for package in _locked(lock):
        locked.setdefault(_normal(package["name"]), set()).add(package["version"])
    installed = {_normal(each.name): each.version for each in importlib.metadata.distributions() if each.name}
    wrong = [
        f"  {name}: {version} is installed, {' or '.join(sorted(locked[name]))} is locked"
        for name, version in sorted(installed.items())
        if name in locked and version not in locked[name]
    ]
    return [*wrong[:_MOST_NAMES], *([f"  and {len(wrong) - _MOST_NAMES} more"] if len(wrong) > _MOST_NAMES else [])]


def constraints(lock: Path) -> list[str]:
    """The versions of a lock for this Python and system, a line each, as pip takes them."""
    from packaging.markers import Marker

    def holds(markers):
        return markers is None or any(Marker(marker).evaluate() for marker in markers)

    return [
        f"{package['name']}=={package['version']}"
        for package in _locked(lock)
        if holds(package.get("resolution-markers"))
    ]


def _locked(lock: Path) -> Iterator[dict]:
    """The packages of a lock, but for the project itself, which has no version there."""
    for package in tomllib.loads(lock.read_text(encoding="utf-8"))["package"]:
        if "editable" not in package["source"]:
            yield package


def _normal(name: str) -> str:
    """The name of a package as indices know it (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


if __name__ == "__main__":
    print("\n".join(constraints(own_workflow() / "uv.lock")))
