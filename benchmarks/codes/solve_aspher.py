"""aspher: nested grids, preconditioned conjugate gradients on the periodic half-space; no adhesion.

On these surfaces nested grids in mixed precision were faster than starting every load from the last one's pressures.
"""

import aspher
import numpy as np
from task import Task, area_on_grid

TOLERANCE = 1e-6


def main():
    task = Task.from_command_line()
    unit, modulus = task.rms_height, task.contact_modulus
    heights = task.heights / unit
    task.start("aspher", f"solve_nested, periodic, single then double precision, tolerance {TOLERANCE:g}")
    for pressure in task.pressures:
        found = aspher.solve_nested(
            grid_size=len(heights),
            gap=-heights.ravel(),
            p_nominal=pressure / modulus,
            domain_size=task.period / unit,
            backend="periodic",
            tol=TOLERANCE,
            precision="float_then_double",
        )
        if not found.converged:
            raise RuntimeError(f"no convergence at {pressure:g} Pa: {found.status_reason}")
        pressures = np.asarray(found.pressure)
        contact = pressures > 0
        gap = np.asarray(found.displacement).reshape(heights.shape) - heights
        task.answer_stop(
            pressure=pressures.mean() * modulus,
            area_fraction=area_on_grid(contact),
            mean_gap=(gap.mean() - gap[contact].mean()) * unit,
        )


main()
