"""contactmechanics: Polonsky & Keer's conjugate gradients; every load starts from the forces of the last."""

from ContactMechanics import PeriodicFFTElasticHalfSpace
from ContactMechanics.Systems import NonSmoothContactSystem
from SurfaceTopography import Topography
from task import Task, area_on_grid

# The penetration that its authors allow in their example of a rough contact, in rms slopes times the spacing.
PENETRATION = 1e-3


def main():
    task = Task.from_command_line()
    unit, modulus = task.rms_height, task.contact_modulus
    heights = task.heights / unit
    size = (task.period / unit,) * 2
    topography = Topography(heights, size, periodic=True)
    substrate = PeriodicFFTElasticHalfSpace(heights.shape, 1.0, size, stiffness_q0=0.0)
    system = NonSmoothContactSystem(substrate, topography)
    tolerance = PENETRATION * task.rms_slope * size[0] / len(heights)
    task.start("contactmechanics", f"minimize_proxy, penetration at most {PENETRATION:g} rms slopes times the spacing")
    forces = None
    for pressure in task.pressures:
        load = pressure / modulus * size[0] * size[1]
        if forces is not None:
            forces = forces * (load / -forces.sum())
        found = system.minimize_proxy(external_force=load, initial_forces=forces, pentol=tolerance)
        if not found.success:
            raise RuntimeError(f"no convergence at {pressure:g} Pa: {found.message}")
        forces = -found.jac
        contact = forces < 0
        gap = found.x - heights
        task.answer_stop(
            pressure=-forces.sum() / (size[0] * size[1]) * modulus,
            area_fraction=area_on_grid(contact),
            mean_gap=(gap.mean() - gap[contact].mean()) * unit,
        )


main()
