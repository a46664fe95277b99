"""Cases for `benchmarks/costs.py`, drawn at random: whatever number they are drawn with, they are of the same kinds.

Every case is small: some seconds at most. What is drawn are the values that campaigns differ in: grid, spectrum, slope,
material, loads, ways, snapshots, files of measured surfaces, figures.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import icha
from icha.asperity.cohesive_zone import shortest_range
from icha.configuration.measured_surfaces import MeasuredSurface
from icha.contact.models import ASPERITIES, BOUNDARY_ELEMENTS
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import write_surface
from icha.planning import costs
from icha.planning.roughness import measured_roughness
from icha.references.finite_range import finite_range_solution
from icha.references.finite_range_loops import finite_range_loop
from icha.simulation import simulate
from icha.surfaces.measured.topography import prepared_topography
from icha.surfaces.moments import spectral_moments
from validation.error_sources.variants import error_sources

PERIOD, RANGE, MODULUS = 100e-6, 2.071e-9, 25e6
TOPOGRAPHIES = Path(__file__).resolve().parents[1] / "config/topographies"
# Measured surfaces, and what has to be said of each.
SCANS = {
    "published/al3d-1.al3d": {"detrend": "curvature"},
    "published/di-3.di": {"detrend": "curvature", "data": "ZSensor"},
    "published/tmd-1.tmd": {"detrend": "tilt"},
    "synthetic_scan.txt": {"height_unit": "nm", "size": ["72 um", "64 um"], "missing": "fill"},
}


@dataclass(frozen=True)
class Case:
    """One piece of work that writes a file, and what is expected of it with given constants."""

    kind: str
    title: str
    cost: Callable[[costs.Constants], costs.Cost]
    work: Callable[[Path], None]


class Draw:
    """Cases that one number draws."""

    def __init__(self, number: int):
        self._random = np.random.default_rng(number)

    def cases(self) -> Iterator[Case]:
        """All of them, in their order."""
        for grid in self._grids(4, 64, 1500):
            yield surface(grid)
        for _ in range(12):
            yield self.sweep("loading", self._grid(96, 1000))
        yield self.sweep("loading", self._grid(1200, 1800))
        for _ in range(8):
            yield self.sweep("both ways", self._grid(48, 160), legs=1)
        for _ in range(10):
            yield self.sweep("patches", self._grid(64, 200), model=BOUNDARY_ELEMENTS)
        for _ in range(5):
            yield self.sweep("patches both ways", self._grid(40, 72), legs=1, model=BOUNDARY_ELEMENTS)
        for _ in range(3):
            yield self.scan("loading", ASPERITIES)
            yield self.scan("patches", BOUNDARY_ELEMENTS)
        for adhesive in (False, True):
            for _ in range(2):
                yield self.solution(adhesive)
        yield self.loop()
        yield self.sources()

    def campaigns(self) -> Iterator[dict]:
        """Small campaigns, each with figures and a report."""
        for index in range(4):
            yield self.campaign(f"small{index}")

    def campaign(self, name):
        grid, seeds = self._grid(64, 256), int(self._random.integers(1, 4))
        largest = self._log(3e-3, 0.05)
        loads = [float(load) for load in np.geomspace(largest / 30, largest, int(self._random.integers(3, 10)))]
        both_models, unload = self._random.random(2) < (0.5, 0.3)
        materials = {
            material: {
                "contact_modulus": "2 MPa",
                "surface_energy": f"{energy:.3g} mJ/m^2",
                "interaction_range": "2 nm",
            }
            for material, energy in zip(
                ("bare", "weak", "strong"), (0, self._log(1, 5), self._log(10, 40)), strict=True
            )
        }
        study = {
            "surfaces": ["rough"],
            "seeds": f"1..{seeds}",
            "rms_slopes": [round(self._random.uniform(0.2, 0.5), 2)],
            "materials": list(materials),
            "targets": {"reduced_pressures": loads},
            "snapshots": [{"reduced_pressure": loads[-1]}],
        }
        if both_models:
            study["models"] = ["asperities", "boundary_elements"]
            grid = min(grid, 128)
        elif unload:
            study["unload"] = True
            grid = min(grid, 96)
        asked = {"study": "load"}
        further = ["fig3_distributions", "fig4_contact_map", "fig7_stiffness", "fig8_patch_sizes"]
        chosen = ["fig2_area_and_gap", *self._random.choice(further, int(self._random.integers(0, 4)), replace=False)]
        models = ", both models" if both_models else ", both ways" if unload else ""
        return {
            "name": name,
            "title": f"{grid}², {3 * seeds} sweeps of {len(loads)} loads{models}, {len(chosen)} figures",
            "summary": "One of the cases of a benchmark.",
            "license": "CC0-1.0",
            "surfaces": {
                "rough": {
                    "kind": "self_affine",
                    "period": "1 mm",
                    "rolloff_wavelength": f"{1 / self._random.uniform(2, 5):.3f} mm",
                    "short_wavelength": f"{8 / grid:.5f} mm",
                    "hurst": round(self._random.uniform(0.5, 0.9), 2),
                    "grid": grid,
                }
            },
            "materials": materials,
            "studies": {"load": study},
            "figures": {str(figure): asked for figure in chosen},
        }

    def _grid(self, least, most):
        return 2 * round(self._log(least, most) / 2)

    def _grids(self, count, least, most):
        return [self._grid(least, most) for _ in range(count)]

    def _log(self, least, most):
        return float(np.exp(self._random.uniform(np.log(least), np.log(most))))

    def _spectrum(self, grid, most_cells):
        cells = self._random.uniform(5, most_cells)
        rolloff = PERIOD / self._random.uniform(1, min(6, grid / cells / 2))
        return icha.SelfAffineSpectrum(PERIOD, rolloff, PERIOD / grid * cells, self._random.uniform(0.3, 1))

    def _path(self, legs):
        largest = self._log(3e-3, 0.08)
        count = int(self._random.integers(1, 4 if legs else 21))
        loads = np.geomspace(largest / self._log(3, 100), largest, count) if count > 1 else [largest]
        snapshots = None if self._random.random() < 0.6 else [("reduced_pressure", float(load)) for load in loads[:3]]
        return icha.Path(reduced_pressures=[float(load) for load in loads], snapshots=snapshots, unload=bool(legs))

    def _material(self, rough):
        """Without adhesion, or with one that bends summits by more or less of the roughness."""
        if self._random.random() < 0.4:
            return icha.Material(MODULUS, 0.0, RANGE)
        moments = spectral_moments(rough)
        energy = MODULUS * moments.m0**0.75 * (8 / 3 * moments.m4) ** 0.25 * self._log(3e-4, 1e-2)
        return icha.Material(MODULUS, energy, RANGE)

    def sweep(self, kind, grid, legs=0, model=ASPERITIES):
        form, seed = self._spectrum(grid, 12 if legs else 9), int(self._random.integers(1, 100))
        surface = form.realise(grid, seed).scaled_to_rms_slope(self._log(0.1, 1.2))
        moments = costs.self_affine_moments(PERIOD, form.rolloff_wavelength, form.short_wavelength, form.hurst)
        shape = f"{form.short_wavelength / PERIOD * grid:.1f} cells, hurst {form.hurst:.2f}"
        shape += f", roll-off {PERIOD / form.rolloff_wavelength:.1f}"
        return self._pressed(kind, surface, costs.roughness_of(grid, PERIOD, *moments), shape, legs, model)

    def scan(self, kind, model):
        """A measured surface, as it is or with the noise of a bad instrument."""
        name = str(self._random.choice(sorted(SCANS)))
        boundary = str(self._random.choice(["window", "mirror"]))
        section = MeasuredSurface(
            kind="measured", path=str(TOPOGRAPHIES / name), boundary=boundary, grid=self._grid(80, 200), **SCANS[name]
        )
        surface = prepared_topography(section.path, section.preparation).surface
        noise = float(self._random.choice([0, 0, 0.02]))
        if noise:
            heights = surface.heights + noise * surface.rms_height * self._random.standard_normal(surface.heights.shape)
            surface = icha.Surface(heights, surface.period)
        rough = measured_roughness(surface)
        shape = f"{name}, {boundary}, noise {noise:g}, {rough.summits} summits"
        return self._pressed(kind, surface, rough, shape, 0, model)

    def _pressed(self, kind, surface, rough, shape, legs, model):
        path, material = self._path(legs), self._material(surface)
        asked = costs.Sweep(
            loads=tuple(target.value for target in path.targets),
            snapshots=len([target for target in path.targets if target.snapshot]),
            adhesion=material.adhesion_length / (rough.sharpness * surface.rms_slope**2),
            legs=legs,
            max_step=path.max_step,
        )
        expected = costs.sweep_cost if model == ASPERITIES else costs.patch_cost
        adhesion = f"{material.surface_energy * 1e3:.3g} mJ/m2" if material.surface_energy else "bare"
        loads = f"{len(path.targets)} stops to {path.targets[-1].value:.3g}"
        return Case(
            kind,
            f"{kind} {surface.grid}², {shape}, slope {surface.rms_slope:.2f}, {adhesion}, {loads}",
            lambda constants: expected(rough, asked, constants),
            lambda file: write_dataset(simulate(surface, material, path, model=model), file),
        )

    def solution(self, adhesive):
        grid, refinement = self._grid(64, 128), 2
        nodes, pressure = grid * refinement, self._log(2e-3, 0.05)
        form = self._spectrum(grid, 9)
        material = resolved(nodes) if adhesive else icha.Material(MODULUS, 0.0, RANGE)
        rough = form.realise(grid, 1)
        return Case(
            "finite range",
            f"finite range {nodes}², {'adhesive' if adhesive else 'bare'}, hurst {form.hurst:.2f}, p* = {pressure:.3g}",
            lambda constants: costs.solution_cost(nodes, pressure, constants, adhesive=adhesive),
            lambda file: write_dataset(finite_range_solution(rough, material, pressure, refinement=refinement), file),
        )

    def loop(self):
        nodes, step = 4 * self._grid(20, 30), self._log(0.2, 0.4)
        material = resolved(nodes)
        rough = icha.SelfAffineSpectrum(PERIOD, PERIOD, PERIOD / nodes * 32, 0.8, 0.3).realise(nodes // 4, 1)
        settings = {"largest_reduced_pressure": 0.01, "separation_step": step, "refinement": 4, "tolerance": 1e-6}
        return Case(
            "finite range both ways",
            f"finite range both ways {nodes}², steps of {step:.2f}",
            lambda constants: costs.loop_cost(nodes, step, constants, adhesive=True),
            lambda file: write_dataset(finite_range_loop(rough, material, **settings), file),
        )

    def sources(self):
        grid, loads = self._grid(64, 96), [self._log(2e-3, 4e-3), self._log(8e-3, 3e-2)]
        rough = self._spectrum(grid, 9).realise(grid, 1)
        return Case(
            "error sources",
            f"error sources {2 * grid}², {len(loads)} loads to {loads[-1]:.3g}",
            lambda constants: costs.sources_cost(2 * grid, loads, constants, adhesive=False),
            lambda file: write_dataset(error_sources(rough, icha.Material(MODULUS, 0.0, RANGE), loads), file),
        )


def surface(grid: int) -> Case:
    """Making a topography."""
    form = icha.SelfAffineSpectrum(PERIOD, PERIOD / 5, PERIOD / grid * 8, 0.8)
    return Case(
        "surface",
        f"surface {grid}²",
        lambda constants: costs.surface_cost(grid, constants),
        lambda file: write_surface(file, form.realise(grid, 1), name="rough", seed=1),
    )


def resolved(nodes: int) -> icha.Material:
    """Adhesion whose range so many nodes just resolve."""
    energy = 0.05
    return icha.Material(MODULUS, energy, 1.02 * shortest_range(icha.Material(MODULUS, energy, RANGE), PERIOD / nodes))
