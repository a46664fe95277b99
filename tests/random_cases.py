"""Random contacts from ordinary to odd: surfaces, materials and paths of both models, and their possible outcomes."""

import re
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

import icha
from icha.analysis.checks import describe_failure
from icha.asperity.full_contact import FULL_CONTACT_BELOW
from icha.checks.run import check_run
from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.datasets.format import RUN, problems_with_file

# Beginning of an error about an argument: the name of the argument.
_ARGUMENTS = "heights|period|boundary|contact_modulus|surface_energy|interaction_range|path|reduced_pressures"
_ARGUMENTS += "|area_fractions|mean_separations|snapshots|turning_points|max_step"
NAMED = re.compile(rf"({_ARGUMENTS})(\[\d+\])?: ")


def _waves(rng, grid, exponent, kx=1.0, ky=1.0):
    """A periodic self-affine field of unit variance, of waves up to a quarter of the grid's; longer along an axis."""
    qx, qy = np.fft.rfftfreq(grid, 1 / grid), np.fft.fftfreq(grid, 1 / grid)[:, None]
    q = np.hypot(kx * qx, ky * qy)
    power = np.where((q > 0) & (q <= grid / 4), np.maximum(q, 2.0) ** -exponent, 0.0)
    field = np.fft.irfft2(power * np.exp(2j * np.pi * rng.random(power.shape)), s=(grid, grid))
    return field / field.std()


def _cosines(grid, waves=1):
    x = 2 * np.pi * np.arange(grid) / grid * waves
    return np.cos(x)[:, None] + np.cos(x)


def _with_a_point(rng, grid, height):
    heights = _waves(rng, grid, 1.8)
    heights[tuple(rng.integers(grid, size=2))] += height
    return heights


def _bump(rng, grid, size):
    """A single bump, and nothing else."""
    x = (np.arange(grid) - grid // 2 + size) / grid
    return np.maximum(0.1 - x[:, None] ** 2 - x**2, 0.0)


# Functions of random numbers, the grid, and a size from 0 to 1.
SHAPES = {
    "rough": lambda rng, grid, size: _waves(rng, grid, 1 + size),
    "noise": lambda rng, grid, size: rng.normal(size=(grid, grid)),
    "anisotropic": lambda rng, grid, size: _waves(rng, grid, 2.0, kx=1 + 5 * size, ky=1.0),
    # Summits cut off at the same height.
    "plateau": lambda rng, grid, size: np.minimum(_waves(rng, grid, 1.8), 1.5 - 2 * size),
    # Roughness on a wave that is much higher than it.
    "undulation": lambda rng, grid, size: _waves(rng, grid, 1.8) + 30 * size * _cosines(grid),
    "pit": lambda rng, grid, size: _with_a_point(rng, grid, -100 * size),
    "spike": lambda rng, grid, size: _with_a_point(rng, grid, 100 * size),
    "step": lambda rng, grid, size: _waves(rng, grid, 1.8) + 20 * size * (np.arange(grid) < grid // 2)[:, None],
    # Equal summits in equal distances: everything happens to all of them at once.
    "lattice": lambda rng, grid, size: _cosines(grid, int(1 + 3 * size)),
    "bump": _bump,
    # No summits.
    "ridges": lambda rng, grid, size: np.cos(2 * np.pi * np.arange(grid) / grid)[:, None] * np.ones(grid),
}


@dataclass(frozen=True)
class Topography:
    """Parameters of a surface; lengths in m. Its repr makes it again."""

    shape: str
    grid: int
    size: float
    seed: int
    period: float
    height: float
    boundary: str

    @property
    def heights(self) -> np.ndarray:
        """Heights with the rms height `height`, m."""
        heights = SHAPES[self.shape](np.random.default_rng(self.seed), self.grid, self.size)
        return heights * (self.height / heights.std())


@dataclass(frozen=True)
class Case:
    """Arguments of a run. Its repr makes it again."""

    topography: Topography
    material: tuple[float, float, float]
    path: dict
    model: str

    def run(self):
        """Simulate the case."""
        of = self.topography
        surface = icha.Surface(of.heights, of.period, of.boundary)
        return icha.simulate(surface, icha.Material(*self.material), icha.Path(**self.path), model=self.model)


@st.composite
def _topographies(draw):
    """From mirrors to hedgehogs, by the rms height over the period."""
    period = 1e-4 * 10.0 ** draw(st.sampled_from([0, 0, 0, 3, -3]))
    return Topography(
        shape=draw(st.sampled_from(list(SHAPES))),
        grid=draw(st.sampled_from([24, 16, 32, 12, 9, 8])),
        size=draw(st.integers(0, 20)) / 20,
        seed=draw(st.integers(0, 10**6)),
        period=period,
        height=period * 10.0 ** draw(st.sampled_from([-2, -2, -2, -1, -4, -8])),
        boundary=draw(st.sampled_from(["periodic"] * 4 + ["free"])),
    )


@st.composite
def _materials(draw, topography):
    """Modulus, energy and range: the energy in units of what it takes to press the summits flat."""
    modulus = 10.0 ** draw(st.sampled_from([6, 6, 3, 11]))
    power = draw(st.one_of(st.none(), st.integers(-24, 2)))
    heights, height, period = topography.heights, topography.height, topography.period
    spacing = period / topography.grid
    curvature = max(np.abs(np.diff(heights, 2, axis=0)).max() / spacing**2, height / period**2)
    energy = 0.0 if power is None else 10.0 ** (power / 4) * modulus * height**1.5 * curvature**0.5
    tabor = 10.0 ** (draw(st.integers(-4, 8)) / 4)
    return modulus, float(energy), float(np.cbrt((energy / modulus) ** 2 / curvature) / tabor) if energy else 1e-9


_TURNS = st.sampled_from([("reduced_pressure", 0.0), ("reduced_pressure", -1e-3), ("area_fraction", 1e-3)])


@st.composite
def _paths(draw, height):
    """Arguments of a path."""
    kind = draw(st.sampled_from(["reduced_pressures", "area_fractions", "mean_separations"]))
    numbers = draw(st.lists(st.integers(0, 400), min_size=1, max_size=3, unique=True).map(sorted))
    if kind == "mean_separations":
        stops = [height * (4 - 0.0099 * n) for n in numbers]
    else:
        stops = [10 ** (-4.5 + 3.6 * n / 400) for n in numbers]
    path = {kind: stops, "max_step": draw(st.sampled_from([0.5, 0.15, 0.5, 0.05]))}
    path["snapshots"] = draw(st.sampled_from([None, [], [("area_fraction", 0.02)], [("reduced_pressure", 3e-3)]]))
    way = draw(st.sampled_from(["in"] * 5 + ["there and back", "cycle", "under load"]))
    if way == "in":
        return path
    path["unload"] = True
    if way == "cycle":
        path["turning_points"] = [draw(_TURNS), (kind.removesuffix("s"), stops[-1])]
    if way == "under load" and kind == "reduced_pressures" and path["snapshots"] != [("area_fraction", 0.02)]:
        path["control"] = "load"
    return path


@st.composite
def cases(draw):
    """Draw a run of any kind; one in three with boundary elements."""
    topography = draw(_topographies())
    return Case(
        topography,
        draw(_materials(topography)),
        draw(_paths(topography.height)),
        draw(st.sampled_from([DEFAULT_MODEL, DEFAULT_MODEL, REFERENCE_MODEL])),
    )


def refused(error: ValueError) -> bool:
    """Return whether an error names an argument."""
    return NAMED.match(str(error)) is not None


def lacking(case: Case, run) -> set[tuple[str, float]]:
    """Kinds and values of stops and snapshots that a run to the end should have met on its first leg, and has not."""
    first = run["leg"].values == 0
    met = zip(run["step_kind"].values[first], run["step_target"].values[first], strict=True)
    return {(stop.kind, stop.value) for stop in icha.Path(**case.path).targets} - {(str(k), float(v)) for k, v in met}


# Checks of single steps, which also hold for the steps before a failure.
_OF_STEPS = ("finite", "residual", "front", "gap", "converged", "targets")

# Checks that unions on sticky surfaces may fail, because their rule is not conservative; such a run is marked.
OF_UNIONS = ("loop loses energy", "unions lose energy", "separation falls where spots unite")
# Where full contact has the lower energy, jumps into contact that unite spots at once may gain energy as well.
OF_STICKY_SURFACES = (*OF_UNIONS, "jumps lose energy", "jumps in lose energy")


def wrong(run) -> list[str]:
    """Return the failures of the dataset of a run; if it ended early, of the targets that it reached."""
    ended, marked = bool({"incomplete", "beyond_model"} & run.attrs.keys()), run.attrs.get("failed_checks", "")
    found = [check for check in check_run(run) if not check.passed and not (ended and check.name not in _OF_STEPS)]
    assert ended or all(f"{check.name}: " in marked for check in found)
    marked_only = OF_STICKY_SURFACES if float(run["full_contact_energy_ratio"]) < FULL_CONTACT_BELOW else OF_UNIONS
    found = [check for check in found if not (check.name in marked_only and float(run["surface_energy"]) > 0)]
    return [describe_failure(check) for check in found] + problems_with_file(RUN, run)
