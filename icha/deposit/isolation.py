"""Programs that keep a rerun of a stranger's source to its folder, and off the network once all is installed."""

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

BWRAP, PODMAN, DOCKER = "bwrap", "podman", "docker"
NO_ISOLATION = "none"
CONTAINERS = (PODMAN, DOCKER)
# Has make, and what it takes to build packages.
IMAGE = f"docker.io/library/python:{sys.version_info.major}.{sys.version_info.minor}"
# What a program must read of a system to run, and nothing that is anybody's own.
_SYSTEM = ("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64")
_SETTINGS = (
    *("passwd", "group", "hosts", "resolv.conf", "nsswitch.conf", "host.conf", "gai.conf", "localtime"),
    *("ssl", "ca-certificates", "pki", "ld.so.cache", "ld.so.conf", "ld.so.conf.d", "alternatives", "fonts"),
)
_HOME = ".home"


def works(program: str) -> bool:
    """Whether a program of isolation is installed and can isolate here: not all systems let users do it."""
    if not shutil.which(program):
        return False
    asked = [*_bwrap(Path("/tmp"), network=False), "true"] if program == BWRAP else [program, "info"]
    return not subprocess.run(asked, stdin=subprocess.DEVNULL, capture_output=True).returncode


def isolated(
    program: str, command: list[str], folder: Path, variables: Mapping[str, str], *, network: bool
) -> list[str]:
    """A command that runs another one with nothing to write to but a folder, and a `/tmp` of its own.

    What was isolated may have left anything in the folder, links to files of anybody's too: take nothing from there
    without a look at what it is.

    Parameters
    ----------
    program : one of the names above; the command is left as it is with `NO_ISOLATION`.
    command : what is run.
    folder : where it is run, and what it may write to, under the same name.
    variables : the environment variables that containers are to pass on.
    network : whether it may use the network.
    """
    if program == BWRAP:
        return [*_bwrap(folder, network=network), "--chdir", str(folder), *command]
    if program in CONTAINERS:
        return [*_container(program, folder, variables, network=network), *command]
    return command


def make_home(program: str, folder: Path, variables: Mapping[str, str]) -> dict[str, str]:
    """Make a home for what is isolated, in its folder, and return its environment variables; caches are there, too."""
    if program == NO_ISOLATION:
        return dict(variables)
    home = folder / _HOME
    home.mkdir(exist_ok=True)
    kept = {name: value for name, value in variables.items() if name != "UV_CACHE_DIR"}
    return kept | {"HOME": str(home), "TMPDIR": "/tmp"}


def _bwrap(folder: Path, *, network: bool) -> list[str]:
    seen = ["--proc", "/proc", "--dev", "/dev", "--tmpfs", "/tmp"]
    for path in _SYSTEM:
        if os.path.islink(path):
            seen += ["--symlink", os.readlink(path), path]
        elif os.path.isdir(path):
            seen += ["--ro-bind", path, path]
    for path in (f"/etc/{name}" for name in _SETTINGS):
        seen += ["--ro-bind-try", path, path]
    for path in sorted({sys.base_prefix, sys.prefix, os.path.realpath(sys.base_prefix)}):
        if not path.startswith("/usr/"):
            seen += ["--ro-bind", path, path]
    rights = ["--unshare-all", *(["--share-net"] if network else []), "--unshare-user", "--cap-drop", "ALL"]
    # Ends with us; has no terminal to write commands to, for it is started in a session of its own.
    return [BWRAP, "--die-with-parent", *rights, *seen, "--bind", str(folder), str(folder)]


def _container(program: str, folder: Path, variables: Mapping[str, str], *, network: bool) -> list[str]:
    rights = ["--cap-drop=all", "--security-opt=no-new-privileges", "--read-only", "--tmpfs=/tmp"]
    rights += ["--userns=keep-id"] if program == PODMAN else [f"--user={os.getuid()}:{os.getgid()}"]
    passed = [f"--env={name}={value}" for name, value in variables.items() if name != "PATH"]
    rights += [] if network else ["--network=none"]
    return [
        program,
        "run",
        "--rm",
        "--init",
        *rights,
        f"--volume={folder}:{folder}",
        f"--workdir={folder}",
        *passed,
        IMAGE,
    ]
