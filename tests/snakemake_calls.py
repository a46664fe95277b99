"""Calls of Snakemake in copies of the project, as forks of one server process that has imported the libraries."""

import multiprocessing
import os
import sys
from pathlib import Path

# A fork of a test process would inherit locks and thread pools of libraries, and modules of another copy of `icha`. The
# server has none of them.
_server = multiprocessing.get_context("forkserver")
_server.set_forkserver_preload(["snakemake.cli", "xarray", "h5netcdf", "pydantic", "jinja2", "scipy.stats"])


def call_snakemake(project: Path, arguments: list[str], environment: dict[str, str], output: str) -> int:
    """Call Snakemake with the modules of a copy of the project; return its exit code; `output` is a file."""
    call = _server.Process(target=_call, args=(project, arguments, environment, output))
    call.start()
    call.join()
    return call.exitcode


def _call(project, arguments, environment, output):
    file = os.open(output, os.O_WRONLY)
    for descriptor in (1, 2):
        os.dup2(file, descriptor)
    sys.stdout, sys.stderr = (open(descriptor, "w", buffering=1, encoding="utf-8") for descriptor in (1, 2))
    os.chdir(project)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = arguments
    sys.path[:0] = [str(project)]
    from snakemake.cli import main

    main(arguments[1:])
