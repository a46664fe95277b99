"""What the scripts of all jobs share: where they say what they have to say, how they fail, checksums of results."""

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

# Set by the Snakefile: number and beginning of the process that wants the job.
SNAKEMAKE = "ICHA_SNAKEMAKE"


def _failures_of_solvers():
    """How solvers say that they did not converge. Most jobs do without them, so nothing is imported for this."""
    names = {
        "icha.simulation": "ConvergenceError",
        "icha.contact.model": "NotConverged",
        "icha.references.finite_range": "NotSolved",
    }
    return [getattr(sys.modules[module], name) for module, name in names.items() if module in sys.modules]


@contextmanager
def guarded(snakemake):
    """Surround the work of a job: its inputs must be what was written, its outputs get checksums, its errors are told.

    Its context gives what was asked of the job (`checksums.asked_of`), and checksums of inputs that are results.

    All output goes to the job's log; an error ends the job with its message there. The errors that users can mend say
    all in their message. The traceback of any other one is for the developers and is kept beside the log.
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
        # Before the work, which could change what it is given.
        asked = checksums.asked_of(map(repr, snakemake.params))
        yield asked, inputs
        for path in outputs:
            checksums.write_checksum(results, path, asked=asked, inputs=inputs)
        sys.stdout.flush()
    except Exception as error:
        expected = (ValueError, OSError, *_failures_of_solvers())
        if isinstance(error, expected):
            _say(f"Error: {error}", terminal)
        else:
            _say(f"Error: {error!r}, which was not expected", terminal)
            with contextlib.suppress(OSError), open(f"{log}.traceback", "w", encoding="utf-8") as details:
                traceback.print_exc(file=details)
                _say(f"Details for the developers: {log}.traceback", terminal)
        sys.exit(1)


def refuse_changed(file, sha256, name=None):
    """Refuse a file that was read, or copied from the file `name`, unless its content is what was asked for.

    Raises
    ------
    ValueError
        If it has another SHA-256: results would be known as those of what was there before.
    """
    if checksums.sha256_of(Path(file)) != sha256:
        raise ValueError(f"{name or file} has changed since the campaign was begun; give the same command again")


def attributes(snakemake):
    """Attributes of the dataset that a job writes: those of the rule, and `id`, the same wherever it is computed."""
    own = snakemake.params.attributes
    path = Path(snakemake.output[0]).relative_to(_results(snakemake)).with_suffix("")
    return {"id": f"{own['campaign']}/{path.as_posix()}"} | own


def _results(snakemake):
    """The campaign's folder of results."""
    return snakemake.log[0].partition("/logs/")[0]


def _result(results, path):
    """What has the checksum of an output: itself, but the folder whose files it lists if it is a list of checksums."""
    file = Path(path).relative_to(results)
    return str(file.parent if file.name == "SHA256SUMS" else file)


def _checksums_of(results, inputs):
    """Checksums of those inputs that are results; an error names all that are not what was written.

    The next call will find these, too.
    """
    paths = [os.path.relpath(path, results) for path in inputs if path.startswith(f"{results}/")]
    wrong = [path for path in paths if not checksums.is_whole(results, path, thorough=True)]
    for path in wrong:
        with contextlib.suppress(OSError):
            checksums.distrust(results, path)
    if wrong:
        names = ", ".join(f"{results}/{path}" for path in wrong)
        raise ValueError(
            f"{names}: not what was written, by its checksum; give the same command again, which sets it aside as "
            f"*.damaged and makes it again"
        )
    return {path: checksums.sha256_as_written(results, path) for path in paths}


def _say(text, terminal):
    """Print to the log; to the terminal if that cannot be written, on a full disk for one."""
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
        sys.stdout.flush()  # what had been kept back
        os.write(terminal, line)


def _end_with_snakemake():
    """End this process when Snakemake ends, or now if it has: nobody would know of the results of an orphan.

    Worse, it could replace those of the next call, which computes them, too, and maybe of other values.
    """
    number, _, began = os.environ.get(SNAKEMAKE, "").partition(" ")
    if not number:
        return  # no job of Snakemake, or not on Linux

    def is_gone():
        try:
            return beginning_of(int(number)) != began  # another process may have the number by now
        except (ProcessLookupError, FileNotFoundError):
            return True

    def wait():
        while not is_gone():
            time.sleep(0.2)
        os._exit(1)

    if is_gone():
        os._exit(1)
    if os.getppid() == int(number):
        end_with_parent(int(number))
    threading.Thread(target=wait, daemon=True).start()
