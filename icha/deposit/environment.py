"""The environment that a deposit promises: the versions of the lock, now and when its results were made.

`python -m icha.deposit.environment` prints these versions for `pip install --constraint`.
"""

import contextlib
import importlib.metadata
import importlib.util
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

from icha.support.atomic_files import whole_file
from icha.support.program import is_installed, own_workflow, package_of

# In a campaign's folder of results: the versions of packages that any of them may have been made with.
MADE_WITH = "made_with.txt"
_MOST_NAMES = 20


def note_versions(results: Path) -> None:
    """Add the versions of the packages that ICHA asks for, as they are installed, to those that were noted before."""
    asked = {re.match(r"[\w.-]+", line)[0] for line in importlib.metadata.requires("icha") or ()} - {"icha"}
    noted, now = _noted(results), set()
    for name in asked:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            now.add(f"{_normal(name)}=={importlib.metadata.version(name)}")
    if not now <= noted:
        with whole_file(results / MADE_WITH) as temporary:
            temporary.write_text("".join(f"{line}\n" for line in sorted(noted | now)), encoding="utf-8")


def refuse_results_of_another_environment(results: Path, project: Path) -> None:
    """Refuse results that may have been made with other versions than a deposit promises.

    Parameters
    ----------
    results : the campaign's folder.
    project : the folder of the workflow, with uv.lock.

    Raises
    ------
    ValueError
        If other versions were noted; the message lists them and says what to do.
    """
    locked = {(_normal(package["name"]), package["version"]) for package in _locked(_text(project))}
    names = {name for name, _ in locked}
    made = (tuple(line.split("==")) for line in sorted(_noted(results)))
    if other := [f"  {name} {version}" for name, version in made if name in names and (name, version) not in locked]:
        raise ValueError(
            f"{results}: some of it may have been made with versions that are not those of uv.lock, which the deposit "
            f"would promise; needed: remove {results}, and run the campaign again:\n" + "\n".join(other)
        )


def _noted(results: Path) -> set[str]:
    try:
        return set((results / MADE_WITH).read_text(encoding="utf-8").split())
    except OSError:
        return set()  # none, or nothing can be read there


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
    wrong = differences(_text(project))
    own, imported = package_of(project.resolve()), Path(importlib.util.find_spec("icha").origin).resolve().parent
    if imported != own:
        wrong = [f"  icha: imported from {imported}, and not from {own}", *wrong]
    if wrong:
        needed = (
            "`python -m icha.deposit.environment > locked.txt`, then `pip install --constraint locked.txt "
            "'icha[workflow]'`"
            if is_installed(project)
            else "`make environment`, and no other one"
        )
        raise ValueError(
            f"the environment is not that of uv.lock, which the deposit would promise; needed: {needed}:\n"
            + "\n".join(wrong)
        )


def _text(project: Path) -> str:
    return (project / "uv.lock").read_text(encoding="utf-8")


def differences(lock: str) -> list[str]:
    """Packages that are installed in another version than in the lock, a line each.

    What is locked and not installed is left out (no environment has all optional parts), and so is what has no
    version there: the project itself.

    Parameters
    ----------
    lock : the text of uv.lock.
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


def constraints(lock: str) -> list[str]:
    """The versions of a lock for this Python and system, a line each, as pip takes them."""
    from packaging.markers import Marker

    def holds(markers):
        return markers is None or any(Marker(marker).evaluate() for marker in markers)

    return [
        f"{package['name']}=={package['version']}"
        for package in _locked(lock)
        if holds(package.get("resolution-markers"))
    ]


def _locked(lock: str) -> Iterator[dict]:
    """The packages of a lock, but for the project itself, which has no version there."""
    for package in tomllib.loads(lock)["package"]:
        if "editable" not in package["source"]:
            yield package


def _normal(name: str) -> str:
    """The name of a package as indices know it (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


if __name__ == "__main__":
    print("\n".join(constraints(_text(own_workflow()))))
