"""Random loops by boundary elements: each one must end where it was asked to end.

python -m validation.random_loops [--count N] [--first K] [--indenters] [--works]

Smooth, elliptic and rough surfaces and plateaus, half of them sticky, under control of separation, load or area. With
`--indenters`: spheres, paraboloids, cones and waves with roughness on a free half-space, under control of separation or
load. With `--works`: small loops of both kinds, whose work of adhesion is 1.2 to 4 times larger for receding edges; two
of three have a map, stripes or random patches. Their loss must be at least the energy that receding edges dissipate. A
target may lie inside a jump, where there is no equilibrium; any other failure is one of the solver.
"""

import argparse
import math
import time
import warnings
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from icha import ConvergenceError, Material, Path, SelfAffineSpectrum, Surface, simulate
from icha.asperity.adhesion_map import Patches, Stripes
from icha.contact.models import REFERENCE_MODEL
from icha.surfaces.shapes import Cone, Paraboloid, Sphere, Wave
from validation.surfaces import bump

INDENTERS = ("sphere", "paraboloid", "cone", "wave")
KINDS = ("bump", "ellipse", "rough", "rough", "plateau")
_PERIOD, _MODULUS, _RADIUS = 100e-6, 25e6, 1e-3
# Cells along the sides of periodic and of free squares with two works of adhesion.
_PERIODIC, _FREE = 32, 24
# Largest shortfall of the loss compared with the dissipation of receding edges, divided by this dissipation, or by the
# work of loading, because the loss is the difference of two integrals.
_OF_DISSIPATION, _OF_WORK = 1e-2, 1e-4


class Loop(NamedTuple):
    """A surface, a material and a path, with the kind of the surface and the control of the path."""

    kind: str
    control: str
    surface: Surface
    material: Material
    path: Path


def random_loop(number: int, grid: int | None = None) -> Loop:
    """Draw a loop by its number; grid: cells along a side, drawn too if it is None."""
    rng = np.random.default_rng(1000 + number)
    grid = grid or int(rng.choice([48, 64, 96, 128], p=[0.35, 0.35, 0.2, 0.1]))
    kind, spacing = KINDS[number % 5], _PERIOD / grid
    sticky = (number // 5) % 2 == 0
    if kind in ("bump", "ellipse"):
        aspect = 1.0 if kind == "bump" else float(rng.uniform(1.2, 3.0))
        radii = (_RADIUS * aspect**0.5, _RADIUS * aspect**-0.5)
        surface, _ = bump(grid, _PERIOD, tuple(rng.uniform(-0.5, 0.5, 2)), radii, float(rng.uniform(0, np.pi)))
        radius, curvature = float(rng.uniform(3, min(10, grid / 8))) * spacing, 1 / _RADIUS
        reach = float(rng.uniform(0.05, 0.5)) * radius**2 * curvature
        unit = radius**2 * curvature
    else:
        surface = SelfAffineSpectrum(_PERIOD, 50e-6, 8 * spacing, 0.8, 1.0).realise(grid, int(rng.integers(1000)))
        radius, curvature = (float(rng.uniform(1, 6)) if sticky else 0.3) * spacing, surface.rms_curvature
        if kind == "plateau":
            highest = float(np.quantile(surface.heights, rng.uniform(0.7, 0.95)))
            surface = Surface(np.minimum(surface.heights, highest), _PERIOD)
        # The strength of the interface is that of a front of two cells.
        reach = float(np.sqrt(radius**3 * curvature**2 * spacing)) * 2
        unit = surface.rms_height
    # With the radius of contact under no load (dgamma R^2/E*)^(1/3).
    material = Material(_MODULUS, radius**3 * curvature**2 * _MODULUS, reach)
    control = ("separation", "load", "area")[int(rng.integers(3))]
    if control == "separation":
        ends = float(surface.heights.max()) - min(unit, 0.6 * float(surface.heights.max())) * np.sort(
            rng.uniform(0, 1.5, 2)
        )
        path = Path(mean_separations=ends.tolist(), unload=True, snapshots=[])
    elif control == "load":
        loads = np.sort(10 ** rng.uniform(-3, 0.3, 2)).tolist()
        path = Path(reduced_pressures=loads, unload=True, control="load", snapshots=[])
    else:
        path = Path(area_fractions=np.sort(10 ** rng.uniform(-1.7, -0.1, 2)).tolist(), unload=True, snapshots=[])
    return Loop(kind, control, surface, material, path)


def random_indenter(number: int, grid: int | None = None) -> Loop:
    """Draw a loop of a rough indenter by its number; every other one is sticky."""
    rng = np.random.default_rng(5000 + number)
    drawn, kind = int(rng.choice([48, 64, 96], p=[0.4, 0.4, 0.2])), INDENTERS[number % 4]
    grid = grid or drawn
    spacing, sticky = _PERIOD / grid, (number // 4) % 2 == 0
    # Radius (dgamma R^2/E*)^(1/3) and unit of length (dgamma^2 R/E*^2)^(1/3) of a sphere with adhesion.
    radius = float(rng.uniform(2, min(6, grid / 12))) * spacing
    unit, energy = radius**2 / _RADIUS, radius**3 / _RADIUS**2 * _MODULUS
    aspect, slope = float(rng.uniform(1.2, 3.0)) ** 0.5, math.sqrt(18 / math.pi * energy / _MODULUS / radius)
    wavelength = float(rng.uniform(8, 16)) * spacing
    shape = {
        "sphere": Sphere(_RADIUS),
        "paraboloid": Paraboloid((_RADIUS * aspect, _RADIUS / aspect)),
        "cone": Cone(math.atan(1 / slope)),
        "wave": Wave(_RADIUS, float(rng.uniform(0.01, 0.1)) * wavelength**2 / _RADIUS, wavelength),
    }[kind]
    rms_height = unit * float(10 ** rng.uniform(math.log10(0.02), math.log10(0.7)))
    rough = SelfAffineSpectrum(_PERIOD, 0.5 * _PERIOD, 8 * spacing, 0.8, 0.1).realise(grid, int(rng.integers(1000)))
    surface = Surface(rough.heights * rms_height / rough.rms_height, _PERIOD, "free", shape)
    energy *= float(rng.uniform(0.3, 1)) if sticky else float(rng.choice([0.0, 1e-3]))
    material = Material(_MODULUS, energy, 0.2 * unit)
    contact_radius = np.sort(rng.uniform(0.05, 0.25, 2)) * _PERIOD
    if rng.integers(2):
        depth = math.pi / 2 * slope * contact_radius if kind == "cone" else contact_radius**2 / _RADIUS
        return Loop(kind, "separation", surface, material, Path(indentations=depth, unload=True, snapshots=[]))
    force = 4 / 3 * contact_radius**3 / _RADIUS if kind != "cone" else math.pi / 2 * slope * contact_radius**2
    path = Path(forces=force * _MODULUS, unload=True, control="load", snapshots=[])
    return Loop(kind, "load", surface, material, path)


def random_works(number: int) -> Loop:
    """Draw a loop with two works of adhesion, most of them with a map; even numbers are periodic, odd ones free."""
    half, rng = number // 2, np.random.default_rng(9000 + number)
    loop = random_indenter(half, _FREE) if number % 2 else random_loop(half, _PERIODIC)
    energy, contrast = loop.material.surface_energy, float(rng.uniform(0.1, 0.5))
    if not energy:
        return loop
    places = (
        None,
        Stripes((1 - contrast) * energy, (1 + contrast) * energy, _PERIOD / int(rng.choice([4, 6, 8])), "xy"[half % 2]),
        Patches(energy, contrast * energy / 2, _PERIOD / float(rng.uniform(4, 10)), int(rng.integers(1000))),
    )[half % 3]
    material = replace(loop.material, receding_energy=energy * float(rng.uniform(1.2, 4)), adhesion_map=places)
    name = "one value" if places is None else type(places).__name__.lower()
    return loop._replace(kind=f"{loop.kind}, {name}", material=material)


def follow_loop(loop: Loop) -> str:
    """Follow a loop; return an empty text, or why it ended before its end or lost less than its edges dissipate."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            run = simulate(loop.surface, loop.material, loop.path, model=REFERENCE_MODEL)
        except ConvergenceError as error:
            return "" if "lies inside a jump" in str(error) else str(error)
    loss, dissipation = float(run.hysteresis_loss), float(run.front_dissipation)
    loading = run.leg.values == run.leg.values.min()
    work = abs(float(np.trapezoid(run.nominal_pressure.values[loading], run.mean_separation.values[loading])))
    if dissipation - loss > max(_OF_DISSIPATION * dissipation, _OF_WORK * work):
        return f"loses {loss / dissipation:.3f} times the energy that receding edges dissipate"
    return ""


def main() -> None:
    """Follow random loops and print how each of them ends."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--indenters", action="store_true", help="rough indenters on a free half-space")
    parser.add_argument("--works", action="store_true", help="small loops with two works of adhesion and maps")
    options = parser.parse_args()
    failed, draw = 0, random_works if options.works else random_indenter if options.indenters else random_loop
    for number in range(options.first, options.first + options.count):
        loop, clock = draw(number), time.process_time()
        with threadpool_limits(1):
            reason = follow_loop(loop)
        failed += bool(reason)
        grid, seconds = loop.surface.grid, time.process_time() - clock
        print(f"{number} {loop.kind} {grid}^2 {loop.control} {seconds:.1f} s {reason or 'ends'}", flush=True)
    print(f"{failed} of {options.count} loops did not end")


if __name__ == "__main__":
    main()
