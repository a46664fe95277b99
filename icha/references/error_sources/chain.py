"""The chain of variants from the model to the truth, and what a dataset of them says of each link."""

import itertools

import numpy as np
import xarray as xr

# From the model to the truth, and what changes from one to the next. With adhesion the model is not solved without its
# unions.
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
BESIDE = ("independent", "point_forces", "icha_fine_grid", "boundary_elements_coarse")

# What a group of spots and patches is that lie on each other.
CATEGORIES = {
    "single": "one spot of one summit, one patch",
    "several": "spots of one summit each, with a patch in common or several patches under one spot",
    "united": "with a united spot",
    "extra": "a spot without a patch",
    "missed": "a patch without a spot",
}


def chain(sources: xr.Dataset) -> dict[str, str]:
    """The variants from the model to the truth, and what changes from the one before."""
    return ADHESIVE_CHAIN if float(sources["surface_energy"]) > 0 else CHAIN


def effects(sources: xr.Dataset) -> xr.DataArray:
    """What every link of the chain adds to ln(A/A_truth) of the model, along (source, reduced_pressure).

    The sum over the sources is the logarithm of the model's area over the boundary elements'.
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
    """Area of every pair's patch over Hertz's area at the patch's own force: 1 for a lone paraboloid."""
    radius = np.cbrt(0.75 * sources["pair_patch_force"] * sources["pair_curvature_radius"] / sources["contact_modulus"])
    return sources["pair_patch_area"] / (np.pi * radius**2)


def shape_ratio_of_fourth_order(sources: xr.Dataset) -> xr.DataArray:
    """The same as the summit's fourth-order term gives it, (1 - 16/5 b R a^2)^(-2/3); NaN beyond where that can be."""
    reduction = (
        3.2 / np.pi * sources["pair_fourth_order"] * sources["pair_curvature_radius"] * sources["pair_patch_area"]
    )
    return (1 - reduction.where(reduction < 1)) ** (-2 / 3)


def relative_radius(sources: xr.Dataset) -> xr.DataArray:
    """Radius of every pair's patch times the wave number sqrt(<q^4>/<q^2>) of the surface's curvature over slope."""
    wave_number = sources["rms_curvature"] * np.sqrt(8 / 3) / sources["rms_slope"]
    return np.sqrt(sources["pair_patch_area"] / np.pi) * wave_number
