"""icha-boundary-elements: ICHA's own boundary elements in the limit of short range, the same sweep as `solve_icha`."""

from task import Task
from threadpoolctl import threadpool_limits

import icha
from icha.boundary_elements.contact import contact_of
from icha.path.follow import follow


def main():
    task = Task.from_command_line()
    unit = task.contact_modulus * task.rms_slope
    path = icha.Path(reduced_pressures=[pressure / unit for pressure in task.pressures], snapshots=[])
    task.start("icha", "icha.path.follow, boundary elements")
    surface = icha.Surface(task.heights, task.period)
    material = icha.Material(task.contact_modulus, task.surface_energy, task.interaction_range)
    with threadpool_limits(1):
        contact = contact_of(surface, material)
        for waypoint in follow(contact, path, unit):
            state = waypoint.state
            task.answer_stop(
                pressure=contact.pressure(state),
                area_fraction=contact.area_fraction(state),
                mean_gap=state.separation,
                front_residual=float(state.front_residual),
                spots=contact.spot_count(state),
            )


main()
