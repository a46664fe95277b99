"""The environment that a deposit promises: the packages of the lock, and no other versions."""

import importlib.metadata
import importlib.util
import re
import tomllib
from pathlib import Path

_MOST_NAMES = 20


def refuse_other_environment(project: Path) -> None:
    """Refuse to go on in an environment that is not the one that a deposit promises.

    Parameters
    ----------
    project : the folder with uv.lock and the package `icha`.

    Raises
    ------
    ValueError
        If a package that is installed has another version than in the lock, or if the package `icha` that jobs import
        is not the one of the project.
    """
    wrong = differences(project / "uv.lock")
    own, imported = project.resolve() / "icha", Path(importlib.util.find_spec("icha").origin).resolve().parent
    if imported != own:
        wrong = [f"  icha: imported from {imported}, and not from {own}", *wrong]
    if wrong:
        raise ValueError(
            "the environment is not that of uv.lock, which the deposit would promise; needed: `make environment`, "
            "and no other one:\n" + "\n".join(wrong)
        )


def differences(lock: Path) -> list[str]:
    """Packages that are installed in another version than in the lock, a line each.

    What is locked and not installed is left out (no environment has all optional parts), and so is what has no
    version there: the project itself.
    """
    locked: dict[str, set[str]] = {}
    for package in tomllib.loads(lock.read_text(encoding="utf-8"))["package"]:
        if "editable" not in package["source"]:
            locked.setdefault(_normal(package["name"]), set()).add(package["version"])
    installed = {_normal(each.name): each.version for each in importlib.metadata.distributions() if each.name}
    wrong = [
        f"  {name}: {version} is installed, {' or '.join(sorted(locked[name]))} is locked"
        for name, version in sorted(installed.items())
        if name in locked and version not in locked[name]
    ]
    return [*wrong[:_MOST_NAMES], *([f"  and {len(wrong) - _MOST_NAMES} more"] if len(wrong) > _MOST_NAMES else [])]


def _normal(name: str) -> str:
    """The name of a package as indices know it (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()
