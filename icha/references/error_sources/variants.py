"""All variants between the model and boundary elements, solved for one surface."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.datasets.attributes import BOUNDARY_ELEMENTS, COMPUTED, discovery
from icha.datasets.build import build, of
from icha.datasets.variables.error_sources import ERROR_SOURCES
from icha.datasets.variables.terms import MATERIAL, ROUGHNESS
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.equilibrium.states import ContactState
from icha.path.follow import follow
from icha.path.targets import Path
from icha.references.error_sources.chain import BESIDE, CATEGORIES, CHAIN
from icha.references.error_sources.paraboloids import (
    circular_curvatures,
    fourth_order_terms,
    paraboloids,
    summit_curvatures,
)
from icha.references.error_sources.spot_by_spot import split
from icha.references.error_sources.without_unions import Discs, discs_apart, independent_discs, union_area_fraction
from icha.references.finite_range import (
    DEFAULT_TOLERANCE,
    REFERENCES,
    NodalState,
    contact_state,
    perimeter_correction,
)
from icha.support.rules import REFINEMENT, Integer
from icha.surfaces.summits import find_summits
from icha.surfaces.surface import Surface


class State(NamedTuple):
    """Contact area fraction, and mean separation in m."""

    area: float
    separation: float


def error_sources(
    surface: Surface,
    material: Material,
    reduced_pressures,
    *,
    refinement: int = 2,
    tolerance: float = DEFAULT_TOLERANCE,
    seed: int = -1,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Solve all variants for one surface, and split the model's error spot by spot.

    Parameters
    ----------
    surface, material : as for `icha.simulate`; a range of attraction must be resolved on the coarser grid, too.
    reduced_pressures : p/(E* h'_rms) with the rms slope of the surface itself, increasing, (n,).
    refinement : boundary elements per cell of the surface's grid along a side, even, so that half of it can be tried.
    tolerance : of the boundary elements.
    seed : recorded in the dataset.
    progress : called with a line of text for every variant.

    Returns
    -------
    xarray.Dataset (`icha.datasets.variables.error_sources`): areas and separations along (variant, reduced_pressure).
    Without adhesion also the split along (category, reduced_pressure), whose sums are the total areas and loads of
    `icha` and `boundary_elements`, and along `pair` every single spot and its patch.

    Raises
    ------
    ValueError
        If an argument is out of range.
    icha.references.failures.NotSolved, icha.contact.failures.NotConverged
        If a variant was not solved.
    """
    surface.require_periodic("the comparison with boundary elements")
    path = Path(reduced_pressures=reduced_pressures)
    pressures = [target.value for target in path.targets]
    if Integer(2, REFINEMENT.most).checked("refinement", refinement) % 2:
        raise ValueError(f"refinement: {refinement!r} must be even")
    full = {"refinement": refinement, "tolerance": tolerance}
    half = {"refinement": refinement // 2, "tolerance": tolerance}
    states, parts = {}, None

    def keep(name, solved):
        states[name] = list(solved)
        if progress is not None:
            progress(f"{name}: A/A0 = {', '.join(f'{state.area:.4e}' for state in states[name])}")

    # One thread for linear algebra: the order of sums, and with it every bit, is then the same everywhere.
    with threadpool_limits(1):
        contact, model = _model(surface, material, path)
        keep("icha", (_state_of_model(contact, state) for state in model))
        fine_contact, fine_model = _model(surface.refined(2), material, path)
        keep("icha_fine_grid", (_state_of_model(fine_contact, state) for state in fine_model))
        if not contact.adhesive:
            for name, discs in _without_unions(contact, surface, pressures):
                keep(name, (_state_of_discs(one, surface) for one in discs))
        for name, curvatures in _curvatures(surface, contact.asperities):
            heights = paraboloids(contact.asperities, curvatures, refinement * surface.grid)
            keep(name, (_solve_paraboloids(heights, surface, material, p, tolerance) for p in pressures))
        coarse = (contact_state(surface, material, p, **half) for p in pressures)
        keep("boundary_elements_coarse", map(_state_at_nodes, coarse))
        solved = [contact_state(surface, material, p, **full) for p in pressures]
        keep("boundary_elements", map(_state_at_nodes, solved))
        if not contact.adhesive:
            fourth = fourth_order_terms(surface, contact.asperities)
            parts = [split(contact, state, truth, fourth) for state, truth in zip(model, solved, strict=True)]
    return _dataset(surface, material, pressures, states, parts, seed, full)


def _model(surface, material, path):
    """The contact problem, and the model's states at the stops of the path."""
    contact = InteractingAsperities(JKR(material), find_summits(surface), surface.rms_height)
    unit = material.contact_modulus * surface.rms_slope
    met = {waypoint.target: waypoint.state for waypoint in follow(contact, path, unit)}
    return contact, [met[target] for target in path.targets]


def _without_unions(contact, surface, reduced_pressures):
    """Names of the variants without unions and adhesion, and their discs at every pressure."""
    law, summits = contact.law, contact.asperities
    loads = [p * contact.contact_modulus * surface.rms_slope for p in reduced_pressures]
    yield "independent", (independent_discs(summits, law, p) for p in loads)
    for name, switch in (
        ("point_forces", {"point_forces": True}),
        ("without_unions", {}),
        ("field_shape", {"field_shape": True}),
    ):
        yield name, [discs_apart(summits, law, p, surface.rms_height, **switch) for p in loads]


def _curvatures(surface, summits):
    """Names of the variants on paraboloids, and the curvatures of theirs."""
    yield "circular_paraboloids", circular_curvatures(summits)
    yield "elliptic_paraboloids", summit_curvatures(surface, summits)


def _state_of_model(contact: InteractingAsperities, state: ContactState) -> State:
    return State(contact.area_fraction(state), state.separation)


def _state_of_discs(discs: Discs, surface: Surface) -> State:
    return State(union_area_fraction(discs, surface), discs.separation)


def _state_at_nodes(state: NodalState) -> State:
    return State(perimeter_correction(state.contact)[0], state.mean_separation)


def _solve_paraboloids(heights, surface, material, reduced_pressure, tolerance):
    """The same load on another surface; its separation is measured from the mean plane of the true one."""
    other = Surface(heights, surface.period)
    reduced_pressure = reduced_pressure * surface.rms_slope / other.rms_slope
    state = _state_at_nodes(contact_state(other, material, reduced_pressure, tolerance=tolerance))
    return state._replace(separation=state.separation + float(np.mean(heights)))


def _dataset(surface, material, pressures, states, parts, seed, solver):
    order = [name for name in (*CHAIN, *BESIDE) if name in states]
    area = np.array([[state.area for state in states[name]] for name in order])
    separation = np.array([[state.separation for state in states[name]] for name in order])
    values = {
        "variant": order,
        "reduced_pressure": pressures,
        "contact_area_fraction": area,
        "mean_separation": separation,
        "reduced_separation": separation / surface.rms_height,
        **of(material, *MATERIAL),
        **of(surface, *ROUGHNESS, "period"),
        "grid": surface.grid,
        "seed": seed,
        **solver,
    }
    if parts is not None:
        values["category"] = list(CATEGORIES)
        values["pair_reduced_pressure"] = np.repeat(pressures, [len(part["pair_spot_area"]) for part in parts])
        for name in parts[0]:
            of_states = [part[name] for part in parts]
            along_pairs = ERROR_SOURCES[name].dims == ("pair",)
            values[name] = np.concatenate(of_states) if along_pairs else np.array(of_states).T
    adhesion = "with" if material.surface_energy > 0 else "without"
    attrs = discovery(
        f"Sources of the error of the ICHA model {adhesion} adhesion",
        "One surface solved by the model, by boundary elements and by variants between the two.",
        COMPUTED,
        programs=("icha", "tamaas"),
        references=REFERENCES,
        keywords=[BOUNDARY_ELEMENTS],
    )
    return build(ERROR_SOURCES, values, attrs)
