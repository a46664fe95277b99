"""Applicability of the asperity model: its areas and gaps compared with boundary elements on sixty surfaces.

    python -m validation.applicability [--parts PART ...] [--tables]

The surfaces are of ten kinds. Adhesion ranges from none to so strong that full contact has the lower energy. All
surfaces were examined when the limits of contact area and gap (`icha.path.targets`) were chosen.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from functools import partial
from itertools import product
from pathlib import Path as FilePath
from typing import NamedTuple

import numpy as np
import scipy.fft
import xarray as xr

from icha import ConvergenceError, Material, Path, SelfAffineSpectrum, Surface, read_scan, simulate
from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from validation.measurements import Parts, Rows, measure_page, read_rows
from validation.tables import Table

_ROOT = FilePath(__file__).resolve().parents[1]
KINDS = (
    *("random", "random, Gaussian amplitudes", "egg box", "two waves", "ridges"),
    *("pits", "bumps", "plateaus", "skewed", "scan"),
)
# Ranges of U_full/dgamma of the surfaces of a kind; about half of the surfaces in the first range have no adhesion.
_ENERGY_RATIOS = ((20.0, 50.0), (10.0, 20.0), (5.0, 10.0), (2.5, 5.0), (1.3, 2.5), (0.7, 1.3))
COUNT = len(KINDS) * len(_ENERGY_RATIOS)
_HALVES = {"first half": range(COUNT // 2), "second half": range(COUNT // 2, COUNT)}
# The text states a pixel of 369.862 nm and 29.1818 nm for one radian.
_SCANS = {
    "config/topographies/published/al3d-1.al3d": {},
    "tests/data/topographies/top-1.top": {},
    "config/topographies/published/di-3.di": {},
    "tests/data/topographies/matrix-4.txt": {"size": ["27.73965 um", "112.80791 um"], "height_unit": "29.1818 nm"},
    "config/topographies/published/tmd-1.tmd": {},
    "tests/data/topographies/x3p-2_part.x3p": {},
}
LOADS = (1e-3, 3e-3, 1e-2, 2e-2, 5e-2, 0.12)
# Largest loads of the runs whose marks are examined.
LARGEST_LOADS = (0.01, 0.05, 0.12)
# Areas and gaps are wrong if they differ from those of boundary elements by more than this factor.
WRONG_FACTOR = 1.5
# Grid cells in the shortest wavelength, and least mean radius of the contact patches that boundary elements resolve.
_CELLS, _LEAST_RADIUS = 8, 2.0
_PERIOD, _MODULUS = 100e-6, 1e6


class State(NamedTuple):
    """Contact area fraction, mean gap over the rms height, and mean radius of the contact patches in cells."""

    area: float
    gap: float
    radius: float


def case(number: int) -> tuple[str, Surface, Material]:
    """Return the kind, the surface and the material of a number below `COUNT`."""
    rng = np.random.default_rng([number, 60])
    level, kind = divmod(number, len(KINDS))
    grid = int(rng.choice([64, 80, 96]))
    heights = _smooth(_heights(KINDS[kind], rng, grid, level), grid)
    surface = Surface(heights * (1e-6 / heights.std()), _PERIOD).scaled_to_rms_slope(float(rng.uniform(0.05, 0.5)))
    # Each kind and each level has all ranges of adhesion.
    strength = (level + number) % len(_ENERGY_RATIOS)
    ratio = math.exp(rng.uniform(*np.log(_ENERGY_RATIOS[strength])))
    length = 0.0 if strength == 0 and rng.random() < 0.5 else surface.full_contact_energy / ratio
    tabor_parameter = float(np.exp(rng.uniform(*np.log([2, 12]))))
    reach = float(np.cbrt(length**2 * surface.summit_radius)) / tabor_parameter if length else 1e-9
    return KINDS[kind], surface, Material(_MODULUS, length * _MODULUS, reach)


def _heights(kind, rng, grid, level):
    """Return heights of a kind in any unit; those of scans have a finer grid."""
    match kind:
        case "random":
            return _random(rng, grid)
        case "random, Gaussian amplitudes":
            return _random(rng, grid, "gaussian")
        case "egg box":
            return np.add.outer(*(_wave(rng, grid, rng.integers(1, grid // _CELLS + 1)) for _ in "yx"))
        case "two waves":
            long, short, share = rng.integers(1, 4), rng.integers(4, grid // _CELLS + 1), rng.uniform(0.1, 0.6)
            return np.add.outer(*(_wave(rng, grid, long) + share * _wave(rng, grid, short) for _ in "yx"))
        case "ridges":  # a random surface, stretched along y
            spectrum, stretch = scipy.fft.fft2(_random(rng, grid)), int(rng.integers(2, 5))
            k, stretched = scipy.fft.fftfreq(grid, 1 / grid), np.zeros_like(spectrum)
            kept = np.flatnonzero(np.abs(k) <= grid / _CELLS / stretch)
            stretched[kept] = spectrum[(k[kept] * stretch).astype(int)]
            return scipy.fft.ifft2(stretched).real
        case "pits":
            return 0.3 * _random(rng, grid) - _domes(rng, grid)
        case "bumps":
            return 0.1 * _random(rng, grid) + _domes(rng, grid)
        case "plateaus":
            return np.tanh(rng.uniform(1, 3) * _random(rng, grid))
        case "skewed":
            return np.exp(rng.choice([-1, 1]) * rng.uniform(0.3, 0.8) * _random(rng, grid))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the slopes of scans may be unusual
        path, stated = list(_SCANS.items())[level]
        return read_scan(_ROOT / path, boundary="window", grid=256, **stated).heights


def _random(rng, grid, amplitudes="fixed"):
    """Return heights of a self-affine surface with random roll-off and Hurst exponent; the rms height is 1."""
    short = _CELLS / grid
    rolloff = max(float(rng.choice([0.25, 0.5, 1.0])), 1.5 * short)
    spectrum = SelfAffineSpectrum(1.0, rolloff, short, float(rng.uniform(0.2, 0.95)), 1.0)
    heights = spectrum.realise(grid, int(rng.integers(2**20)), amplitudes).heights
    return heights / heights.std()


def _phases(rng, grid, waves=1):
    """Return the phases of a wave with a random origin at the nodes, rad."""
    return 2 * np.pi * waves * (np.arange(grid) / grid + rng.random())


def _wave(rng, grid, waves):
    return np.cos(_phases(rng, grid, waves))


def _domes(rng, grid):
    """Return smooth domes of one width and of random heights at random places."""
    width, heights = rng.uniform(0.04, 0.1), np.zeros((grid, grid))
    for _ in range(int(rng.integers(4, 30))):
        y, x = (np.cos(_phases(rng, grid)) - 1 for _ in "yx")
        heights += rng.uniform(0.5, 1) * np.exp(np.add.outer(y, x) / (2 * np.pi * width) ** 2)
    return heights


def _smooth(heights, grid):
    """Return the waves of at least `_CELLS` cells of a grid, on the nodes of this grid."""
    spectrum, k = scipy.fft.fft2(heights), scipy.fft.fftfreq(len(heights), 1 / len(heights))
    spectrum[np.hypot(k[:, None], k) > grid // _CELLS] = 0
    kept = scipy.fft.fftfreq(grid, 1 / grid).astype(int)
    return scipy.fft.ifft2(spectrum[np.ix_(kept, kept)]).real


def press(surface: Surface, material: Material, model: str, largest: float = LOADS[-1]) -> xr.Dataset:
    """Return the run of a model at `LOADS` up to the largest; a run that ends early has only the loads it reached."""
    loads = [load for load in LOADS if load <= largest]
    path = Path(reduced_pressures=loads, snapshots=[("reduced_pressure", load) for load in loads])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return simulate(surface, material, path, model=model)
        except ConvergenceError as error:
            return error.dataset


def states(run: xr.Dataset) -> dict[float, State]:
    """Return the states of a run by reduced pressure."""
    found, at_snapshots = {}, run.isel(step=run["snapshot_step"].values)
    gaps = at_snapshots["mean_gap"].values / float(run["rms_height"])
    for at, load in enumerate(run["snapshot_target"].values):
        radii = run["spot_radius"].values[run["spot_snapshot"].values == at]
        cells = float(np.average(radii, weights=radii**2) / (run["period"] / run["grid"]))
        found[float(load)] = State(float(at_snapshots["contact_area_fraction"][at]), float(gaps[at]), cells)
    return found


def largest_factor(found: Mapping[float, State], exact: Mapping[float, State]) -> float:
    """Return the largest factor between areas, or gaps, at loads where boundary elements resolve the patches.

    A gap that only one model closes gives infinity; without a common load the result is nan.
    """
    factors = []
    for load in found.keys() & exact.keys():
        if exact[load].radius >= _LEAST_RADIUS:
            for one, other in zip(found[load][:2], exact[load][:2], strict=True):
                factors.append(math.exp(abs(math.log(one / other))) if one > 0 and other > 0 else math.inf)
    return max(factors, default=math.nan)


def solve_reference(number: int) -> Iterator[dict]:
    """Yield the states of boundary elements of a number, by load."""
    _, surface, material = case(number)
    for load, state in states(press(surface, material, REFERENCE_MODEL)).items():
        yield {"number": number, "load": load, "state": state}


def reference(number: int) -> dict[float, State]:
    """Return the saved states of boundary elements of a number, by load."""
    rows = read_rows("applicability", ["boundary_elements"])["boundary_elements"]
    return {row["load"]: State(*row["state"]) for row in rows if row["number"] == number}


def judge(number: int, largest: float) -> dict:
    """Return the largest error of the asperity model up to a load, as a factor, and whether the run is marked."""
    _, surface, material = case(number)
    run = press(surface, material, DEFAULT_MODEL, largest)
    factor, marked = largest_factor(states(run), reference(number)), bool(run.attrs["applicability"])
    return {"number": number, "largest": largest, "factor": factor, "marked": marked}


PARTS: Parts = {
    "boundary_elements": (solve_reference, [(number,) for number in range(COUNT)]),
    "asperities": (judge, [*product(range(COUNT), LARGEST_LOADS)]),
}


def tables(rows: Rows) -> dict[str, Table]:
    """Return the table of the page: numbers of surfaces that are right or wrong, marked or not, by largest load."""
    lines = []
    for (half, numbers), largest in product(_HALVES.items(), LARGEST_LOADS):
        found = [row for row in rows["asperities"] if row["number"] in numbers and row["largest"] == largest]
        found = [(row["factor"] > WRONG_FACTOR, row["marked"], row["factor"]) for row in found if row["factor"] > 0]
        counts = [
            str(sum(each[:2] == kind for each in found))
            for kind in ((True, True), (True, False), (False, True), (False, False))
        ]
        worst = max((factor for _, marked, factor in found if not marked), default=1.0)
        lines.append([half, f"{largest:g}", *counts, f"{worst:.2f}"])
    head = ["surfaces", "largest *p\\**", "wrong, marked", "wrong, not marked", "right, marked", "right, not marked"]
    return {"applicability": Table([*head, "largest factor without a mark"], lines)}


read_measurements = partial(read_rows, "applicability", PARTS)

if __name__ == "__main__":
    measure_page("applicability", PARTS, tables, __doc__)
