"""Variables of the comparison of one asperity by the model and by boundary elements."""

from icha.datasets.variables.terms import MATERIAL, Variable, terms

_APPROACH, _LOAD = ("approach",), ("given_load",)

ONE_ASPERITY = {
    "approach": Variable(_APPROACH, "m", "approach of the summit to the mean plane", coordinate=True),
    "given_load": Variable(_LOAD, "N", "force by boundary elements, given to ICHA as load", coordinate=True),
    "force_boundary_elements": Variable(_APPROACH, "N", "force by boundary elements"),
    "zero_gap_area": Variable(_APPROACH, "m^2", "area of zero gap by boundary elements, corrected by its perimeter"),
    "energetic_area": Variable(_APPROACH, "m^2", "energy of adhesion by boundary elements over the surface energy"),
    "residual": Variable(_APPROACH, "1", "error of the boundary elements' solver: its criterion of convergence"),
    "force_icha": Variable(_APPROACH, "N", "force by ICHA"),
    "area_icha": Variable(_APPROACH, "m^2", "contact area by ICHA"),
    "area_icha_at_load": Variable(_LOAD, "m^2", "contact area by ICHA at the boundary elements' force"),
    "approach_icha_at_load": Variable(_LOAD, "m", "approach by ICHA at the boundary elements' force"),
    "approach_boundary_elements_at_load": Variable(
        _LOAD, "m", "approach of the boundary elements' states of these loads"
    ),
    "pull_off_force_icha": Variable((), "N", "largest tension by ICHA, 3/2 pi dgamma R"),
    "pull_off_force_boundary_elements": Variable((), "N", "largest tension of the boundary elements' states"),
    "force_error": Variable(
        _APPROACH,
        "1",
        "ICHA's force minus that of boundary elements, over the larger of the latter and ICHA's pull-off force",
    ),
    "zero_gap_area_error": Variable(_APPROACH, "1", "ICHA's area over that of zero gap, minus 1, at the same approach"),
    "energetic_area_error": Variable(
        _APPROACH, "1", "ICHA's area over the energetic one, minus 1, at the same approach"
    ),
    "zero_gap_area_error_at_load": Variable(_LOAD, "1", "ICHA's area over that of zero gap, minus 1, at the same load"),
    "energetic_area_error_at_load": Variable(
        _LOAD, "1", "ICHA's area over the energetic one, minus 1, at the same load"
    ),
    "approach_error_at_load": Variable(
        _LOAD,
        "1",
        "ICHA's approach less the boundary elements' at the same load, over (dgamma^2 R/E*^2)^(1/3), without adhesion "
        "over the latter",
    ),
    "pull_off_error": Variable((), "1", "ICHA's pull-off force less the boundary elements', over ICHA's"),
    "tabor_parameter": Variable((), "1", "Tabor parameter, (dgamma^2 R/E*^2)^(1/3)/range; 0 without adhesion"),
    **terms(*MATERIAL),
    "radius_of_curvature": Variable((), "m", "radius of curvature of the asperity"),
    **terms("period", "grid", "spacing", "strength_number"),
    "tolerance": Variable((), "1", "error of the boundary elements' solver at which it was to stop"),
}
