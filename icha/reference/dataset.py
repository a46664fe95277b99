"""Theory curves and published points as one dataset, for the figures of one surface."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from icha.reference import theories
from icha.reference.literature import literature
from icha.spectrum import SelfAffineSpectrum

REDUCED_PRESSURES = np.geomspace(1e-5, 1.0, 101)


def reference_dataset(
    spectrum: SelfAffineSpectrum | None = None,
    *,
    reduced_pressures=REDUCED_PRESSURES,
    attrs: Mapping[str, str] = {},
) -> xr.Dataset:
    """Theories on a grid of reduced pressures, and the points of the literature.

    Parameters
    ----------
    spectrum : of the surface; without one (a measured surface) there is no theory of its separation and stiffness.
    reduced_pressures : p/(E* h'_rms), increasing and positive.
    attrs : further global attributes.
    """
    pressure = np.asarray(reduced_pressures, float)
    linear = pressure[theories.bush_gibson_thomas_area(pressure) <= theories.BUSH_GIBSON_THOMAS_AREA_LIMIT]
    gfmd = literature("gfmd_area")
    reduced = "nominal pressure over contact modulus and rms slope, p/(E* h'rms)"
    area = "real over nominal contact area, A/A0"

    def variable(dim, values, long_name, source):
        described = {"units": "1", "long_name": long_name}
        return xr.Variable(dim, values, described | ({"references": source} if source else {}))

    persson = "B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840, doi:10.1063/1.1388626"
    yang = "C. Yang and B. N. J. Persson, J. Phys.: Condens. Matter 20 (2008) 215214, gamma = 0.45"
    bush = "A. W. Bush, R. D. Gibson and T. R. Thomas, Wear 35 (1975) 87, doi:10.1016/0043-1648(75)90145-3"
    points = gfmd["citation"] + " " + gfmd["description"]
    variables = {
        "persson_area_fraction": variable(
            "reduced_pressure", theories.persson_area(pressure), f"{area}, Persson", persson
        ),
        "linear_pressure": variable("linear_point", linear, reduced, ""),
        "bush_gibson_thomas_area_fraction": variable(
            "linear_point", theories.bush_gibson_thomas_area(linear), f"{area}, Bush, Gibson and Thomas", bush
        ),
        "gfmd_reduced_pressure": variable("gfmd_point", np.array(gfmd["reduced_pressure"]), reduced, points),
        "gfmd_area_fraction": variable("gfmd_point", np.array(gfmd["area_fraction"]), f"{area}, GFMD", points),
    }
    if spectrum is not None:
        variables["persson_reduced_separation"] = variable(
            "reduced_pressure",
            theories.persson_mean_separation(pressure, spectrum),
            "mean separation over rms height, Yang and Persson",
            yang,
        )
        variables["persson_reduced_stiffness"] = variable(
            "reduced_pressure",
            theories.persson_stiffness(pressure, spectrum),
            "contact stiffness times rms height over contact modulus and rms slope, Yang and Persson",
            yang,
        )
    coords = {"reduced_pressure": variable("reduced_pressure", pressure, reduced, "")}
    title = {
        "title": "Theories of adhesionless rough contact, and published points",
        "summary": "Contact area, mean separation and contact stiffness against reduced pressure.",
        "Conventions": "CF-1.11",
    }
    return xr.Dataset(variables, coords, title | dict(attrs))
