"""Loading and unloading of asperities that do not interact: the JKR law of each, in closed form.

They have the variables of a simulated run that is unloaded; their pressure, area, work and losses are exact.
"""

from functools import cache

import numpy as np
import xarray as xr

import icha
from icha.asperity.jkr import JKR
from icha.datasets.build import get_values
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import RunLabels
from icha.datasets.variables.terms import MATERIAL
from icha.path.energy_balance import summarise_loop

PERIOD, GRID, RMS_HEIGHT, RADIUS = 100e-6, 32, 0.5e-6, 4e-6
COUNT = 30
MATERIALS = {
    "sticky": icha.Material(1e6, 0.05, 20e-9),
    "weak": icha.Material(1e6, 0.01, 20e-9),
    "hertz": icha.Material(1e6, 0.0, 20e-9),
}
EVENTS = ("jump_in", "jump_off", "coalescence", "split")


class Asperities:
    """Paraboloids of one radius and different heights, all pressed by the same half-space, each on its own."""

    def __init__(self, material, rms_slope=1.0, seed=1):
        rng = np.random.default_rng(seed)
        # Steeper is higher and sharper.
        self.height = RMS_HEIGHT * rms_slope * np.sort(rng.normal(size=COUNT))[::-1]
        self.position = rng.uniform(0, PERIOD, (COUNT, 2))
        self.radius_of_curvature = RADIUS / rms_slope
        self.law, self.material = JKR(material), material
        self.rms_height, self.rms_slope = RMS_HEIGHT * rms_slope, rms_slope

    @property
    def jump_in(self):
        """Mean separations at which contacts form, m."""
        return self.height - self.law.jump_in_approach(self.radius_of_curvature)

    @property
    def jump_off(self):
        """Mean separations at which contacts break, m."""
        return self.height - self.law.jump_off_approach(self.radius_of_curvature)

    def energy(self, approach):
        """Elastic and adhesive energy of a contact, J: the integral of JKR's force along its curve from a = 0."""
        R = self.radius_of_curvature
        return self.law.energy(self.law.contact_radius(approach, R), R)

    def state(self, separation, touching):
        """Pressure (Pa), area fraction, energy (J/m^2) and stiffness (Pa/m) of some of the asperities in contact."""
        approach = (self.height - separation)[touching]
        a = self.law.contact_radius(approach, self.radius_of_curvature)
        with np.errstate(divide="ignore", invalid="ignore"):  # infinite at jump-off, 0/0 without force
            R = self.radius_of_curvature
            stiffness = np.nan_to_num(
                self.law.force_derivative(a, R) / self.law.approach_derivative(a, R), posinf=np.inf, neginf=-np.inf
            )
        values = (
            np.sum(self.law.force(a, self.radius_of_curvature)),
            np.pi * np.sum(a**2),
            np.sum(self.energy(approach)),
            np.sum(stiffness),
        )
        return np.array(values) / PERIOD**2

    def run(self, depth, points=60, seed=1):
        """Down to a mean separation of -`depth` rms heights, and back, as a dataset."""
        lowest = -depth * self.rms_height
        formed = np.flatnonzero(self.jump_in >= lowest)
        grid = np.linspace(1.05 * max(self.jump_in.max(), self.jump_off.max()), lowest, points)
        # (separation, leg, asperities in contact, event); every event has a step before it and one after it.
        steps, touching = [], np.zeros(COUNT, bool)
        ways = ((0, grid, self.jump_in, -1), (1, grid[-2::-1], self.jump_off, 1))
        for leg, stops, event_at, sign in ways:
            moves = [(u, -1) for u in stops] + [(event_at[k], k) for k in formed]
            for u, k in sorted(moves, key=lambda move: (sign * move[0], move[1])):
                steps.append((u, leg, touching, -1))
                if k >= 0:
                    touching = touching.copy()
                    touching[k] = leg == 0
                    steps.append((u, leg, touching, k))
        return self._dataset(steps, seed)

    def _dataset(self, steps, seed):
        u, leg, event = (
            np.array(column) for column in list(zip(*[(u, leg, k) for u, leg, _, k in steps], strict=True))
        )
        pressure, area, stored, stiffness = np.array([self.state(u, touching) for u, _, touching, _ in steps]).T
        released = np.zeros((2, len(steps)))
        for at in np.flatnonzero(event >= 0):
            released[leg[at], at] = stored[at - 1] - stored[at]
        jump_in, jump_off = np.cumsum(released, axis=1)
        work = stored + jump_in + jump_off
        unit = self.material.contact_modulus * self.rms_slope
        found = np.flatnonzero(event >= 0)
        counts = {f"{kind}_count": np.cumsum((event >= 0) & (leg == k)) for k, kind in enumerate(EVENTS)}
        per_step = {
            "mean_separation": u,
            # Shown of free squares only.
            "mean_gap": u,
            "nominal_pressure": pressure,
            "contact_stiffness": stiffness,
            "contact_area_fraction": area,
            "spot_count": np.array([np.count_nonzero(touching) for _, _, touching, _ in steps]),
            "converged": np.ones(len(steps), np.int8),
            "leg": leg,
            "reduced_pressure": pressure / unit,
            "reduced_separation": u / self.rms_height,
            "step_kind": np.full(len(steps), "path", object),
            "step_target": u,
            "work": work,
            "stored_energy": stored,
            "dissipated_by_jump_in": jump_in,
            "dissipated_by_jump_off": jump_off,
            "dissipated_by_coalescence": 0 * u,
            "dissipated_by_load_jump": 0 * u,
            "dissipated_by_front": 0 * u,
            **counts,
        }
        per_event = {
            "event_kind": leg[found].astype(np.int8),
            "event_step": found,
            "event_separation": u[found],
            "event_x": self.position[event[found], 0],
            "event_y": self.position[event[found], 1],
            "event_members": np.ones(len(found), int),
        }
        rows = [{name: values[k] for name, values in per_step.items()} for k in range(len(steps))]
        pull_off = int(np.argmin(np.where(leg == 1, pressure, np.inf)))
        largest = 1.5 * np.pi * self.material.surface_energy * COUNT * self.radius_of_curvature / PERIOD**2
        per_run = {
            **get_values(self.material, *MATERIAL),
            "receding_energy": self.material.surface_energy,
            "rms_slope": self.rms_slope,
            "rms_height": self.rms_height,
            "rms_curvature": 1 / self.radius_of_curvature,
            "unit_slope": self.rms_slope,
            "unit_height": self.rms_height,
            "boundary": "periodic",
            "period": PERIOD,
            "grid": GRID,
            "seed": seed,
            "control": "separation",
            **summarise_loop(rows, pull_off, self.material, largest, 0.0, 0.0),
        }
        described = {"units": "1", "long_name": "test"}
        flags = {"flag_values": np.arange(4, dtype=np.int8), "flag_meanings": " ".join(EVENTS)}
        variables = {name: ("step", values, described) for name, values in per_step.items()}
        variables |= {name: ("event", values, described) for name, values in per_event.items()}
        variables |= {name: ((), value, described) for name, value in per_run.items()}
        variables["event_kind"] = ("event", per_event["event_kind"], described | flags)
        branch = np.where(leg == 0, "loading", "unloading").astype(object)
        return xr.Dataset(
            variables, {"step": ("step", np.arange(len(u)), described), "branch": ("step", branch, described)}
        )


@cache
def run(material="sticky", rms_slope=1.0, seed=1, depth=0.5):
    """A run of one of the materials."""
    return Asperities(MATERIALS[material], rms_slope, seed).run(depth, seed=seed)


def study(name, materials=("sticky", "hertz"), slopes=(1.0, 0.5), seeds=(1, 2), depth=0.5):
    """Labels and runs of a study."""
    return [
        (RunLabels(name, "asperities", "rough", seed, slope, material), run(material, slope, seed, depth))
        for seed in seeds
        for slope in slopes
        for material in materials
    ]


def tree(*studies):
    """A campaign of studies."""
    return campaign_tree([run for study in studies for run in study], attrs={"title": "Test", "summary": "For tests."})
