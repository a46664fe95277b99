"""Windows around the few places where a front is far from rest, and the sums over neighbours that steps are made of."""

import numpy as np
import pytest
from scipy.ndimage import maximum_filter

from icha.boundary_elements import local_relaxation as module
from icha.boundary_elements.contact import contact_of
from icha.boundary_elements.elastic_contact import Contact, solve_bonded_contact
from icha.boundary_elements.front import average_fractions, neighbour_weights
from icha.boundary_elements.front_solver import find_active_cells
from icha.boundary_elements.half_space import HalfSpace
from validation.rough_contacts import SOFT, rough

GRID = 160


@pytest.mark.parametrize("around", [4, 20])
def test_displacements_in_a_window_are_those_of_the_whole_surface(around):
    restless = np.zeros((320, 320), dtype=bool)
    restless[60:66, 1] = restless[3, 100] = restless[-1, -2] = restless[1, 1] = True
    rng = np.random.default_rng(1)
    whole = HalfSpace.of(320)
    count = 0
    for cells, free in module.Regions.around(np.flatnonzero(restless), 320, around).windows(320):
        small = HalfSpace(cells.shape, *whole.window_kernel(cells.shape[-1]))
        pressure = rng.normal(size=np.count_nonzero(free))
        own = np.flatnonzero(free)
        found = small.field(own, small.displacement(own, pressure, own))
        values = small.field(own, pressure)
        for window, inside, displaced, pressed in zip(cells, free, found, values, strict=True):
            order = np.argsort(window[inside])
            at = window[inside][order]
            expected = whole.displacement(at, pressed[inside][order], at)
            np.testing.assert_allclose(displaced[inside][order], expected, rtol=0, atol=1e-12)
            count += 1
    # One for each place, also where this lies across edges of the period.
    assert count == 3


@pytest.mark.parametrize("grid", [700, 701])
def test_every_cell_near_a_restless_one_may_move_in_one_window_however_wide_the_restless_region_is(grid):
    restless = np.zeros((grid, grid), dtype=bool)
    restless[300, :] = restless[100:460, 240] = restless[650, 20] = True
    times = np.zeros(restless.size, int)
    for cells, free in module.Regions.around(np.flatnonzero(restless), grid, 4).windows(grid):
        assert cells.shape == free.shape and cells.shape[-1] in (64, 128)
        np.add.at(times, cells[free], 1)
    assert times.max() == 1
    # Across the edges less far, where the last block is smaller.
    near, far = (maximum_filter(restless, 2 * most + 1, mode=mode) for most, mode in ((4, "constant"), (7, "wrap")))
    assert times.reshape(grid, grid)[near].all() and not times.reshape(grid, grid)[~far].any()


@pytest.mark.parametrize("shape", [(64, 64), (3, 64, 64)])
def test_weights_between_cells_are_those_of_the_stencil(shape):
    space = HalfSpace(shape, HalfSpace.of(shape[-1]).compliance, HalfSpace.of(shape[-1]).stiffness)
    rng = np.random.default_rng(2)
    cells = np.sort(rng.choice(space.size, 900, replace=False))
    fraction = rng.random(900)
    expected = average_fractions(space.field(cells, fraction)).ravel()[cells]
    np.testing.assert_allclose(neighbour_weights(cells, shape) @ fraction, expected, rtol=0, atol=1e-6)


def test_a_front_disturbed_in_one_place_comes_to_rest_there_and_nothing_else_moves():
    contact = contact_of(rough(GRID, waves=GRID // 8), SOFT)
    separation = 2.0 * contact.rms_height
    state = contact.equilibrium(contact.untouched(), separation)
    tolerance, u = 1e-9 * contact.front.critical_opening, separation / contact.spacing
    pressure = state.pressure / contact.contact_modulus

    # Cells of the front, around one of them, are closed.
    place = state.cells[np.flatnonzero((state.fraction > 0.2) & (state.fraction < 0.8))[7]]
    apart = np.abs(np.stack(np.divmod(state.cells, GRID)) - np.stack(np.divmod(place, GRID))[:, None])
    near = np.all(np.minimum(apart, GRID - apart) <= 2, axis=0)
    fraction = np.where(near, 1.0, state.fraction)
    start = Contact(state.cells, fraction, pressure)
    disturbed = solve_bonded_contact(contact.space, contact.topography, u, start, tolerance)
    active = find_active_cells(contact.front, disturbed)
    moving = active.cells[active.residuals > 0.03]
    assert len(moving) and active.residual > 0.1

    relaxed = module.relax_in_windows(contact.space, contact.front, u, disturbed, disturbed.gap, moving)
    np.testing.assert_array_equal(relaxed.cells, state.cells)
    far = np.all(np.minimum(apart, GRID - apart) > 26, axis=0)
    np.testing.assert_array_equal(relaxed.fraction[far], state.fraction[far])
    assert np.abs(relaxed.fraction - state.fraction).max() < 0.05 < np.abs(fraction - state.fraction).max()
