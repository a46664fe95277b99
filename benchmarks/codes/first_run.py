"""The first `icha.simulate` of a process: what it takes beside its computation, in s of processor.

python first_run.py ANSWER THREADS
"""

import json
import sys
import time
from pathlib import Path

import icha

spectrum = icha.SelfAffineSpectrum(100e-6, 50e-6, 800e-6 / 128, 0.8)
surface = spectrum.realise(grid=128, seed=1)
material = icha.Material(contact_modulus=25e6, surface_energy=0.05, interaction_range=2e-9)
path = icha.Path(reduced_pressures=[1e-2])
icha.simulate(surface, material, path)
first = time.process_time()
icha.simulate(surface, material, path)
again = time.process_time() - first
# From the start of the process on.
Path(sys.argv[1]).write_text(json.dumps({"first": first, "again": again, "overhead": first - again}))
