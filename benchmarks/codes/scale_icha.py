"""The solver alone, from asperities to the last of 20 loads, on k x k patches side by side.

The patches are realisations of one spectrum, each shifted at random within its own period, so that the surface is one
of a larger period with the same roughness. The 16 that there are serve in turn. Heights do not join at the seams, of
which the solver, given asperities, knows nothing.
"""

import json
import resource
import sys
import time
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

import icha
from icha.asperity.jkr import JKR
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.path.follow import follow
from icha.surfaces.summits import Asperities

REDUCED_PRESSURES = np.geomspace(5e-4, 8e-2, 20)
MATERIAL = {False: icha.Material(25e6, 0.0, 2.071e-9), True: icha.Material(25e6, 0.05, 2.071e-9)}


def side_by_side(folder, patches):
    """Asperities of the whole surface, its rms height and slope."""
    saved = [dict(np.load(folder / f"patch{seed}.npz")) for seed in range(len(list(folder.glob("patch*.npz"))))]
    period = float(saved[0]["period"])
    shifts = np.random.Generator(np.random.PCG64(1)).random((patches**2, 2)) * period
    places = [(column, row) for row in range(patches) for column in range(patches)]
    used = [saved[i % len(saved)] for i in range(patches**2)]
    position = np.concatenate(
        [
            np.mod(patch["position"] + shift, period) + np.multiply(place, period)
            for patch, shift, place in zip(used, shifts, places, strict=True)
        ]
    )
    asperities = Asperities(
        position,
        np.concatenate([patch["height"] for patch in used]),
        np.concatenate([patch["radius"] for patch in used]),
        patches * period,
    )
    return asperities, float(saved[0]["rms_height"]), float(saved[0]["rms_slope"])


def main(folder, patches, adhesion, answer):
    asperities, rms_height, rms_slope = side_by_side(folder, patches)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    material = MATERIAL[adhesion]
    contact = InteractingAsperities(JKR(material), asperities, rms_height)
    unit = material.contact_modulus * rms_slope
    path = icha.Path(reduced_pressures=list(REDUCED_PRESSURES), snapshots=[])
    start = time.perf_counter()
    rows = []
    with threadpool_limits(1):
        for waypoint in follow(contact, path, unit):
            state = waypoint.state
            rows.append(
                {
                    "seconds": time.perf_counter() - start,
                    "spots": len(state.spots),
                    "area_fraction": contact.area_fraction(state),
                    "residual": float(state.residual),
                    "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
                }
            )
            found = {"asperities": len(asperities), "memory_before": before * 1024, "stops": rows}
            answer.write_text(json.dumps(found))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3] == "1", Path(sys.argv[4]))
