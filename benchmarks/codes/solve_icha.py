"""icha: the whole sweep, from the heights to area and separation at every stop; bare numbers, as from the others.

`icha.simulate` does the same and makes a labelled dataset of it, whose libraries take a second and a half to import.
`icha-boundary-elements` are ICHA's own boundary elements in the limit of short range.
"""

import importlib
import sys

from task import Task
from threadpoolctl import threadpool_limits

import icha
from icha.contact.models import MODELS
from icha.path.follow import follow


def contact_of(code, surface, material):
    """The contact by one of the two models."""
    model = "boundary_elements" if code == "icha-boundary-elements" else "asperities"
    return importlib.import_module(MODELS[model].module).contact_of(surface, material)


def main():
    code = sys.argv.pop(1)
    task = Task.from_command_line()
    unit = task.contact_modulus * task.rms_slope
    if "mean_gaps" in task.settings:
        path = icha.Path(mean_separations=task.mean_gaps, snapshots=[])
    else:
        path = icha.Path(reduced_pressures=[pressure / unit for pressure in task.pressures], snapshots=[])
    task.start("icha", "icha.path.follow")
    surface = icha.Surface(task.heights, task.period)
    material = icha.Material(task.contact_modulus, task.surface_energy, task.interaction_range)
    with threadpool_limits(1):
        contact = contact_of(code, surface, material)
        for waypoint in follow(contact, path):
            state = waypoint.state
            task.answer_stop(
                pressure=contact.pressure(state),
                area_fraction=contact.area_fraction(state),
                mean_gap=state.separation,
            )


main()
