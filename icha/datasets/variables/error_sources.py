"""Variables of the variants between the model and boundary elements."""

from icha.datasets.variables.terms import MATERIAL, ROUGHNESS, Variable, terms

_OF_VARIANT, _OF_CATEGORY, _PAIR = ("variant", "reduced_pressure"), ("category", "reduced_pressure"), ("pair",)

ERROR_SOURCES = {
    "variant": Variable(("variant",), "1", "variant that was solved", str, coordinate=True),
    "reduced_pressure": terms("reduced_pressure", along=("reduced_pressure",))["reduced_pressure"]._replace(
        coordinate=True
    ),
    "category": Variable(("category",), "1", "group of spots and patches that overlap", str, coordinate=True),
    **terms("contact_area_fraction", along=_OF_VARIANT),
    "mean_separation": Variable(_OF_VARIANT, "m", "mean separation from the surface's own mean plane"),
    **terms("reduced_separation", along=_OF_VARIANT),
    "spot_count": Variable(_OF_CATEGORY, "1", "number of the model's spots", int),
    "patch_count": Variable(_OF_CATEGORY, "1", "number of the boundary elements' patches", int),
    "spot_area_fraction": Variable(_OF_CATEGORY, "1", "area of the model's spots over the nominal area"),
    "patch_area_fraction": Variable(_OF_CATEGORY, "1", "area of the patches over the nominal area"),
    "spot_load_share": Variable(_OF_CATEGORY, "1", "part of the load that the model's spots carry"),
    "patch_load_share": Variable(_OF_CATEGORY, "1", "part of the load that the patches carry"),
    "pair_reduced_pressure": Variable(_PAIR, "1", "reduced pressure at which a single spot and its patch were found"),
    "pair_spot_area": Variable(_PAIR, "m^2", "area of the spot"),
    "pair_patch_area": Variable(_PAIR, "m^2", "area of the patch"),
    "pair_spot_force": Variable(_PAIR, "N", "force on the spot"),
    "pair_patch_force": Variable(_PAIR, "N", "force on the patch"),
    "pair_patch_nodes": Variable(_PAIR, "1", "boundary elements in the patch", int),
    "pair_curvature_radius": Variable(_PAIR, "m", "the summit's radius of curvature"),
    "pair_fourth_order": Variable(_PAIR, "m^-3", "the summit's fourth-order term, bi-Laplacian of the heights over 64"),
    **terms(*MATERIAL, *ROUGHNESS, "period"),
    "grid": Variable((), "1", "nodes of the surface along a side", int),
    "refinement": Variable((), "1", "boundary elements per cell of the surface's grid, along a side", int),
    "tolerance": Variable((), "1", "error of the boundary elements' solver at which it may stop"),
    **terms("seed"),
}
