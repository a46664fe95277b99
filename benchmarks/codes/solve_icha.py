"""icha: the whole sweep, from the heights to area and separation at every stop."""

from task import Task

import icha


def main():
    task = Task.from_command_line()
    surface = icha.Surface(task.heights, task.period)
    material = icha.Material(task.contact_modulus, task.surface_energy, task.interaction_range)
    if "mean_gaps" in task.settings:
        path = icha.Path(mean_separations=task.mean_gaps, snapshots=[])
    else:
        unit = task.contact_modulus * task.rms_slope
        path = icha.Path(reduced_pressures=[pressure / unit for pressure in task.pressures], snapshots=[])
    simulate = icha.simulate  # imported here, before the clock starts
    task.start("icha", "icha.simulate")
    run = simulate(surface, material, path)
    for step in range(run.sizes["step"]):
        at = run.isel(step=step)
        task.answer_stop(
            pressure=at.nominal_pressure,
            area_fraction=at.contact_area_fraction,
            mean_gap=at.mean_separation,
            residual=at.residual,
            spots=int(at.spot_count),
        )


main()
