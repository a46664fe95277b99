"""Time, memory and counts of the stages of one run: surface, summits, path, fields of the snapshot, dataset."""

import contextlib
import hashlib
import json
import sys
import tempfile
import time
from pathlib import Path
from unittest import mock

import numpy as np

import icha
from icha import simulation
from icha.datasets.files import write_dataset
from icha.equilibrium import interacting_asperities
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.half_space import interaction

MODULUS, SURFACE_ENERGY, RANGE = 25e6, 0.05, 2.071e-9
SNAPSHOT = [("reduced_pressure", 0.01)]
# Grid, shortest wave in m, and the stops: the sweep of the comparison, and the challenge up to a tenth of the area.
SURFACES = {
    "512": (512, 100e-6 / 64, {"reduced_pressures": list(np.geomspace(5e-4, 8e-2, 20)), "snapshots": []}),
    "challenge": (8192, 0.1e-6, {"area_fractions": list(np.geomspace(1e-3, 0.1, 20)), "snapshots": SNAPSHOT}),
}


def _memory(reset=False):
    """Peak resident memory in bytes since the last reset; Linux."""
    if reset:
        Path("/proc/self/clear_refs").write_text("5")
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) * 1024


class Stages:
    """Seconds and peak memory of every stage; the innermost of nested stages is the one that counts."""

    def __init__(self):
        self.seconds, self.peak, self.counts, self._open, self._since = {}, {}, {}, [], None

    def _close(self):
        if self._open:
            name = self._open[-1]
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - self._since
            self.peak[name] = max(self.peak.get(name, 0), _memory())

    def _resume(self):
        _memory(reset=True)
        self._since = time.perf_counter()

    @contextlib.contextmanager
    def stage(self, name):
        """What happens inside belongs to the stage `name`."""
        self._close()
        self._open.append(name)
        self._resume()
        try:
            yield
        finally:
            self._close()
            self._open.pop()
            self._resume()

    def timed(self, name, function):
        """The function as a stage."""

        def run(*args, **kwargs):
            with self.stage(name):
                return function(*args, **kwargs)

        return run

    def timed_steps(self, name, generator):
        """The generator's steps as a stage."""

        def run(*args, **kwargs):
            steps = generator(*args, **kwargs)
            while True:
                with self.stage(name):
                    step = next(steps, None)
                if step is None:
                    return
                yield step

        return run

    def counted(self, name, function):
        """The function, counting its calls."""
        self.counts.setdefault(name, 0)

        def run(*args, **kwargs):
            self.counts[name] += 1
            return function(*args, **kwargs)

        return run


def main(kind, adhesion, answer):
    grid, short_wavelength, stops = SURFACES[kind]
    stages = Stages()
    with contextlib.ExitStack() as watched:
        for owner, name, stage in (
            (interacting_asperities, "find_summits", "summits"),
            (interacting_asperities, "gap_distribution", "fields of the snapshot"),
            (interacting_asperities, "pressure_distribution", "fields of the snapshot"),
        ):
            watched.enter_context(mock.patch.object(owner, name, stages.timed(stage, getattr(owner, name))))
        watched.enter_context(mock.patch.object(simulation, "follow", stages.timed_steps("path", simulation.follow)))
        for owner, name, what in (
            (InteractingAsperities, "equilibrium", "equilibria"),
            (interaction.Interaction, "tangent", "linearisations"),
            (interaction.Tangent, "__call__", "products with the tangent"),
            (interaction.Tangent, "nearly", "products with the tangent"),
            (interaction.Interaction, "displacement", "displacements"),
        ):
            watched.enter_context(mock.patch.object(owner, name, stages.counted(what, getattr(owner, name))))

        start = time.perf_counter()
        with stages.stage("surface"):
            surface = icha.SelfAffineSpectrum(100e-6, 20e-6, short_wavelength, 0.8, 1.0).realise(grid, 1)
        material = icha.Material(MODULUS, SURFACE_ENERGY if adhesion else 0.0, RANGE)
        failure = ""
        with stages.stage("dataset"), tempfile.TemporaryDirectory() as folder:
            try:
                run = icha.simulate(surface, material, icha.Path(**stops))
            except icha.ConvergenceError as error:
                run, failure = error.dataset, str(error)
            file = Path(folder) / "run.nc"
            write_dataset(run, file)
            digest = hashlib.sha256(file.read_bytes()).hexdigest()
        total = time.perf_counter() - start
    answer.write_text(
        json.dumps(
            {
                "grid": grid,
                "asperities": int(run.asperity_count),
                "stops": run.sizes["step"],
                "stops_asked": len(icha.Path(**stops).targets),
                "spots": int(run.spot_count[-1]) if run.sizes["step"] else 0,
                "area_fraction": float(run.contact_area_fraction[-1]) if run.sizes["step"] else 0.0,
                "residual": float(run.residual.max()) if run.sizes["step"] else 0.0,
                "seconds": stages.seconds,
                "peaks": stages.peak,
                "counts": stages.counts,
                "total": total,
                "digest": digest,
                "failure": failure,
            }
        )
    )


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2] == "1", Path(sys.argv[3]))
