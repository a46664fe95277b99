"""Small rough surface with and without adhesion, solved with boundary elements; prints the digest of a solution."""

from digests import digest

import icha
from icha.references.finite_range import finite_range_solution

ROUGH = icha.SelfAffineSpectrum(period=100e-6, rolloff_wavelength=40e-6, short_wavelength=100e-6 / 7, hurst=0.8)
MATERIALS = {"hertz": icha.Material(25e6, 0.0, 1e-9), "adhesive": icha.Material(25e6, 0.05, 0.2e-6)}
PRESSURE = 1e-2


def surface():
    return ROUGH.realise(grid=48, seed=3)


if __name__ == "__main__":
    print(digest(finite_range_solution(surface(), MATERIALS["adhesive"], PRESSURE)))
