"""Loops of waves with so few cells that the front of their contact hops from one to the next."""

import numpy as np
import pytest

from icha import Material, Path, Surface, simulate
from icha.boundary_elements.contact import BoundaryElements
from icha.checks.run import check_run
from icha.contact.models import REFERENCE_MODEL

PERIOD, HEIGHT, CELLS = 100e-6, 1e-6, 16


@pytest.mark.slow
@pytest.mark.parametrize("energy", [3e-3, 1e-2])
def test_a_loop_whose_front_hops_takes_few_equilibria(energy, monkeypatch):
    # No jump makes this contact, and no shorter step makes the work that is lost in hops better known.
    count, equilibrium = 0, BoundaryElements.equilibrium

    def counted(*arguments, **options):
        nonlocal count
        count += 1
        return equilibrium(*arguments, **options)

    monkeypatch.setattr(BoundaryElements, "equilibrium", counted)
    wave = np.cos(2 * np.pi * np.arange(CELLS) / CELLS)
    surface = Surface(HEIGHT * (wave[:, None] + wave), PERIOD, "periodic")
    path = Path(area_fractions=[0.2], unload=True, snapshots=[])
    run = simulate(surface, Material(1e6, energy, 300e-9), path, model=REFERENCE_MODEL)
    assert count < 600
    assert not [check for check in check_run(run) if not check.passed]
