"""How often the intervals of `icha.fit_jkr_test` contain the truth: table of docs/estimates.md.

    make jkr-test, or python -m validation.jkr_test [--tables]

Each synthetic test has its own lens, modulus, works of adhesion, load and noise. Its equations are written here, apart
from those of the fit: the force at each contact radius follows from the energy release rate, and states at given forces
are found by interpolation. With `--tables`, nothing is computed; the table is written from the saved counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

import icha
from validation.measurements import Parts, Rows, measure_page, read_rows
from validation.tables import Table

TESTS, POINTS, NOISE = 200, 50, 0.02
# Standard deviation of the noise is a share of these values of a column.
SIZES = {"largest": lambda values: np.abs(values).max(), "range": np.ptp, "each": np.abs}
# Measured columns, whether the offset of the indentation is known, size of the noise, and the range of the load divided
# by the pull-off force.
CASES = {
    "contact radius": (["contact_radius"], True, "largest", (1, 10)),
    "contact radius, noise a share of each value": (["contact_radius"], True, "each", (1, 10)),
    "contact radius, noise a share of the range": (["contact_radius"], True, "range", (1, 10)),
    "indentation": (["indentation"], True, "largest", (1, 10)),
    "indentation, unknown zero": (["indentation"], False, "largest", (1, 10)),
    "indentation, unknown zero, approach and retreat": (["indentation"], False, "largest", (1, 10)),
    "both, unknown zero": (["contact_radius", "indentation"], False, "largest", (1, 10)),
    "contact radius, load 20": (["contact_radius"], True, "largest", (20, 20)),
    "indentation, load 20": (["indentation"], True, "largest", (20, 20)),
    "indentation, unknown zero, load 20": (["indentation"], False, "largest", (20, 20)),
}
QUANTITIES = {"contact_modulus": "*E\\**", "advancing_work": "advancing Δγ", "receding_work": "receding Δγ"}


def exact_test(
    *, radius=5e-3, modulus=1.8e6, advancing=0.03, receding=0.09, load=5e-3, points=POINTS, last=0.97
) -> dict[str, np.ndarray]:
    """Return force, contact radius and indentation of a test under load control, up to a share of the pull-off force.

    The energy release rate of a contact of radius a is G = (F_1 - F)^2/(8 pi E* a^3), with Hertz's force F_1. Compared
    with Hertz's contact, the whole contact is lifted by (F_1 - F)/(2 E* a).
    """
    a = np.geomspace(1e-4 * radius, radius, 400_001)
    hertz = 4 * modulus * a**3 / (3 * radius)

    def radii(force, work):
        stable = hertz - np.sqrt(8 * np.pi * modulus * work * a**3)
        first = int(np.argmin(stable))
        return np.interp(force, stable[first:], a[first:])

    pull_off = float((hertz - np.sqrt(8 * np.pi * modulus * receding * a**3)).min())
    half = points // 2
    force = np.concatenate([np.linspace(0, load, half), np.linspace(load, last * pull_off, points - half + 1)[1:]])
    largest = float(radii(load, advancing))
    retreat = np.minimum(radii(force[half:], receding), largest)
    contact = np.concatenate([radii(force[:half], advancing), retreat])
    lift = (4 * modulus * contact**3 / (3 * radius) - force) / (2 * modulus * contact)
    return {"force": force, "contact_radius": contact, "indentation": contact**2 / radius - lift}


def with_free_states(exact: Mapping[str, np.ndarray], count=30) -> dict[str, np.ndarray]:
    """Return a test that begins with an approach and ends with a retreat, without contact or force."""
    depth, none = exact["indentation"], np.zeros(count)
    before = {"indentation": np.linspace(-depth.max(), 0, count, endpoint=False)}
    after = {"indentation": np.linspace(depth[-1], -depth.max(), count)}
    return {name: np.concatenate([before.get(name, none), each, after.get(name, none)]) for name, each in exact.items()}


def noisy_test(exact: Mapping[str, np.ndarray], rng, columns, offset=0.0, size="largest") -> dict[str, np.ndarray]:
    """Return the force and other columns of a test with normal noise; indentations are moved by an offset, m."""
    found = {}
    for name in ("force", *columns):
        values = exact[name]
        noise = NOISE * SIZES[size](values) * rng.standard_normal(len(values))
        found[name] = values + noise + offset * (name == "indentation")
    return found


def random_truth(rng, loads: tuple[float, float]) -> dict[str, float]:
    """Return the parameters of a random test; `loads`: range of the load divided by the pull-off force."""
    radius, modulus = 10 ** rng.uniform(-3, -2), 10 ** rng.uniform(5.5, 6.5)
    advancing = rng.uniform(0.02, 0.06)
    receding = advancing * rng.uniform(1.2, 4)
    load = rng.uniform(*loads) * 1.5 * np.pi * receding * radius
    return {"radius": radius, "modulus": modulus, "advancing": advancing, "receding": receding, "load": load}


def count_coverage(case: str) -> dict:
    """Return how often each interval of a case contains the truth, and the median width of the intervals."""
    columns, known, size, loads = CASES[case]
    inside, widths = {name: [] for name in QUANTITIES}, {name: [] for name in QUANTITIES}
    rng = np.random.default_rng(1)
    for _ in range(TESTS):
        truth = random_truth(rng, loads)
        exact = exact_test(**truth)
        if case.endswith("retreat"):
            exact = with_free_states(exact)
        offset = 0.0 if known else 0.3 * float(exact["indentation"].max())
        table = noisy_test(exact, rng, columns, offset, size)
        test = icha.fit_jkr_test(table, truth["radius"], indentation_offset=0.0 if known else None)
        for name, value in zip(QUANTITIES, (truth[key] for key in ("modulus", "advancing", "receding")), strict=True):
            if (found := getattr(test, name)) is not None:
                inside[name].append(found.low <= value <= found.high)
                widths[name].append((found.high - found.low) / value)
    counts = {name: [int(np.sum(each)), len(each)] for name, each in inside.items()}
    return {"case": case, "counts": counts, "width": {n: float(np.median(each)) for n, each in widths.items()}}


PARTS: Parts = {"coverage": (count_coverage, [(case,) for case in CASES])}


def tables(rows: Rows) -> dict[str, Table]:
    """Return the table of the page."""
    head = ["measured beside the force", *QUANTITIES.values(), *(f"width, {each}" for each in QUANTITIES.values())]
    lines = []
    for row in rows["coverage"]:
        shares = [f"{100 * inside / count:.0f} % of {count}" for inside, count in row["counts"].values()]
        lines.append([row["case"], *shares, *(f"{100 * width:.0f} %" for width in row["width"].values())])
    return {"jkr_test_coverage": Table(head, lines, numbers=True)}


read_measurements = partial(read_rows, "jkr_test", PARTS)

if __name__ == "__main__":
    measure_page("jkr_test", PARTS, tables, __doc__)
