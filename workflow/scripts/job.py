"""Functions for the scripts of all jobs: write the log, report errors, verify checksums, end when Snakemake ends."""

import contextlib
import os
import sys
import threading
import time
import traceback
from contextlib import contextmanager
from pathlib import Path

from icha.support import checksums
from icha.support.atomic_files import move_only_while_owned
from icha.support.formatting import printable_lines
from icha.support.program import beginning_of, end_with_parent

# Environment variable, set by the Snakefile: number and start time of Snakemake's process.
SNAKEMAKE = "ICHA_SNAKEMAKE"


def _solver_errors() -> list[type[Exception]]:
    """Return the error classes for solvers that did not converge, from the modules that this job has imported."""
    names = {
        "icha.simulation": "ConvergenceError",
        "icha.contact.model": "NotConverged",
    }
    return [getattr(sys.modules[module], name) for module, name in names.items() if module in sys.modules]


@contextmanager
def job_context(snakemake):
    """Context manager: verify the inputs of a job, write checksums of its outputs, and report its errors.

    All output goes to the log of the job. An error ends the job, and the error message is written to the log. For an
    unexpected error, the traceback is written to a second file in the folder of the log, for the developers.

    Yields
    ------
    asked : checksum of the parameters of the job (`checksums.hash_parameters`).
    inputs : checksums of inputs that are results.
    """
    _end_with_snakemake()
    move_only_while_owned()
    log, results = snakemake.log[0], _results(snakemake)
    outputs = [_result(results, path) for path in snakemake.output]
    terminal = os.dup(2)
    try:
        with open(log, "w", encoding="utf-8") as file:
            sys.stdout.flush()
            sys.stderr.flush()
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        for path in outputs:
            checksums.begin(results, path)
        inputs = _checksums_of(results, snakemake.input)
        # This checksum is computed before the script runs, because the script may change its parameters.
        asked = checksums.hash_parameters(map(repr, snakemake.params))
        yield asked, inputs
        for path in outputs:
            checksums.write_checksum(results, path, asked=asked, inputs=inputs)
        sys.stdout.flush()
    except Exception as error:
        if isinstance(error, (ValueError, OSError, *_solver_errors())):
            _print(f"Error: {error}", terminal)
        else:
            _print(f"Error: unexpected {error!r}", terminal)
            with contextlib.suppress(OSError), open(f"{log}.traceback", "w", encoding="utf-8") as details:
                traceback.print_exc(file=details)
                _print(f"Details for the developers: {log}.traceback", terminal)
        sys.exit(1)


def refuse_changed(file, sha256, name=None):
    """Raise an error if a file has changed; otherwise the results would be attributed to the old content.

    Parameters
    ----------
    file : path of the file.
    sha256 : expected checksum of the file.
    name : original name of a copied file, for the message.

    Raises
    ------
    ValueError
        If the checksum differs.
    """
    if checksums.sha256_of(Path(file)) != sha256:
        raise ValueError(f"{name or file} has changed since the campaign started; repeat the command")


def attributes(snakemake):
    """Return the attributes of a job's dataset: those in its rule, and an `id` that is the same on all machines."""
    attributes = snakemake.params.attributes
    path = Path(snakemake.output[0]).relative_to(_results(snakemake)).with_suffix("")
    return {"id": f"{attributes['campaign']}/{path.as_posix()}"} | attributes


def _results(snakemake):
    """Return the campaign's folder of results."""
    return snakemake.log[0].partition("/logs/")[0]


def _result(results, path):
    """Return the name of a result in the checksums: its path, or for a file SHA256SUMS, the path of the folder."""
    file = Path(path).relative_to(results)
    return str(file.parent if file.name == "SHA256SUMS" else file)


def _checksums_of(results, inputs):
    """Return the checksums of the inputs that are results; raise an error that names all damaged inputs."""
    paths = [os.path.relpath(path, results) for path in inputs if path.startswith(f"{results}/")]
    damaged = [path for path in paths if not checksums.is_whole(results, path, thorough=True)]
    for path in damaged:
        # Mark the file, so that the next call also finds it damaged.
        with contextlib.suppress(OSError):
            checksums.distrust(results, path)
    if damaged:
        names = ", ".join(f"{results}/{path}" for path in damaged)
        raise ValueError(
            f"{names}: does not match its checksum; repeat the command, which renames the file to *.damaged and "
            "computes it again"
        )
    return {path: checksums.sha256_as_written(results, path) for path in paths}


def _print(text, terminal):
    """Print to the log, or to the terminal if the log cannot be written, for example on a full disk."""
    line = f"{printable_lines(text)}\n".encode()
    try:
        sys.stdout.flush()
        if os.write(1, line) == len(line):
            return
    except OSError:
        pass
    os.dup2(terminal, 1)
    os.dup2(terminal, 2)
    with contextlib.suppress(OSError):
        sys.stdout.flush()  # the rest of earlier output
        os.write(terminal, line)


def _end_with_snakemake():
    """End this process when Snakemake ends, or now if Snakemake has already ended.

    Otherwise the results of an orphaned job could replace the results of the next call.
    """
    number, _, began = os.environ.get(SNAKEMAKE, "").partition(" ")
    if not number:
        return  # not a job of Snakemake, or not on Linux

    def has_ended():
        try:
            return beginning_of(int(number)) != began  # another process may have the number now
        except (ProcessLookupError, FileNotFoundError):
            return True

    def wait():
        while not has_ended():
            time.sleep(0.2)
        os._exit(1)

    if has_ended():
        os._exit(1)
    if os.getppid() == int(number):
        end_with_parent(int(number))
    threading.Thread(target=wait, daemon=True).start()
