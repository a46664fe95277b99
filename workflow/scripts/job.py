"""Functions for the scripts of all jobs: write the log, report errors, compute the files of a batch."""

import contextlib
import os
import sys
import time
import traceback
from contextlib import contextmanager

from icha.datasets.stamp import why_outdated
from icha.support.formatting import printable_lines


@contextmanager
def job_context(snakemake):
    """Context manager: write all output of a job to its log, and report its errors.

    An error ends the job, and the error message is written to the log. For an unexpected error, the traceback is
    written to a second file in the folder of the log, for the developers.
    """
    log, terminal = snakemake.log[0], os.dup(2)
    try:
        with open(log, "w", encoding="utf-8") as file:
            sys.stdout.flush()
            sys.stderr.flush()
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        yield
        sys.stdout.flush()
    except Exception as error:
        if isinstance(error, ValueError | OSError):
            _print(f"Error: {error}", terminal)
        else:
            _print(f"Error: unexpected {error!r}", terminal)
            with contextlib.suppress(OSError), open(f"{log}.traceback", "w", encoding="utf-8") as details:
                traceback.print_exc(file=details)
                _print(f"Details for the developers: {log}.traceback", terminal)
        sys.exit(1)


def compute_batch(outputs, arguments, task, program, licence):
    """Compute those files of a batch that do not exist with their stamps; print their names and times.

    Raise ValueError if the program has changed since Snakemake planned the jobs: the stamps would be wrong.

    Parameters
    ----------
    arguments : keyword arguments of the task for each file; the argument `attributes` contains the stamp.
    task, program : functions that compute a file, and that return the fingerprint of the program from its arguments.
    licence : licence that the files state; it is no parameter of the job, because a new licence computes no file again.
    """
    if any(program(each) != each["attributes"]["program_sha256"] for each in arguments):
        raise ValueError("the program has changed since the campaign started; repeat the command")
    for number, (output, each) in enumerate(zip(outputs, arguments, strict=True)):
        each["attributes"]["license"] = licence
        if not os.path.exists(output) or why_outdated(output, each["attributes"]):
            name, start = each["attributes"]["id"], time.perf_counter()
            print(f"{number + 1} of {len(outputs)}: {name}", flush=True)
            task(output=output, **each)
            print(f"{name}: computed in {time.perf_counter() - start:.3g} s", flush=True)


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
