"""What the scripts of all jobs share: where they write what they have to say, and how they fail."""

import json
import os
import resource
import sys
import traceback
from contextlib import contextmanager
from pathlib import Path


def _failures_of_solvers():
    """How solvers say that they did not converge. Most jobs do without them, so nothing is imported for this."""
    names = {
        "icha.simulation": "ConvergenceError",
        "icha.equilibrium": "NotConverged",
        "icha.reference.boundary_elements": "NotSolved",
    }
    return [getattr(sys.modules[module], name) for module, name in names.items() if module in sys.modules]


@contextmanager
def logged(log):
    """Send all output to the file `log`; an error ends the job with its message there.

    The errors that users can mend say all in their message. The traceback of any other one is for the developers
    and is kept beside the log; so is what the job took, which Snakemake cannot see of one that was handed over.
    """
    with open(log, "w", encoding="utf-8", buffering=1) as file:
        sys.stdout.flush()
        sys.stderr.flush()
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
        try:
            yield
        except Exception as error:
            expected = (ValueError, OSError, *_failures_of_solvers())
            print(f"Error: {error}" if isinstance(error, expected) else f"Error: {error!r}, which was not expected")
            if not isinstance(error, expected):
                with open(f"{log}.traceback", "w", encoding="utf-8") as details:
                    traceback.print_exc(file=details)
                print(f"Details for the developers: {log}.traceback")
            sys.exit(1)
        finally:
            took = resource.getrusage(resource.RUSAGE_SELF)
            usage = {"cpu_seconds": round(took.ru_utime + took.ru_stime, 3), "megabytes": took.ru_maxrss // 1024}
            Path(log).with_suffix(".usage.json").write_text(json.dumps(usage) + "\n", encoding="ascii")
