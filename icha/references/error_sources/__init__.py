"""Where the model's error comes from: between ICHA and boundary elements, one thing is switched at a time.

Boundary elements can be given, instead of the topography, the surface that the model assumes. A chain of variants then
leads from the model to the truth, every link changing one thing:

    icha                      the model;
    without_unions            overlapping spots stay as they are; their area is that of the union of the discs;
    field_shape               moreover the displacement w by the other spots has a slope and a curvature across a spot:
                              there the summit stands higher by R |grad w|^2/2 and is sharper, 1/R + laplacian(w)/2;
    circular_paraboloids      boundary elements on the upper envelope of the paraboloids z - r^2/(2R) of all summits;
    elliptic_paraboloids      the same with both principal curvatures, of which 1/R is the geometric mean;
    boundary_elements         boundary elements on the topography itself.

What the last link changes is the shape of the summits beyond their paraboloids. Beside the chain stand

    independent               Hertz's summits that do not interact;
    point_forces              without unions, spots acting on each other by their forces alone, F/(pi E* r);
    icha_fine_grid            the model on a grid twice as fine;
    boundary_elements_coarse  boundary elements on a grid half as fine.

How a summit goes on beyond its paraboloid shows in single patches: on the profile r^2/(2R) - b r^4 a contact of radius
a carries F = 4 E* a^3/(3R) (1 - 16/5 b R a^2) (I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47-57,
doi:10.1016/0020-7225(65)90019-4), with b the bi-Laplacian of the heights at the summit over 64.
"""
