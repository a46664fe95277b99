"""Task and answer of every code. Needs only NumPy, because it runs in the environment of the codes.

A task is a folder with heights.npy (m, towards the elastic body) and task.json: period (m), contact_modulus (Pa),
rms_slope, rms_height (m), surface_energy (J/m^2), interaction_range (m), and the stops, pressures (Pa) or mean_gaps
(m). The answer is a JSON file with one entry per stop. It is rewritten after each stop, so that a code that is killed
at its time limit leaves the stops that it reached.
"""

import json
import sys
import time
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import numpy as np


@dataclass
class Task:
    """The problem to solve and the answers given so far."""

    folder: Path
    answer: Path
    threads: int
    settings: dict
    rows: list = field(default_factory=list)

    @classmethod
    def from_command_line(cls):
        """Read the task named by `SCRIPT FOLDER ANSWER THREADS`."""
        folder, answer, threads = sys.argv[1:]
        folder = Path(folder)
        return cls(folder, Path(answer), int(threads), json.loads((folder / "task.json").read_text()))

    def __getattr__(self, name):
        """Return settings of the task as attributes."""
        try:
            return self.settings[name]
        except KeyError:
            raise AttributeError(name) from None

    @property
    def heights(self):
        """Heights in m, (n, n)."""
        return np.load(self.folder / "heights.npy")

    def start(self, package, how):
        """Start the clock of the computation; `how` describes the settings of the code `package`."""
        self.about = {"version": version(package), "settings": how}
        self.clock = time.perf_counter()

    def answer_stop(self, *, pressure, area_fraction, mean_gap):
        """Record a stop: nominal pressure (Pa), A/A0 and mean gap (m)."""
        seconds = time.perf_counter() - self.clock
        row = {"pressure": pressure, "area_fraction": area_fraction, "mean_gap": mean_gap, "seconds": seconds}
        self.rows.append({key: float(value) for key, value in row.items()})
        self.answer.write_text(json.dumps({**self.about, "stops": self.rows}))


def area_on_grid(contact):
    """Return A/A0 of a map of contact nodes, corrected by its perimeter.

    Yastrebov, Anciaux & Molinari, Tribol. Int. 114 (2017) 161-171: nodes along the edge of a contact overestimate its
    area by (pi - 1 + ln 2)/24 of the perimeter times the spacing.
    """
    edges = sum(np.count_nonzero(contact != np.roll(contact, 1, axis)) for axis in (0, 1))
    return (np.count_nonzero(contact) - (np.pi - 1 + np.log(2)) / 24 * edges) / contact.size
