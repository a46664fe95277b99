"""Theory curves and published points as one dataset, for the figures of one surface."""

import json
from collections.abc import Mapping
from importlib.resources import files

import numpy as np
import xarray as xr

from icha.asperity.material import Material
from icha.datasets.attributes import THEORY, file_attributes
from icha.datasets.build import describe_variables
from icha.datasets.variables.theories import THEORIES
from icha.references import persson, summit_theories
from icha.surfaces.moments import SpectralMoments
from icha.surfaces.spectrum import SelfAffineSpectrum

REDUCED_PRESSURES = np.geomspace(1e-5, 3.0, 111)
SUMMIT_AREAS = np.geomspace(1e-5, summit_theories.SEPARATE_SUMMITS_AREA_LIMIT, 81)


def literature(name: str) -> dict:
    """Return one data set of `literature.json`: published numbers with title, description, citation, DOIs and units.

    The names are `gfmd_area`, `gfmd_gap`, `area_slope` and `contact_mechanics_challenge`. All lists of a data set have
    one number for each published point.
    """
    return json.loads(files("icha.references").joinpath("literature.json").read_text(encoding="utf-8"))[name]


def reference_dataset(
    spectrum: SelfAffineSpectrum | None = None,
    moments: SpectralMoments | None = None,
    adhesive: Mapping[tuple[float, str], Material] = {},
    *,
    attrs: Mapping[str, str] = {},
) -> xr.Dataset:
    """Return a dataset of theory curves for a surface, and of published points for surfaces with the same spectrum.

    Parameters
    ----------
    spectrum : spectrum of the surface, or None. Without a spectrum, Persson's theory gives only the area.
    moments : spectral moments of the surface at any rms slope; if None, theories of separate summits are left out.
    adhesive : materials with adhesion, by rms slope and name; each material has a curve of Fuller & Tabor.
    attrs : additional global attributes.

    Returns
    -------
    Dataset with Persson's theory along the dimension `reduced_pressure`. The theory of Bush, Gibson & Thomas has the
    dimension `linear_point`. The theories of Greenwood & Williamson and of Fuller & Tabor have the dimension
    `summit_point`, at the areas `summit_area_fraction`. Published points have the dimension `gfmd_point`.
    """
    values = _mean_field_theories(spectrum) | _published_points(spectrum)
    if moments is not None:
        values |= _summit_theories(moments, adhesive)
    variables = describe_variables(_TABLE, values)
    described = file_attributes(
        "Theories of rough contact, and published points",
        "Contact area, mean separation and contact stiffness against reduced pressure.",
        THEORY,
        references="; ".join(
            dict.fromkeys(v.attrs["references"] for v in variables.values() if "references" in v.attrs)
        ),
    )
    return xr.Dataset(variables, attrs=described | dict(attrs))


def _sources():
    """Return the publications of all variables that are theories or published points, by variable name."""
    points, separation = literature("gfmd_area"), ("reduced_pressure", "reduced_separation")
    return {
        "persson_area_fraction": persson.PERSSON,
        "xu_area_fraction": persson.XU,
        **dict.fromkeys(("persson_reduced_separation", "persson_reduced_stiffness"), persson.YANG_PERSSON),
        "bush_gibson_thomas_area_fraction": summit_theories.BUSH_GIBSON_THOMAS,
        **dict.fromkeys((f"gfmd_{name}" for name in _GFMD), f"{points['citation']} {points['description']}"),
        **{f"greenwood_williamson_{name}": summit_theories.GREENWOOD_WILLIAMSON for name in separation},
        **{f"fuller_tabor_{name}": summit_theories.FULLER_TABOR for name in separation},
    }


_GFMD = ("reduced_pressure", "area_fraction", "area_scatter")
_TABLE = THEORIES | {
    name: THEORIES[name]._replace(further={"references": source}) for name, source in _sources().items()
}


def _mean_field_theories(spectrum):
    """Return the theories of Persson and of Bush, Gibson & Thomas, by variable name."""
    pressure = REDUCED_PRESSURES
    area = summit_theories.bush_gibson_thomas_area(pressure)
    separate = area <= summit_theories.SEPARATE_SUMMITS_AREA_LIMIT
    values = {
        "reduced_pressure": pressure,
        "persson_area_fraction": persson.persson_area(pressure),
        "xu_area_fraction": persson.corrected_persson_area(pressure),
        "linear_pressure": pressure[separate],
        "bush_gibson_thomas_area_fraction": area[separate],
    }
    if spectrum is not None:
        values["persson_reduced_separation"] = persson.persson_mean_separation(pressure, spectrum)
        values["persson_reduced_stiffness"] = persson.persson_stiffness(pressure, spectrum)
    return values


def _summit_theories(moments, adhesive):
    """Return the theories of Greenwood & Williamson and of Fuller & Tabor, by variable name."""
    separation = summit_theories.separation_at(summit_theories.greenwood_williamson_area, SUMMIT_AREAS, moments)
    values = {
        "nayak_parameter": moments.nayak_parameter,
        "summit_area_fraction": SUMMIT_AREAS,
        "greenwood_williamson_reduced_pressure": summit_theories.greenwood_williamson_pressure(separation, moments),
        "greenwood_williamson_reduced_separation": separation,
    }
    if not adhesive:
        return values
    pressures, separations = [], []
    for (rms_slope, _), material in adhesive.items():
        scaled = moments.scaled_to_rms_slope(rms_slope)
        separation = summit_theories.separation_at(summit_theories.fuller_tabor_area, SUMMIT_AREAS, scaled, material)
        pressures.append(summit_theories.fuller_tabor_pressure(separation, scaled, material))
        separations.append(separation)
    slopes, names = zip(*adhesive, strict=True)
    return values | {
        "fuller_tabor_rms_slope": slopes,
        "fuller_tabor_material": names,
        "fuller_tabor_reduced_pressure": pressures,
        "fuller_tabor_reduced_separation": separations,
    }


def _published_points(spectrum):
    """Return published points from Green's function molecular dynamics for a spectrum, by variable name; {} if none."""
    gfmd = literature("gfmd_area")
    if spectrum is None:
        return {}
    ratios = (spectrum.rolloff_wavelength / spectrum.period, spectrum.period / spectrum.short_wavelength)
    if not np.allclose((spectrum.hurst, *ratios), (gfmd["hurst"], 1.0, gfmd["cutoff_ratio"]), rtol=1e-3):
        return {}
    return {f"gfmd_{name}": gfmd[name] for name in _GFMD}
