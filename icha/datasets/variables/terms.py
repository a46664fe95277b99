"""Descriptions of variables, and the terms that several kinds of files have in common."""

from collections.abc import Mapping
from typing import Any, NamedTuple


class Variable(NamedTuple):
    """Description of a variable.

    dims : names of its dimensions. units : as CF has them, "1" where there are none. dtype : of numpy; `str` of texts.
    further : attributes besides units and long name. coordinate : whether it is one of CF's coordinates.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: type = float
    further: Mapping[str, Any] = {}
    coordinate: bool = False

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the variable in a file."""
        return {"units": self.units, "long_name": self.long_name, **self.further}


# Attribute of a variable that may be infinite (inf, a value as any other); it says where.
INFINITE = "infinite"

Table = dict[str, Variable]

# What has the same meaning in several kinds of files, whatever its dimensions there.
_TERMS = {
    "reduced_pressure": Variable((), "1", "nominal pressure over contact modulus and rms slope, p/(E* h'rms)"),
    "relative_load": Variable((), "1", "nominal pressure over contact modulus, F/(E* A0)"),
    "reduced_separation": Variable((), "1", "mean separation over rms height"),
    "contact_area_fraction": Variable((), "1", "real over nominal contact area, A/A0"),
    "pressure_bin_mean": Variable((), "Pa", "mean pressure of the area in the bin, 0 where empty"),
    "contact_modulus": Variable((), "Pa", "composite contact modulus E*"),
    "surface_energy": Variable((), "J m^-2", "energy of adhesion per area"),
    "interaction_range": Variable((), "m", "range of the attractive forces"),
    "rms_slope": Variable((), "1", "root mean square slope |grad h| from the spectrum"),
    "rms_height": Variable((), "m", "root mean square height"),
    "rms_curvature": Variable((), "m^-1", "root mean square curvature of a profile, from the spectrum"),
    "nayak_parameter": Variable((), "1", "Nayak's parameter m0 m4/m2^2: breadth of the spectrum"),
    "tabor_parameter": Variable((), "1", "Tabor parameter with the radius 1/rms_curvature"),
    "period": Variable((), "m", "side of the periodic cell"),
    "seed": Variable((), "1", "seed of the surface; -1 where it has none", int),
    "grid": Variable((), "1", "nodes along a side", int),
    "spacing": Variable((), "m", "distance between nodes"),
    "strength_number": Variable((), "1", "sqrt(dgamma dx/E*)/range; 0 without adhesion"),
    "longest_spacing": Variable((), "m", "widest spacing that resolves the cohesive zone; 0 without adhesion"),
    "x": Variable(("x",), "m", "x of the nodes", coordinate=True),
    "y": Variable(("y",), "m", "y of the nodes", coordinate=True),
}
MATERIAL = ("contact_modulus", "surface_energy", "interaction_range")
ROUGHNESS = ("rms_slope", "rms_height", "rms_curvature")


def term(name: str) -> Variable:
    """Description of a term that several kinds of files have in common."""
    return _TERMS[name]


def terms(*names: str, along: tuple[str, ...] | None = None) -> Table:
    """Such terms as part of a table, along given dimensions."""
    return {name: _TERMS[name] if along is None else _TERMS[name]._replace(dims=along) for name in names}
