"""Asperities on surfaces with steps, pits, spikes and plateaus: right within a factor, or marked as not applicable.

Boundary elements, which do not use summits, are the reference. A smooth random surface gets one of nine kinds of
damage; some surfaces have a window. Ten series have 360 cases (`--series 0-9`); `make test-all` runs one,
`make test` a part of the first.
"""

import numpy as np
import pytest

from icha import ConvergenceError, Material, Path, SelfAffineSpectrum, Surface, simulate

GRID, PERIOD = 64, 32e-6
CASES_IN_SERIES, QUICK = 36, 9
# Ratio of contact areas by both models, from which on a run must be marked. Of undamaged surfaces it is 1.2 at most.
LARGEST_RATIO = 1.6
MATERIAL = Material(contact_modulus=1e6, surface_energy=0.0, interaction_range=2e-9)
LOADS = Path(reduced_pressures=[1e-3, 1e-2], snapshots=[])


def nothing(heights, random):
    return heights


def steps(heights, random):
    for _ in range(random.integers(1, 4)):
        first, last = np.sort(random.integers(0, GRID, 2))
        heights[first:last] += random.normal() * random.choice([1, 4, 12])
    return heights


def pits(heights, random):
    for _ in range(random.choice([1, 3, 30, 200])):
        (row, column), width = random.integers(0, GRID, 2), random.integers(1, 4)
        heights[row : row + width, column : column + width] -= random.uniform(3, 80)
    return heights


def spikes(heights, random):
    for _ in range(random.choice([1, 3, 30])):
        heights[tuple(random.integers(0, GRID, 2))] += random.uniform(3, 60)
    return heights


def lost_lines(heights, random):
    for _ in range(random.choice([1, 3, 8])):
        row = random.integers(GRID)
        heights[row] = random.choice([heights[row - 1], np.full(GRID, heights.min() - random.uniform(0, 5))])
    return heights


def plateaus(heights, random):
    for _ in range(random.choice([1, 4, 10])):
        (row, column), width = random.integers(0, GRID - 8, 2), random.integers(2, 8)
        heights[row : row + width, column : column + width] = random.uniform(1, 4)
    return heights


def terraces(heights, random):
    waves = [np.sin(2 * np.pi * random.integers(1, 4) * np.arange(GRID) / GRID) for _ in "yx"]
    return heights + random.choice([2, 5, 12]) * (np.add.outer(*waves) > 0)


DAMAGES = (
    *(nothing, steps, pits, spikes, lost_lines),
    # Clipping and quantisation.
    lambda heights, random: np.minimum(heights, np.quantile(heights, random.choice([0.5, 0.8, 0.95, 0.99]))),
    lambda heights, random: np.round(heights / (step := random.choice([0.05, 0.2, 0.5, 1.0]))) * step,
    *(plateaus, terraces),
)


def damaged(number: int) -> tuple[Surface, bool]:
    """The surface of a number, and whether it is a smooth random one."""
    random = np.random.default_rng([number, GRID])
    short, hurst, slope = random.choice([5, 8, 12]), random.uniform(0.3, 0.9), random.uniform(0.05, 0.5)
    rolloff = max(random.choice([0.25, 0.5]), 1.5 * short / GRID)
    spectrum = SelfAffineSpectrum(PERIOD, rolloff * PERIOD, short * PERIOD / GRID, hurst, slope)
    surface = spectrum.realise(GRID, int(random.integers(1, 2**20)))
    damage = DAMAGES[number % len(DAMAGES)]
    heights = damage(surface.heights / surface.rms_height, random) * surface.rms_height
    if random.random() < 0.3:
        centre = (np.arange(GRID) + 0.5) / GRID
        taper = np.sin(0.5 * np.pi * np.minimum(10 * np.minimum(centre, 1 - centre), 1)) ** 2
        heights = (heights - heights.mean()) * taper[:, None] * taper
    return Surface(heights, PERIOD), damage is nothing


def check(numbers) -> list[bool]:
    """Compare the models on the surfaces of some numbers; whether the run of each was marked, of those that ended."""
    marked = []
    for number in numbers:
        surface, smooth = damaged(number)
        truth = simulate(surface, MATERIAL, LOADS, model="boundary_elements").contact_area_fraction.values
        try:
            run = simulate(surface, MATERIAL, LOADS)
        except (ConvergenceError, ValueError) as error:  # which is a clear word
            assert not smooth, f"case {number}: {error}"
            continue
        mark = run.attrs["applicability"]
        assert mark == "" or mark.startswith("asperity model not applicable: ")
        marked.append(mark != "")
        ratio = np.abs(np.log(run.contact_area_fraction.values / truth)).max()
        assert mark or ratio <= np.log(LARGEST_RATIO), f"case {number}: areas differ by a factor of {np.exp(ratio):.2f}"
        assert not (smooth and mark), f"case {number}: {mark}"
    return marked


def test_asperities_are_right_or_marked():
    marked = check(range(QUICK))
    assert any(marked) and not all(marked)


@pytest.mark.slow
def test_asperities_are_right_or_marked_in_many_cases(series):
    check(range(series * CASES_IN_SERIES, (series + 1) * CASES_IN_SERIES))


def pytest_generate_tests(metafunc):
    """One test for each series."""
    if "series" in metafunc.fixturenames:
        metafunc.parametrize("series", metafunc.config.getoption("series"))
