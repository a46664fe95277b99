"""adhesion: exponential attraction outside a hard wall.

NuMPI's trust-region Newton method minimises the energy over the gaps. The load enters as its work, p times the mean
gap; every load starts from the gaps of the last.
"""

from Adhesion.Interactions import Exponential
from Adhesion.System import BoundedSmoothContactSystem
from ContactMechanics import PeriodicFFTElasticHalfSpace
from NuMPI.Optimization import tr_newton_bounded
from SurfaceTopography import Topography
from task import Task, area_on_grid

# The force that its authors leave on a node in their example of a rough contact, in E* h'_rms times the cell.
FORCE = 1e-5


def main():
    task = Task.from_command_line()
    unit, modulus = task.rms_height, task.contact_modulus
    heights = task.heights / unit
    size = (task.period / unit,) * 2
    substrate = PeriodicFFTElasticHalfSpace(heights.shape, 1.0, size, stiffness_q0=0.0)
    interaction = Exponential(task.surface_energy / (modulus * unit), task.interaction_range / unit)
    system = BoundedSmoothContactSystem(substrate, interaction, Topography(heights, size, periodic=True))
    elastic = system.primal_objective(0.0, gradient=True)
    cell = (size[0] / len(heights)) ** 2

    task.start("adhesion", f"tr_newton_bounded of NuMPI, loads, force on a node {FORCE:g} E* h'_rms cells")
    gap = heights.max() - heights
    for pressure in task.pressures:
        load = pressure / modulus * cell

        def energy(gap, load=load):
            value, gradient = elastic(gap)
            return value + load * gap.sum(), gradient.reshape(gap.shape) + load

        found = tr_newton_bounded(
            energy, gap, system.primal_hessian_product, bounds_lo=0.0, gtol=FORCE * task.rms_slope * cell, maxiter=1000
        )
        if not found.success:
            raise RuntimeError(f"no convergence at {pressure:g} Pa: {found.message}")
        gap = found.x
        task.answer_stop(pressure=pressure, area_fraction=area_on_grid(gap <= 0), mean_gap=gap.mean() * unit)


main()
