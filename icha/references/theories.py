"""Theory curves and published points as one dataset, for the figures of one surface."""

import json
from collections.abc import Mapping
from importlib.resources import files

import numpy as np
import xarray as xr

from icha.asperity.material import Material
from icha.datasets.attributes import THEORY, file_attributes
from icha.datasets.variables.terms import TERMS
from icha.references import persson, summit_theories
from icha.surfaces.moments import SpectralMoments
from icha.surfaces.spectrum import SelfAffineSpectrum

REDUCED_PRESSURES = np.geomspace(1e-5, 3.0, 111)
SUMMIT_AREAS = np.geomspace(1e-5, summit_theories.SEPARATE_SUMMITS_AREA_LIMIT, 81)


def literature(name: str) -> dict:
    """Return one entry of `literature.json`: published numbers with title, description, citation, DOIs and units.

    Entries are `gfmd_area`, `gfmd_gap`, `area_slope` and `contact_mechanics_challenge`. All lists of an entry have one
    number per point.
    """
    return json.loads(files("icha.references").joinpath("literature.json").read_text(encoding="utf-8"))[name]


def reference_dataset(
    spectrum: SelfAffineSpectrum | None = None,
    moments: SpectralMoments | None = None,
    adhesive: Mapping[tuple[float, str], Material] = {},
    *,
    reduced_pressures=REDUCED_PRESSURES,
    attrs: Mapping[str, str] = {},
) -> xr.Dataset:
    """Return a dataset of theories of a surface, and of published points of surfaces with the same spectrum.

    Parameters
    ----------
    spectrum : spectrum of the surface. None, as for a measured surface: Persson's theory gives the area only.
    moments : spectral moments of the surface at any rms slope. None: there are no theories of separate summits.
    adhesive : materials with adhesion, by rms slope and name; each has a curve of Fuller & Tabor.
    reduced_pressures : p/(E* h'_rms), increasing and positive.
    attrs : further global attributes.

    Returns
    -------
    Dataset with Persson's theory along `reduced_pressure`; that of Bush, Gibson & Thomas along `linear_point`; those of
    Greenwood & Williamson and of Fuller & Tabor along `summit_point`, at the areas `summit_area_fraction`; and
    published points along `gfmd_point`.
    """
    variables = _mean_field_theories(np.asarray(reduced_pressures, float), spectrum) | _published_points(spectrum)
    if moments is not None:
        variables |= _summit_theories(moments, adhesive)
    described = file_attributes(
        "Theories of rough contact, and published points",
        "Contact area, mean separation and contact stiffness against reduced pressure.",
        THEORY,
        references="; ".join(
            dict.fromkeys(v.attrs["references"] for v in variables.values() if "references" in v.attrs)
        ),
    )
    return xr.Dataset(variables, attrs=described | dict(attrs))


_PRESSURE, _AREA, _SEPARATION, _NAYAK = (
    TERMS[name].long_name
    for name in ("reduced_pressure", "contact_area_fraction", "reduced_separation", "nayak_parameter")
)


def _make_variable(dim, values, long_name, source=""):
    """Make a variable without a unit from its values, with the publication of the theory as its source."""
    described = {"units": "1", "long_name": long_name}
    return xr.Variable(dim, values, described | ({"references": source} if source else {}))


def _mean_field_theories(pressure, spectrum):
    """Return the variables of Persson's theory and that of Bush, Gibson & Thomas at reduced pressures, by name."""
    dim = "reduced_pressure"
    variables = {
        dim: _make_variable(dim, pressure, _PRESSURE),
        "persson_area_fraction": _make_variable(
            dim, persson.persson_area(pressure), f"{_AREA}, Persson", persson.PERSSON
        ),
        "xu_area_fraction": _make_variable(
            dim, persson.corrected_persson_area(pressure), f"{_AREA}, Persson corrected by Xu and others", persson.XU
        ),
    }
    if spectrum is not None:
        separation = persson.persson_mean_separation(pressure, spectrum)
        stiffness = persson.persson_stiffness(pressure, spectrum)
        long_name = "contact stiffness times rms height over contact modulus and rms slope, Yang and Persson"
        variables |= {
            "persson_reduced_separation": _make_variable(
                dim, separation, f"{_SEPARATION}, Yang and Persson", persson.YANG_PERSSON
            ),
            "persson_reduced_stiffness": _make_variable(dim, stiffness, long_name, persson.YANG_PERSSON),
        }
    linear = pressure[summit_theories.bush_gibson_thomas_area(pressure) <= summit_theories.SEPARATE_SUMMITS_AREA_LIMIT]
    area, long_name = summit_theories.bush_gibson_thomas_area(linear), f"{_AREA}, Bush, Gibson and Thomas"
    return variables | {
        "linear_pressure": _make_variable("linear_point", linear, _PRESSURE),
        "bush_gibson_thomas_area_fraction": _make_variable(
            "linear_point", area, long_name, summit_theories.BUSH_GIBSON_THOMAS
        ),
    }


def _summit_theories(moments, adhesive):
    """Return the variables of the theories of Greenwood & Williamson and of Fuller & Tabor, by name."""
    dim, by = "summit_point", "Greenwood and Williamson"
    separation = summit_theories.separation_at(summit_theories.greenwood_williamson_area, SUMMIT_AREAS, moments)
    pressure = summit_theories.greenwood_williamson_pressure(separation, moments)
    variables = {
        "nayak_parameter": _make_variable((), moments.nayak_parameter, _NAYAK),
        "summit_area_fraction": _make_variable(dim, SUMMIT_AREAS, f"{_AREA}, at which separate summits are evaluated"),
        "greenwood_williamson_reduced_pressure": _make_variable(
            dim, pressure, f"{_PRESSURE}, {by}", summit_theories.GREENWOOD_WILLIAMSON
        ),
        "greenwood_williamson_reduced_separation": _make_variable(
            dim, separation, f"{_SEPARATION}, {by}", summit_theories.GREENWOOD_WILLIAMSON
        ),
    }
    if not adhesive:
        return variables
    curves = []
    for (rms_slope, _), material in adhesive.items():
        scaled = moments.scaled_to_rms_slope(rms_slope)
        separation = summit_theories.separation_at(summit_theories.fuller_tabor_area, SUMMIT_AREAS, scaled, material)
        curves.append((summit_theories.fuller_tabor_pressure(separation, scaled, material), separation))
    pressures, separations = np.moveaxis(np.array(curves), 1, 0)
    slopes, names = zip(*adhesive, strict=True)
    curve, by = "fuller_tabor_curve", "Fuller and Tabor"
    return variables | {
        "fuller_tabor_rms_slope": _make_variable(
            curve, np.array(slopes, float), "root mean square slope of the surface"
        ),
        "fuller_tabor_material": _make_variable(curve, np.array(names, dtype=object), "name of the material"),
        "fuller_tabor_reduced_pressure": _make_variable(
            (curve, dim), pressures, f"{_PRESSURE}, {by}", summit_theories.FULLER_TABOR
        ),
        "fuller_tabor_reduced_separation": _make_variable(
            (curve, dim), separations, f"{_SEPARATION}, {by}", summit_theories.FULLER_TABOR
        ),
    }


def _published_points(spectrum):
    """Return the variables of points by Green's function molecular dynamics, if they are of this spectrum, by name."""
    gfmd = literature("gfmd_area")
    if spectrum is None:
        return {}
    ratios = (spectrum.rolloff_wavelength / spectrum.period, spectrum.period / spectrum.short_wavelength)
    if not np.allclose((spectrum.hurst, *ratios), (gfmd["hurst"], 1.0, gfmd["cutoff_ratio"]), rtol=1e-3):
        return {}
    points = gfmd["citation"] + " " + gfmd["description"]
    return {
        f"gfmd_{name}": _make_variable("gfmd_point", np.array(gfmd[name]), f"{long_name}, GFMD", points)
        for name, long_name in (
            ("reduced_pressure", _PRESSURE),
            ("area_fraction", _AREA),
            ("area_scatter", f"standard deviation over realisations of the {_AREA}"),
        )
    }
