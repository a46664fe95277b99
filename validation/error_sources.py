"""Find the causes of the model's error: change one thing at a time between the model and boundary elements.

Boundary elements can solve, instead of the topography, the surface that the model assumes. So a chain of variants leads
from the model to boundary elements, each of which changes one thing:

    icha                      the model;
    without_unions            overlapping spots do not unite; their area is that of the union of the discs;
    field_shape               in addition the displacement w by other spots has a slope and a curvature across a spot:
                              the summit is raised by R |grad w|^2/2 and sharpened to 1/R + laplacian(w)/2;
    circular_paraboloids      boundary elements on the upper envelope of the paraboloids z - r^2/(2R) of all summits;
    elliptic_paraboloids      the same with both principal curvatures, of which 1/R is the geometric mean;
    boundary_elements         boundary elements on the topography.

The last step changes the shape of the summits beyond their paraboloids. Three more variants are compared:

    independent               Hertz's summits without interaction;
    icha_fine_grid            the model on a grid twice as fine;
    boundary_elements_coarse  boundary elements on a grid half as fine.

Single patches show the shape of a summit beyond its paraboloid. On the profile r^2/(2R) - b r^4 a contact of radius a
carries F = 4 E* a^3/(3R) (1 - 16/5 b R a^2) (I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47-57,
doi:10.1016/0020-7225(65)90019-4). Here b is the bi-Laplacian of the heights at the summit over 64.

`python -m validation.error_sources` solves the middle of campaign validation in half an hour, saves the solutions in
results/error_sources, and writes the tables and the figure of docs/error_sources.md.
"""

import itertools
from pathlib import Path as FilePath
from typing import NamedTuple

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.boundary_elements.contact import contact_of
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.path.follow import follow
from icha.path.targets import Path
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.summits import find_summits
from icha.surfaces.surface import Surface
from validation.paraboloids import circular_curvatures, paraboloids, summit_curvatures
from validation.spot_by_spot import compare_single_spots, contact_patches
from validation.without_unions import discs_apart, independent_discs, union_area_fraction

# Variants from the model to boundary elements, with the change of each step. With adhesion the model is not solved
# without unions.
CHAIN = {
    "icha": "",
    "without_unions": "unions",
    "field_shape": "slope and curvature of the others' field",
    "circular_paraboloids": "rest of the contact mechanics",
    "elliptic_paraboloids": "ellipticity of the summits",
    "boundary_elements": "shape beyond the paraboloid",
}
ADHESIVE_CHAIN = {
    "icha": "",
    "circular_paraboloids": "contact mechanics and unions",
    "elliptic_paraboloids": "ellipticity of the summits",
    "boundary_elements": "shape beyond the paraboloid",
}


# Boundary elements per cell of the grid of the surface, along a side; even, because half of it is solved as well.
_REFINEMENT = 2


class State(NamedTuple):
    """Contact area fraction, and mean separation in m."""

    area: float
    separation: float


def error_sources(surface: Surface, material: Material, reduced_pressures) -> xr.Dataset:
    """Solve all variants for one surface; without adhesion also compare single spots with their patches.

    Parameters
    ----------
    surface, material : as for `icha.simulate`; the surface's own grid must resolve the range of attraction.
    reduced_pressures : p/(E* h'_rms) with the rms slope of the surface itself, increasing, (n,).

    Returns
    -------
    xarray.Dataset: areas and separations along (variant, reduced_pressure). Without adhesion also every single spot and
    its patch along `pair`.
    """
    path = Path(reduced_pressures=reduced_pressures)
    pressures = [target.value for target in path.targets]
    states, singles = {}, None

    def keep(name, solved):
        states[name] = list(solved)
        print(f"{name}: A/A0 = {', '.join(f'{state.area:.4e}' for state in states[name])}", flush=True)

    # One thread for linear algebra, so that the order of sums, and every bit, does not depend on the machine.
    with threadpool_limits(1):
        contact, model = _model(surface, material, path)
        keep("icha", _results(contact, model))
        keep("icha_fine_grid", _results(*_model(surface.refined(2), material, path)))
        if not contact.adhesive:
            for name, discs in _without_unions(contact, surface, pressures):
                keep(name, (State(union_area_fraction(one, surface), one.separation) for one in discs))
        for name, curvatures in (
            ("circular_paraboloids", circular_curvatures(contact.asperities)),
            ("elliptic_paraboloids", summit_curvatures(surface, contact.asperities)),
        ):
            heights = paraboloids(contact.asperities, curvatures, _REFINEMENT * surface.grid)
            keep(name, _solve_paraboloids(heights, surface, material, pressures))
        keep(
            "boundary_elements_coarse", _results(*_boundary_elements(surface.refined(_REFINEMENT // 2), material, path))
        )
        fine = surface.refined(_REFINEMENT)
        elements, truth = _boundary_elements(fine, material, path)
        keep("boundary_elements", _results(elements, truth))
        if not contact.adhesive:
            singles = [
                compare_single_spots(contact, state, fine, contact_patches(elements, true))
                for state, true in zip(model, truth, strict=True)
            ]
    return _dataset(surface, material, pressures, states, singles)


def _model(surface, material, path):
    """Return the contact problem and the states of the model at the targets of the path."""
    contact = InteractingAsperities(JKR(material), find_summits(surface), surface.rms_height, surface.rms_slope)
    return contact, _states(contact, path)


def _boundary_elements(surface, material, path):
    """Return the contact problem and the states of boundary elements at the targets of the path."""
    contact = contact_of(surface, material)
    return contact, _states(contact, path)


def _states(contact, path):
    """Return the states of a contact at the targets of a path."""
    met = {waypoint.target: waypoint.state for waypoint in follow(contact, path)}
    return [met[target] for target in path.targets]


def _results(contact, states):
    """Yield area and separation of some states."""
    return (State(contact.area_fraction(state), state.separation) for state in states)


def _without_unions(contact, surface, reduced_pressures):
    """Yield the variants without unions and adhesion: name, and discs at each pressure."""
    law, summits = contact.law, contact.asperities
    loads = [p * contact.contact_modulus * surface.rms_slope for p in reduced_pressures]
    yield "independent", (independent_discs(summits, law, p) for p in loads)
    for name, shaped in (("without_unions", False), ("field_shape", True)):
        yield name, [discs_apart(summits, law, p, surface.rms_height, field_shape=shaped) for p in loads]


def _solve_paraboloids(heights, surface, material, reduced_pressures):
    """Yield the results at the same loads on other heights; separations are from the mean plane of the surface."""
    other = Surface(heights, surface.period)
    path = Path(reduced_pressures=[p * surface.rms_slope / other.rms_slope for p in reduced_pressures])
    for state in _results(*_boundary_elements(other, material, path)):
        yield state._replace(separation=state.separation + float(np.mean(heights)))


def _dataset(surface, material, pressures, states, singles):
    along = ("variant", "reduced_pressure")
    variables = {
        "contact_area_fraction": (along, [[state.area for state in solved] for solved in states.values()]),
        "mean_separation": (along, [[state.separation for state in solved] for solved in states.values()]),
        "contact_modulus": material.contact_modulus,
        "surface_energy": material.surface_energy,
        **{name: getattr(surface, name) for name in ("rms_slope", "rms_height", "rms_curvature", "period", "grid")},
    }
    coordinates = {"variant": list(states), "reduced_pressure": pressures}
    if singles is not None:
        repeated = np.repeat(pressures, [len(one["pair_spot_area"]) for one in singles])
        variables["pair_reduced_pressure"] = ("pair", repeated)
        for name in singles[0]:
            variables[name] = ("pair", np.concatenate([one[name] for one in singles]))
    return xr.Dataset(variables, coordinates)


def chain(sources: xr.Dataset) -> dict[str, str]:
    """Return the variants from the model to boundary elements, with the change of each step."""
    return ADHESIVE_CHAIN if float(sources["surface_energy"]) > 0 else CHAIN


def effects(sources: xr.Dataset) -> xr.DataArray:
    """Return the contribution of each step to ln(A/A_BEM) of the model, along (source, reduced_pressure).

    The sum over the sources is the logarithm of the area of the model over that of the boundary elements.
    """
    links = chain(sources)
    names = list(links)
    area = np.log(sources["contact_area_fraction"])
    steps = [
        area.sel(variant=before, drop=True) - area.sel(variant=after, drop=True)
        for before, after in itertools.pairwise(names)
    ]
    return xr.concat(steps, "source").assign_coords(source=[links[name] for name in names[1:]])


def shape_ratio(sources: xr.Dataset) -> xr.DataArray:
    """Return the area of the patch of each pair over Hertz's area at its force: 1 for a single paraboloid."""
    radius = np.cbrt(0.75 * sources["pair_patch_force"] * sources["pair_curvature_radius"] / sources["contact_modulus"])
    return sources["pair_patch_area"] / (np.pi * radius**2)


def shape_ratio_of_fourth_order(sources: xr.Dataset) -> xr.DataArray:
    """Return the same ratio with only the fourth-order term of the summit, (1 - 16/5 b R a^2)^(-2/3), or NaN."""
    squared_radius = sources["pair_patch_area"] / np.pi
    force_ratio = 1 - 3.2 * sources["pair_fourth_order"] * sources["pair_curvature_radius"] * squared_radius
    return force_ratio.where(force_ratio > 0) ** (-2 / 3)


def relative_radius(sources: xr.Dataset) -> xr.DataArray:
    """Return the radius of the patch of each pair times the wave number sqrt(<q^4>/<q^2>) of the surface."""
    wave_number = sources["rms_curvature"] * np.sqrt(8 / 3) / sources["rms_slope"]
    return np.sqrt(sources["pair_patch_area"] / np.pi) * wave_number


# The surface `middle` of campaign validation.
SPECTRUM = SelfAffineSpectrum(100e-6, 20e-6, 1.5625e-6, 0.8, 1.0)
HARD, STICKY = Material(25e6, 0.0, 40e-9), Material(25e6, 0.05, 40e-9)


def main() -> None:
    """Solve all surfaces without a saved solution, and write the tables and the figure."""
    from validation.error_source_tables import write

    def solved(name, seed, material, reduced_pressures):
        file = FilePath("results/error_sources", f"{name}_seed{seed}.nc")
        if not file.exists():
            file.parent.mkdir(parents=True, exist_ok=True)
            print(f"{name}, seed {seed}", flush=True)
            surface = SPECTRUM.realise(512, seed)
            error_sources(surface, material, reduced_pressures).to_netcdf(file, engine="h5netcdf")
        return xr.load_dataset(file, engine="h5netcdf")

    loads = [1e-4, 1e-3, 3.16e-3, 1e-2, 3.16e-2]
    write([solved("adhesionless", seed, HARD, loads) for seed in (1, 2, 3)], solved("adhesive", 1, STICKY, [1e-2]))


if __name__ == "__main__":
    main()
