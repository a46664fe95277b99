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
    """Return published numbers: one entry of `literature.json`, with title, description, citation, DOIs and units.

    Entries are `gfmd_area`, `gfmd_gap`, `area_slope` and `contact_mechanics_challenge`. The lists of an entry have the
    same points.
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
    """Theories of a surface, and published points of surfaces of its kind.

    Parameters
    ----------
    spectrum : of the surface; without one, as of a measured surface, Persson's theory gives the area only.
    moments : of the surface at any rms slope; without them there are no theories of separate summits.
    adhesive : materials with adhesion, by rms slope and name; each has a curve of Fuller & Tabor.
    reduced_pressures : p/(E* h'_rms), increasing and positive.
    attrs : further global attributes.

    Returns
    -------
    Dataset with Persson's theory along `reduced_pressure`; that of Bush, Gibson & Thomas along `linear_point`; those of
    Greenwood & Williamson and of Fuller & Tabor along `summit_point`, at the areas `summit_area_fraction`; and, for a
    surface of the same spectrum, published points along `gfmd_point`.
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

_PERSSON = "B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840, doi:10.1063/1.1388626"
_XU = "Y. Xu, L. Zhu, F. Xiao and Y. Zhou, Tribol. Lett. 72 (2024), doi:10.1007/s11249-024-01838-4, gamma = 0.45"
_YANG = "C. Yang and B. N. J. Persson, J. Phys.: Condens. Matter 20 (2008) 215214, gamma = 0.45"
_BUSH = "A. W. Bush, R. D. Gibson and T. R. Thomas, Wear 35 (1975) 87, doi:10.1016/0043-1648(75)90145-3"
_GREENWOOD = (
    "J. A. Greenwood and J. B. P. Williamson, Proc. R. Soc. Lond. A 295 (1966) 300, doi:10.1098/rspa.1966.0242; "
    "J. I. McCool, Wear 107 (1986) 37, doi:10.1016/0043-1648(86)90045-1"
)
_FULLER = (
    "K. N. G. Fuller and D. Tabor, Proc. R. Soc. Lond. A 345 (1975) 327, doi:10.1098/rspa.1975.0138, on loading: "
    "summits are in contact from approach 0 on"
)


def _variable(dim, values, long_name, source=""):
    described = {"units": "1", "long_name": long_name}
    return xr.Variable(dim, values, described | ({"references": source} if source else {}))


def _mean_field_theories(pressure, spectrum):
    dim = "reduced_pressure"
    variables = {
        dim: _variable(dim, pressure, _PRESSURE),
        "persson_area_fraction": _variable(dim, persson.persson_area(pressure), f"{_AREA}, Persson", _PERSSON),
        "xu_area_fraction": _variable(
            dim, persson.corrected_persson_area(pressure), f"{_AREA}, Persson corrected by Xu and others", _XU
        ),
    }
    if spectrum is not None:
        separation = persson.persson_mean_separation(pressure, spectrum)
        stiffness = persson.persson_stiffness(pressure, spectrum)
        long_name = "contact stiffness times rms height over contact modulus and rms slope, Yang and Persson"
        variables |= {
            "persson_reduced_separation": _variable(dim, separation, f"{_SEPARATION}, Yang and Persson", _YANG),
            "persson_reduced_stiffness": _variable(dim, stiffness, long_name, _YANG),
        }
    linear = pressure[summit_theories.bush_gibson_thomas_area(pressure) <= summit_theories.SEPARATE_SUMMITS_AREA_LIMIT]
    area, long_name = summit_theories.bush_gibson_thomas_area(linear), f"{_AREA}, Bush, Gibson and Thomas"
    return variables | {
        "linear_pressure": _variable("linear_point", linear, _PRESSURE),
        "bush_gibson_thomas_area_fraction": _variable("linear_point", area, long_name, _BUSH),
    }


def _summit_theories(moments, adhesive):
    dim, by = "summit_point", "Greenwood and Williamson"
    separation = summit_theories.separation_at(summit_theories.greenwood_williamson_area, SUMMIT_AREAS, moments)
    pressure = summit_theories.greenwood_williamson_pressure(separation, moments)
    variables = {
        "nayak_parameter": _variable((), moments.nayak_parameter, _NAYAK),
        "summit_area_fraction": _variable(dim, SUMMIT_AREAS, f"{_AREA}, at which separate summits are evaluated"),
        "greenwood_williamson_reduced_pressure": _variable(dim, pressure, f"{_PRESSURE}, {by}", _GREENWOOD),
        "greenwood_williamson_reduced_separation": _variable(dim, separation, f"{_SEPARATION}, {by}", _GREENWOOD),
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
        "fuller_tabor_rms_slope": _variable(curve, np.array(slopes, float), "root mean square slope of the surface"),
        "fuller_tabor_material": _variable(curve, np.array(names, dtype=object), "name of the material"),
        "fuller_tabor_reduced_pressure": _variable((curve, dim), pressures, f"{_PRESSURE}, {by}", _FULLER),
        "fuller_tabor_reduced_separation": _variable((curve, dim), separations, f"{_SEPARATION}, {by}", _FULLER),
    }


def _published_points(spectrum):
    """Points by Green's function molecular dynamics, if they are of surfaces of this spectrum."""
    gfmd = literature("gfmd_area")
    if spectrum is None:
        return {}
    ratios = (spectrum.rolloff_wavelength / spectrum.period, spectrum.period / spectrum.short_wavelength)
    if not np.allclose((spectrum.hurst, *ratios), (gfmd["hurst"], 1.0, gfmd["cutoff_ratio"]), rtol=1e-3):
        return {}
    points = gfmd["citation"] + " " + gfmd["description"]
    return {
        f"gfmd_{name}": _variable("gfmd_point", np.array(gfmd[name]), f"{long_name}, GFMD", points)
        for name, long_name in (
            ("reduced_pressure", _PRESSURE),
            ("area_fraction", _AREA),
            ("area_scatter", f"standard deviation over realisations of the {_AREA}"),
        )
    }
