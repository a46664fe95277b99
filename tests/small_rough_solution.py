"""Small rough surface with and without adhesion, solved with boundary elements; digest of a solution."""

import hashlib

import icha
from icha.references.finite_range import finite_range_solution

ROUGH = icha.SelfAffineSpectrum(period=100e-6, rolloff_wavelength=40e-6, short_wavelength=100e-6 / 7, hurst=0.8)
MATERIALS = {"hertz": icha.Material(25e6, 0.0, 1e-9), "adhesive": icha.Material(25e6, 0.05, 0.2e-6)}
PRESSURE = 1e-2


def surface():
    return ROUGH.realise(grid=48, seed=3)


def digest(solution):
    """SHA-256 of all values of a dataset."""
    return hashlib.sha256(b"".join(solution[name].values.tobytes() for name in sorted(solution.variables))).hexdigest()


if __name__ == "__main__":
    print(digest(finite_range_solution(surface(), MATERIALS["adhesive"], PRESSURE)))
