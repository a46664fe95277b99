"""ContactMechanics as reference for contacts without adhesion: run by `validation.indenter` in `.venv-benchmarks`.

python validation/indenter_other_code.py TASK.npz ANSWER.npz

The task contains heights, `period`, `separations`, and for layers `thickness` and `poisson` (lengths in m, E* = 1 Pa).
The answer contains pressures and gaps of the nodes, (m, n, n), and for layers the compliance of each Fourier mode.
"""

import sys

import numpy as np
from ContactMechanics import FreeFFTElasticHalfSpace, PeriodicFFTElasticHalfSpace
from ContactMechanics.Systems import NonSmoothContactSystem
from SurfaceTopography import Topography


def main():
    """Solve the contacts of a task."""
    task = np.load(sys.argv[1])
    heights, period = task["heights"], float(task["period"])
    n = len(heights)
    answer = {}
    if "thickness" in task:
        thickness, poisson = float(task["thickness"]), float(task["poisson"])
        # With a Poisson ratio, `young` is not the contact modulus.
        substrate = PeriodicFFTElasticHalfSpace(
            heights.shape, 1 - poisson**2, (period, period), thickness=thickness, poisson=poisson
        )
        force = np.zeros(heights.shape)
        force[0, 0] = (period / n) ** 2  # a unit pressure on one cell
        answer["compliance"] = np.abs(np.fft.rfft2(np.asarray(substrate.evaluate_disp(force)).reshape(n, n)))
    else:
        substrate = FreeFFTElasticHalfSpace(heights.shape, 1.0, (period, period))
    system = NonSmoothContactSystem(substrate, Topography(heights, (period, period), periodic="thickness" in task))
    pressures, gaps = [], []
    for separation in task["separations"]:
        found = system.minimize_proxy(offset=-float(separation), pentol=1e-9 * np.ptp(heights), maxiter=100000)
        if not found.success:
            raise SystemExit(f"no convergence at a separation of {separation:g} m: {found.message}")
        pressures.append(np.asarray(found.jac)[:n, :n] / (period / n) ** 2)
        gaps.append(np.asarray(found.x)[:n, :n] + separation - heights)
    np.savez(sys.argv[2], pressures=np.array(pressures), gaps=np.array(gaps), **answer)


main()
