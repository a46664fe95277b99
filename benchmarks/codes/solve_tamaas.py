"""tamaas: Polonsky & Keer's conjugate gradients; with adhesion in the gap, at given mean gap (Rey et al. 2017).

Without adhesion every load starts from the pressures of the last, which tamaas scales to the new load. With adhesion
its load control ends in other states at some loads, with a small error; so the mean gap is given.
"""

import numpy as np
import tamaas
from task import Task, area_on_grid

TOLERANCE = 1e-6


def main():
    task = Task.from_command_line()
    tamaas.initialize(task.threads)
    tamaas.set_log_level(tamaas.LogLevel.error)
    unit, modulus = task.rms_height, task.contact_modulus
    heights = task.heights / unit
    adhesive = task.surface_energy > 0
    model = tamaas.Model(tamaas.model_type.basic_2d, [task.period / unit] * 2, list(heights.shape))
    model.E, model.nu = 1.0, 0.0
    kind = tamaas.PolonskyKeerRey.gap if adhesive else tamaas.PolonskyKeerRey.pressure
    solver = tamaas.PolonskyKeerRey(model, heights, TOLERANCE, kind, kind)
    solver.max_iter = 100_000
    if adhesive:
        adhesion = tamaas.ExponentialAdhesionFunctional(heights)
        adhesion.parameters = {
            "rho": task.interaction_range / unit,
            "surface_energy": task.surface_energy / (modulus * unit),
        }
        solver.addFunctionalTerm(adhesion)
    task.start("tamaas", f"PolonskyKeerRey, {'in the gap' if adhesive else 'in the pressure'}, tolerance {TOLERANCE:g}")
    for stop in task.mean_gaps if adhesive else task.pressures:
        error = solver.solve(stop / unit if adhesive else stop / modulus)
        if error > TOLERANCE:
            raise RuntimeError(f"no convergence at {stop:g}: error {error:g}")
        pressure = np.asarray(model.traction)
        if adhesive:
            gap = np.asarray(model["gap"])
            contact = gap <= 0
        else:
            gap = np.asarray(model.displacement) - heights
            contact = pressure > 0
            gap -= gap[contact].mean()
        task.answer_stop(
            pressure=pressure.mean() * modulus, area_fraction=area_on_grid(contact), mean_gap=gap.mean() * unit
        )


main()
