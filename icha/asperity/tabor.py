"""Error of the limit of a short range of attraction, from the Tabor parameter.

Boundary elements and the law of JKR hold for large Tabor parameters mu. D. Maugis (J. Colloid Interface Sci. 150 (1992)
243-269, doi:10.1016/0021-9797(92)90285-T) solved the contact of a sphere with a constant attraction sigma_0. With the
largest attraction of Lennard-Jones, sigma_0 = 16/(9 sqrt(3)) dgamma/epsilon, his parameter is lambda = 1.157 mu.
"""

import math

# Smallest Tabor parameter without a warning, and smallest one without a confirmation. At these values, the pull-off
# force of a sphere is 1.4 % and 5.6 % larger than in the limit of a short range.
SHORT_RANGE_FROM, LEAST_TABOR = 3.0, 1.0
# lambda/mu: lambda = 2 sigma_0 (9 R/(16 pi dgamma E*^2))^(1/3) for a contact modulus E*.
_LAMBDA = 32 / (9 * math.sqrt(3)) * math.cbrt(9 / (16 * math.pi))


def sphere_pull_off_factor(tabor_parameter: float) -> float:
    """Return the pull-off force of a sphere divided by pi dgamma R: from 2 (rigid sphere) to 1.5 (JKR).

    The formula of R. W. Carpick, D. F. Ogletree and M. Salmeron, J. Colloid Interface Sci. 211 (1999) 395-400,
    doi:10.1006/jcis.1998.6027, agrees with the equations of Maugis within 2 %.
    """
    power = 4.04 * (_LAMBDA * tabor_parameter) ** 1.4
    return 7 / 4 - 1 / 4 * (power - 1) / (power + 1)


def describe_short_range(tabor_parameter: float) -> str:
    """Describe the error of the limit of a short range at a Tabor parameter; "" if the error is small."""
    if tabor_parameter >= SHORT_RANGE_FROM:
        return ""
    factor = sphere_pull_off_factor(tabor_parameter)
    return (
        f"at the Tabor parameter {tabor_parameter:.2g}, the pull-off force of a sphere is {factor:.3g} pi dgamma R by "
        f"the theory of Maugis, {100 * (factor / 1.5 - 1):.2g} % more than for a short range"
    )
