"""Checks of the arguments of `icha.simulate`."""

from collections.abc import Iterator

import numpy as np

from icha.asperity.material import Material
from icha.path.targets import (
    ASPERITY_RANGES,
    CONTACT_RADIUS,
    FORCE,
    INDENTATION,
    LEAST_PRESSURE,
    MAX_AREA_FRACTION,
    MAX_REDUCED_PRESSURE,
    MEAN_SEPARATION,
    NOMINAL_PRESSURE,
    RELATIVE_LOAD,
    UNITS,
    WITHOUT_ADHESION,
    Path,
)
from icha.support.usual import unusual_arguments
from icha.surfaces.surface import Surface

# Largest mean separation of a snapshot, in h_rms. Contact forms at much smaller separations.
_HIGHEST_SNAPSHOT = 20.0


def describe_unusual(surface: Surface, material: Material) -> Iterator[str]:
    """Yield a message for each property of a surface or a material that is outside its usual range."""
    slope = {} if surface.smooth else {"rms_slope": surface.rms_slope}
    shape = vars(surface.shape) if surface.shape else {}
    # Without adhesion, the range of attraction has no effect.
    unused = () if material.surface_energy else ("interaction_range",)
    given = vars(material) | shape | {"period": surface.period} | slope
    return unusual_arguments({name: value for name, value in given.items() if name not in unused})


def check_arguments(surface, material, path, by_summits):
    """Raise `ValueError` for arguments of the wrong type, and for targets out of range on this surface.

    by_summits : True if summits represent the surface in the model, so that loads and areas are limited.
    """
    for name, value, kind in (("surface", surface, Surface), ("material", material, Material), ("path", path, Path)):
        if not isinstance(value, kind):
            raise ValueError(f"{name}: expected an icha.{kind.__name__}, got a {type(value).__name__}")
    # Loading may end early at the limit of the asperity model, but the first target must be within the limit.
    limited = (path.targets[0], *path.turning_points) if by_summits else ()
    for target in (*path.targets, *path.turning_points, *path.unloading_snapshots):
        if target in limited and target.kind in ASPERITY_RANGES and target.value > 0:
            ASPERITY_RANGES[target.kind].validate(f"path: {target.kind}", target.value)
        _check_target(surface, material, target, by_summits, target in limited)
        if target.needs_adhesion and not material.surface_energy and (target.value < 0 or target in path.targets):
            raise ValueError(f"path: {target.describe()} {WITHOUT_ADHESION}")


def pressure_units(surface: Surface, material: Material) -> dict[str, float]:
    """Return the load at a reduced pressure of 1, for each kind of load, in its SI unit."""
    unit = material.contact_modulus * surface.unit_slope
    return {RELATIVE_LOAD: surface.unit_slope, NOMINAL_PRESSURE: unit, FORCE: unit * surface.period**2}


def _check_target(surface, material, target, by_summits, limited):
    """Raise `ValueError` for a load that is too small or too large, a large radius, or a snapshot far above contact."""
    place = f"path: {target.snapshot_kind} = {target.value!r} {UNITS.get(target.kind, '')}".rstrip()
    units = pressure_units(surface, material)
    if target.kind in units:
        pressure, load = target.value / units[target.kind], f"{place} on a surface of rms slope"
        if 0 < abs(pressure) < LEAST_PRESSURE:
            raise ValueError(
                f"{load} {surface.unit_slope:.4g} is too small; expected a reduced pressure of at least "
                f"{LEAST_PRESSURE} in absolute value, or 0 at a turning point that ends unloading"
            )
        if limited and pressure > MAX_REDUCED_PRESSURE:
            raise ValueError(
                f"{load} {surface.unit_slope:.4g} is beyond the range of the asperity model; expected a reduced "
                f"pressure of at most {MAX_REDUCED_PRESSURE}"
            )
    largest = (MAX_AREA_FRACTION if by_summits else 1.0) * surface.period**2
    if target.kind == CONTACT_RADIUS and np.pi * target.value**2 > largest:
        expected = f"expected at most {np.sqrt(largest / np.pi):.4g} m"
        model = ", the limit of the asperity model" if by_summits else ""
        raise ValueError(f"{place} is too large on a square of side {surface.period:.4g} m; {expected}{model}")
    separation = {MEAN_SEPARATION: target.value, INDENTATION: -target.value}.get(target.kind, 0.0)
    highest = _HIGHEST_SNAPSHOT * surface.unit_height
    if target.snapshot and separation > highest:
        raise ValueError(
            f"path: a snapshot at a mean separation of {separation!r} m is far above any contact; expected at "
            f"most {_HIGHEST_SNAPSHOT:g} rms heights ({highest:.4g} m)"
        )
