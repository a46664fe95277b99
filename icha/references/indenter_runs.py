"""Values of a run with a free square as experiments have them: force, indentation, radii, and works of adhesion."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.asperity.material import Material
from icha.asperity.tabor import SHORT_RANGE_FROM
from icha.references.indentation import pull_off_state
from icha.references.jkr_fits import fit_work_of_adhesion
from icha.surfaces.surface import Surface

if TYPE_CHECKING:
    import xarray as xr

# A fit uses at most one state in each of this number of equal intervals of the indentation. Paths have many states near
# jumps, which would otherwise have too much weight.
INTERVALS = 100
# Smallest number of states for a fit.
_LEAST_STATES = 3
# Contact radius below which an edge that has stood recedes, divided by the radius where it stood.
_RECEDED = 0.97


class NoFit(ValueError):
    """States have no work of adhesion by JKR; the message gives the reason in a few words."""


def step_values(row: Mapping[str, float], area: float) -> dict[str, float]:
    """Return the values of a step as experiments have them, by variable name.

    row : nominal pressure, separation, area fraction and stiffness of the step. area : nominal area A0, m^2.
    """
    return {
        "force": row["nominal_pressure"] * area,
        "indentation": -row["mean_separation"],
        "contact_radius": math.sqrt(row["contact_area_fraction"] * area / math.pi),
        "stiffness": row["contact_stiffness"] * area,
    }


def loop_values(
    rows: Sequence[Mapping[str, float]], loop: Mapping[str, float], surface: Surface, material: Material
) -> dict[str, float]:
    """Return the values of a loop that ends without contact, by variable name; without adhesion only the force.

    Ratios to theories (`icha.references.indentation.pull_off_state`), and fits of JKR, exist only on a half-space. Fits
    need a shape with a radius, and states for which `apparent_work_of_adhesion` finds a fit.

    Parameters
    ----------
    rows : values of all steps, from `step_values`, with `leg`.
    loop : values of `icha.path.energy_balance.summarise_loop`.
    """
    area, energy = surface.period**2, material.surface_energy
    pull_off = loop["pull_off_pressure"] * area
    values = {"pull_off_force": pull_off}
    if not energy:
        return values
    if largest := loop["largest_contact_area_fraction"]:
        values["loss_over_contact"] = loop["hysteresis_loss"] / (energy * largest)
    radius = sphere_radius(surface)
    if surface.shape is None or material.layered:
        return values
    energy = material.receding.surface_energy
    if known := pull_off_state(surface.shape, material.contact_modulus, energy):
        values["pull_off_force_over_theory"] = pull_off / -float(known.force)
    if radius is None:
        return values
    values["pull_off_force_over_jkr"] = pull_off / (1.5 * math.pi * energy * radius)
    for branch, select_states in BRANCHES.items():
        with contextlib.suppress(NoFit):
            work = apparent_work_of_adhesion(select_states(rows), radius, material)
            values[f"work_of_adhesion_{branch}"] = work
    return values


def sphere_radius(surface: Surface) -> float | None:
    """Return the radius of the sphere with which contact of a surface is compared, m; None without such a sphere."""
    return getattr(surface.shape, "sphere_radius", None)


def first_approach(rows: Sequence[Mapping[str, float]]) -> list[Mapping[str, float]]:
    """Return the steps of the first loading that have contact, without those that go back to a target inside a jump."""
    touching = [row for row in rows if row["leg"] == 0 and row["contact_radius"] > 0]
    deepest = itertools.accumulate((row["indentation"] for row in touching), max)
    return [row for row, depth in zip(touching, deepest, strict=True) if row["indentation"] == depth]


def last_retraction(rows: Sequence[Mapping[str, float]]) -> list[Mapping[str, float]]:
    """Return the steps of the last unloading that have contact, up to the largest tension.

    With works of adhesion by direction, steps where the edge still stands are left out.
    """
    last = [row for row in rows if row["leg"] == rows[-1]["leg"]]
    end = int(np.argmin([row["force"] for row in last])) + 1
    most = _RECEDED * last[0]["contact_radius"] if last[-1]["dissipated_by_front"] else math.inf
    return [row for row in last[:end] if 0 < row["contact_radius"] < most]


# For each branch of a loop, the function that selects the steps for its fit.
BRANCHES = {"approach": first_approach, "retraction": last_retraction}


def apparent_work_of_adhesion(states: Sequence[Mapping[str, float]], radius: float, material: Material) -> float:
    """Return the work of adhesion of the JKR sphere that fits the contact radii of some states at their forces, J/m^2.

    Parameters
    ----------
    states : values of the states, from `step_values`.
    radius : radius of the sphere, m.
    material : material with adhesion; the fit has its contact modulus.

    Raises
    ------
    NoFit
        If the Tabor parameter of the sphere is too small for JKR, if there are too few states at different
        indentations, or if Hertz's law fits best.
    """
    if (tabor := float(material.tabor_parameter(radius))) < SHORT_RANGE_FROM:
        raise NoFit(f"Tabor parameter {tabor:.2g} below {SHORT_RANGE_FROM:g}")
    chosen = spaced_states([row["indentation"] for row in states])
    if len(chosen) < _LEAST_STATES:
        raise NoFit(f"fewer than {_LEAST_STATES} states")
    force, contact_radius = (np.array([states[k][name] for k in chosen]) for name in ("force", "contact_radius"))
    work = fit_work_of_adhesion(force, contact_radius, radius, material.contact_modulus)
    if not work:
        raise NoFit("Hertz fits better")
    return work


def reason_without_fit(run: xr.Dataset, branch: str) -> str:
    """Return why a run on a sphere with adhesion has no fit of JKR to a branch of `BRANCHES`; "" with a fit."""
    if f"work_of_adhesion_{branch}" in run:
        return ""
    if "pull_off_force_over_jkr" not in run:
        return "not pulled off"
    material = Material(*(float(run[name]) for name in ("contact_modulus", "surface_energy", "interaction_range")))
    try:
        apparent_work_of_adhesion(BRANCHES[branch](steps_of(run)), float(run["shape_radius"]), material)
    except NoFit as reason:
        return str(reason)
    return ""


def steps_of(run: xr.Dataset) -> list[dict[str, float]]:
    """Return force, indentation, contact radius, leg and dissipation by fronts of every step of a run."""
    names = "force", "indentation", "contact_radius", "leg", "dissipated_by_front"
    rows = zip(*(run[name].values.tolist() for name in names), strict=True)
    return [dict(zip(names, row, strict=True)) for row in rows]


def spaced_states(indentation: Sequence[float]) -> np.ndarray:
    """Return the indices of the first state in each of `INTERVALS` equal intervals of the indentation, ascending."""
    if len(indentation) == 0:
        return np.zeros(0, int)
    values = np.asarray(indentation, float)
    width = np.ptp(values) / INTERVALS or 1.0
    _, first = np.unique(np.floor((values - values.min()) / width), return_index=True)
    return np.sort(first)
