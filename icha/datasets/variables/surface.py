"""Variables of the file of a surface."""

import numpy as np

from icha.datasets.build import BOUND
from icha.datasets.variables.terms import Variable, terms

_RING = ("psd_bin",)

SURFACE = {
    **terms("x", "y"),
    "psd_wavevector": Variable(
        _RING,
        "rad m^-1",
        "wave number of a ring of wave vectors",
        further={"bounds": "psd_wavevector_bounds", "comment": "mean over the ring's wave vectors"},
        coordinate=True,
    ),
    "height": Variable(("y", "x"), "m", "height towards the elastic body"),
    "period": Variable((), "m", "side of the periodic cell, or of the free square"),
    "grid": Variable((), "1", "nodes along a side", np.int32),
    "seed": Variable((), "1", "seed of the random phases", np.int32),
    "rms_slope": Variable((), "1", "root mean square slope"),
    **terms("rms_height"),
    "rms_curvature": Variable((), "m^-1", "root mean square curvature of a profile"),
    "spectral_moment_0": Variable((), "m^2", "variance of a profile's height"),
    "spectral_moment_2": Variable((), "1", "variance of a profile's slope"),
    "spectral_moment_4": Variable((), "m^-2", "variance of a profile's curvature"),
    "nayak_parameter": Variable((), "1", "Nayak's parameter m0 m4/m2^2"),
    "psd_wavevector_bounds": Variable((*_RING, BOUND), "rad m^-1", "wave number of a ring of wave vectors"),
    "power_spectrum": Variable(
        _RING, "m^4", "isotropic power spectrum C(q); its integral over the plane is the variance of height"
    ),
    # Of a synthesised surface.
    "rolloff_wavelength": Variable((), "m", "roll-off wavelength"),
    "short_wavelength": Variable((), "m", "short cut-off wavelength"),
    "hurst": Variable((), "1", "Hurst exponent"),
    # Of a measured one.
    "measured_rms_slope": Variable((), "1", "root mean square slope of the measurement as prepared, before scaling"),
}
