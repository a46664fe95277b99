"""What Snakemake does, as lines of JSON for `icha run`, which alone puts this folder where Snakemake looks.

They are written to the file descriptor that the environment variable ICHA_EVENTS names; every line has the name of an
event of Snakemake's and some of its fields.
"""

import json
import os

from snakemake_interface_logger_plugins.base import LogHandlerBase

_FIELDS = {
    "run_info": ("stats",),
    "resources_info": ("cores", "nodes"),
    "job_info": ("jobid", "rule_name", "rule_msg", "output", "log", "threads"),
    "job_finished": ("job_id",),
    "job_error": ("jobid", "rule_name", "output", "log"),
}


class LogHandler(LogHandlerBase):
    """Writes the events that the live view needs, and nothing for people to read."""

    writes_to_stream = False
    writes_to_file = False
    has_filter = True  # none: every event is wanted
    has_formatter = True
    needs_rulegraph = False

    def __post_init__(self):
        """Open the other end's pipe."""
        self._events = os.fdopen(int(os.environ["ICHA_EVENTS"]), "w", encoding="utf-8", buffering=1)

    def emit(self, record):
        """Write one line, if the record is of an event that is wanted."""
        name = str(getattr(record, "event", None) or "")
        if name in _FIELDS:
            event = {"event": name} | {field: getattr(record, field, None) for field in _FIELDS[name]}
        elif text := getattr(record, "remark", None):  # the Snakefile's own, for people
            event = {"event": "remark", "text": text}
        else:
            return
        try:
            self._events.write(json.dumps(event, default=str) + "\n")
        except OSError:
            pass  # nobody looks any more
