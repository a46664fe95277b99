"""Rough spheres on a free half-space: convergence and computing times; layers, and contacts without adhesion.

Units: E* = 1 Pa, dgamma = 1 J/m^2 and a sphere of radius 1 m, as in `validation.indenter_contacts`.
"""

import math
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path as File

import numpy as np

from icha import Material, Path, SelfAffineSpectrum, Surface, simulate
from icha.boundary_elements.contact import contact_of
from icha.boundary_elements.elastic import wave_numbers
from icha.half_space.layer import Layer, layer_compliance
from icha.surfaces.shapes import Paraboloid
from validation.indenter_contacts import ADHESIVE, BARE, PULL_OFF, Shifted

ROOT = File(__file__).resolve().parents[1]
# ContactMechanics is installed there by `make .venv-benchmarks/.installed`.
OTHER_PYTHON = ROOT / ".venv-benchmarks/bin/python"


def rough_sphere(
    grid: int, side: float, waves: tuple[float, float], energy: float, seed: int, refinement: int = 1
) -> Surface:
    """Return a sphere of radius 1 m with self-affine roughness.

    Parameters
    ----------
    side : side of the square, m.
    waves : longest and shortest wavelength, m.
    energy : elastic energy of full contact divided by dgamma.
    refinement : factor by which the grid is finer; the position of the roughness below the apex does not change.
    """
    coarse = SelfAffineSpectrum(side, *waves, 0.8, 0.1).realise(grid, seed)
    fine = coarse.refined(refinement).heights * math.sqrt(energy / coarse.full_contact_energy)
    # Distance of the apex from the first node: (n/2 + 0.29 - 0.5) cells of the coarse grid.
    shift = -0.21 * coarse.spacing * (1 - 1 / refinement)
    return Surface(fine, side, "free", Shifted(Paraboloid((1.0, 1.0)), (shift, shift)))


def _timed_loop(surface, indentation):
    """Return a row with the computing time of a loop to an indentation (m), and the run."""
    clock, path = time.process_time(), Path(indentations=[indentation], unload=True)
    run = simulate(surface, ADHESIVE, path, model="boundary_elements")
    seconds, pull_off = time.process_time() - clock, -float(run.nominal_pressure.min()) * surface.period**2 / PULL_OFF
    return {"grid": surface.grid, "steps": run.sizes["step"], "seconds": seconds, "pull_off": pull_off}, run


def rough_loop(grid: int, waves: tuple[float, float] = (2.0, 1.0), seed: int = 1) -> dict:
    """Follow a loop of one rough sphere, with computing time; grid: 64 cells along a side times a power of two.

    The side has the length 8 (dgamma R^2/E*)^(1/3), and the energy of full contact is dgamma/5.
    """
    surface = rough_sphere(64, 8.0, waves, 0.2, seed, grid // 64)
    row, run = _timed_loop(surface, 1.0)
    return row | {
        "wave_cells": waves[1] / surface.spacing,
        "largest_area": float(run.contact_area_fraction.max()) * surface.period**2,
        "loss": float(run.hysteresis_loss) * surface.period**2,
        "failed_checks": run.attrs.get("failed_checks", ""),
    }


def smooth_loop(grid: int = 96) -> dict:
    """Follow a loop of the smooth sphere to 2.4 contact radii of zero load, with computing time."""
    return _timed_loop(Surface(np.zeros((grid, grid)), grid / 6, "free", Paraboloid((1.0, 1.0))), 4.0)[0]


def without_adhesion(kind: str, grid: int = 64) -> Iterator[dict]:
    """Compare a sphere, a rough square, or a rough periodic layer without adhesion with ContactMechanics.

    kind : "sphere", "rough square", or "layer".
    """
    rough = SelfAffineSpectrum(16.0, 8.0, 2.0, 0.8, 0.1).realise(grid, 1)
    cases = {
        "sphere": (Surface(0 * rough.heights, 16.0, "free", Paraboloid((10.0, 10.0))), (-0.3, -1.0), (None,)),
        "rough square": (Surface(rough.heights, 16.0, "free"), (0.1, -0.1, -0.3), (None,)),
        "layer": (rough, (0.15, 0.1, 0.05), ((0.2, 0.1), (1.0, 0.3), (5.0, 0.3), (5.0, 0.49))),
    }
    surface, separations, layers = cases[kind]
    for layer in layers:
        answer = _solve_with_contactmechanics(surface, separations, layer)
        material, uniform, kernel_error = BARE, 0.0, None
        if layer:
            thickness, poisson = layer
            material = Material(1.0, 0.0, 0.2, thickness=thickness, poisson_ratio=poisson)
            uniform = thickness * (1 - 2 * poisson) / (1 - poisson) ** 2
            h = surface.spacing
            kernel = h * layer_compliance(wave_numbers(grid), Layer(thickness / h, poisson))
            kernel_error = float(np.abs(kernel / answer["compliance"] - 1).max())
        contact = contact_of(surface, material)
        state = contact.untouched()
        for separation, pressure, gap in zip(separations, answer["pressures"], answer["gaps"], strict=True):
            # Separations of ContactMechanics include the displacement of a layer by the mean pressure.
            state = contact.equilibrium(state, separation + uniform * pressure.mean())
            mine = contact.crop(contact.field(state.cells, state.pressure))
            yield {
                "kind": kind,
                "thickness": layer[0] if layer else None,
                "poisson": layer[1] if layer else None,
                "separation": separation,
                "area": np.count_nonzero(pressure > 0) / pressure.size,
                "area_error": len(state.cells) / np.count_nonzero(pressure > 0) - 1,
                "force_error": float(mine.sum() / pressure.sum() - 1),
                "gap_error": float(np.abs(contact.gap(state) - gap).max() / np.std(surface.profile)),
                "kernel_error": kernel_error,
            }


def _solve_with_contactmechanics(surface, separations, layer):
    if not OTHER_PYTHON.exists():
        raise SystemExit("ContactMechanics is not installed; run: make .venv-benchmarks/.installed")
    with tempfile.TemporaryDirectory() as folder:
        task, answer = File(folder, "task.npz"), File(folder, "answer.npz")
        settings = dict(zip(("thickness", "poisson"), layer, strict=True)) if layer else {}
        np.savez(task, heights=surface.profile, period=surface.period, separations=separations, **settings)
        subprocess.run([OTHER_PYTHON, ROOT / "validation/indenter_other_code.py", task, answer], check=True)
        return dict(np.load(answer))


def layer_limits(grid: int = 64, thicknesses: Sequence[float] = (100, 20, 0.2, 0.1, 0.07)) -> Iterator[dict]:
    """Press a sphere without adhesion on a free layer of Poisson ratio 0.3, and compare it with thick and thin layers.

    The force on a thick layer is Hertz's with the correction of E. K. Dimitriadis et al., Biophys. J. 82 (2002) 2798,
    to second order in radius over thickness. On a thin layer, each point is a spring of compliance t/M, so that
    F = pi R M delta^2/t and A = 2 pi R delta (K. L. Johnson, Contact Mechanics, 1985, sec. 5.8). Thicknesses are in
    units of sqrt(R delta).
    """
    indentation, poisson = 0.02, 0.3
    radius = math.sqrt(indentation)
    spacing = radius / (grid / 4)
    surface = Surface(np.zeros((grid, grid)), grid * spacing, "free", Paraboloid((1.0, 1.0)))
    alpha = -(1.2876 - 1.4678 * poisson + 1.3442 * poisson**2) / (1 - poisson)
    for thickness in radius * np.array(thicknesses):
        material = Material(1.0, 0.0, 0.2, thickness=thickness, poisson_ratio=poisson)
        contact = contact_of(surface, material)
        state = contact.equilibrium(contact.untouched(), -indentation)
        modulus = (1 - poisson) ** 2 / (1 - 2 * poisson)
        order = -2 * alpha / math.pi * radius / thickness
        thin = thickness < radius
        force = math.pi * modulus / thickness * indentation**2 if thin else 4 / 3 * radius**3 * (1 + order + order**2)
        yield {
            "limit": "thin" if thin else "thick",
            "thickness": thickness / radius,
            "cells": thickness / spacing,
            "area_over": contact.area_fraction(state) * contact.area / (math.pi * indentation),
            "force_error": contact.pressure(state) * contact.area / force - 1,
        }
