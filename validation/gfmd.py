"""Boundary elements without adhesion from first touch to full contact, beside published molecular dynamics.

Compares counted areas, elastic energies and mean gaps at 14 loads with Green's function molecular dynamics (GFMD) by
Y. Zhou, on the grid that its areas are counts of: 4 cells per shortest wave. The square has a side of four roll-off
waves; with fewer long waves areas and energies scatter by 6 to 40 %. `python -m validation.gfmd` takes about half an
hour and 2 GB of memory, and writes a table for the page on short range.
"""

import sys

import numpy as np
import scipy.fft

from icha.asperity.material import Material
from icha.boundary_elements.contact import contact_of
from icha.path.follow import follow
from icha.path.targets import Path
from icha.references.theories import literature
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.surface import Surface
from validation.tables import Table, percent, write_tables

_ROLLOFFS, _CELLS, _HURST = 4, 4, 0.8
BARE = Material(1.0, 0.0, 1e-3)


def without_plateau(seed: int, cutoff_ratio: int) -> Surface:
    """Return a surface with no waves longer than the roll-off, rms slope 1, roll-off wavelength 1 m."""
    waves = _ROLLOFFS * cutoff_ratio
    heights = SelfAffineSpectrum(_ROLLOFFS, 1.0, _ROLLOFFS / waves, _HURST).realise(_CELLS * waves, seed).heights
    modes, along = scipy.fft.rfft2(heights), scipy.fft.fftfreq(len(heights), 1 / len(heights))
    modes[np.hypot(along[:, None], np.arange(modes.shape[1])) < _ROLLOFFS] = 0.0
    return Surface(scipy.fft.irfft2(modes, s=heights.shape), _ROLLOFFS).scaled_to_rms_slope(1.0)


def follow_loads(surface: Surface, pressures: list[float]) -> np.ndarray:
    """Return counted area, energy over that of full contact and mean gap over h_rms at reduced pressures, (n, 3)."""
    contact, rows = contact_of(surface, BARE), []
    for waypoint in follow(contact, Path(pressures, snapshots=[])):
        state = waypoint.state
        energy = contact.stored_energy(state) / (BARE.contact_modulus * surface.full_contact_energy)
        gap = contact.mean_gap(state) / surface.rms_height
        rows.append((np.count_nonzero(state.pressure > 0) / surface.heights.size, energy, gap))
        print(f"p* = {waypoint.target.value:.4g}:", *(f"{value:.5g}" for value in rows[-1]), flush=True)
    return np.array(rows)


def main(seeds: list[int]) -> None:
    """Write the table of some seeds."""
    area, gap = literature("gfmd_area"), literature("gfmd_gap")
    pressures = area["reduced_pressure"]
    found = [follow_loads(without_plateau(seed, area["cutoff_ratio"]), pressures) for seed in seeds]
    mean, rows = np.mean(found, axis=0), []
    for k, pressure in enumerate(pressures):
        published = area["area_fraction"][k], area["energy_ratio"][k], *gap["reduced_gap"][k : k + 1]
        cells = [f"{pressure:.4g}", f"{published[0]:.4g} ± {area['area_scatter'][k]:.1g}"]
        rows.append(cells + [percent(ours / theirs - 1) for ours, theirs in zip(mean[k], published, strict=False)])
    head = ["p\\*", "area, GFMD", "area, %", "energy, %", "mean gap, %"]
    write_tables({"short_range_gfmd": Table(head, [row + [""] * (5 - len(row)) for row in rows], numbers=True)})


if __name__ == "__main__":
    main([int(seed) for seed in sys.argv[1:]] or [1, 2, 3])
