"""Logger plugin that writes events of Snakemake for `icha run`, as lines of JSON.

The environment variable ICHA_EVENTS contains the file descriptor for the lines. Every line has the name of an event and
some fields of this event. Only `icha run` makes this plugin available to Snakemake.
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
    """Log handler that writes selected events of Snakemake for the live view of `icha run`."""

    writes_to_stream = False
    writes_to_file = False
    has_filter = True  # `emit` selects the events
    has_formatter = True
    needs_rulegraph = False

    def __post_init__(self):
        """Open the pipe to `icha run`."""
        self._events = os.fdopen(int(os.environ["ICHA_EVENTS"]), "w", encoding="utf-8", buffering=1)

    def emit(self, record):
        """Write one line of JSON if the log record is a selected event or a warning of the Snakefile."""
        name = str(getattr(record, "event", None) or "")
        if name in _FIELDS:
            event = {"event": name} | {field: getattr(record, field, None) for field in _FIELDS[name]}
        elif text := getattr(record, "remark", None):  # a warning of the Snakefile
            event = {"event": "remark", "text": text}
        else:
            return
        try:
            self._events.write(json.dumps(event, default=str) + "\n")
        except OSError:
            pass  # `icha run` has ended
