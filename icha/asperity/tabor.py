"""Error of the limit of a short range of attraction, from the Tabor parameter.

Boundary elements and the law of JKR hold for large Tabor parameters mu. D. Maugis (J. Colloid Interface Sci. 150 (1992)
243-269, doi:10.1016/0021-9797(92)90285-T) solved the contact of a sphere with a constant attraction sigma_0. With the
largest attraction of Lennard-Jones, sigma_0 = 16/(9 sqrt(3)) dgamma/epsilon, his parameter is lambda = 1.157 mu.
"""

import math

# Smallest Tabor parameter without a warning, and smallest one without a confirmation. At these values, the pull-off
# force of a sphere is 0.9 % and 5.5 % larger than in the limit of a short range.
SHORT_RANGE_FROM, LEAST_TABOR = 3.0, 1.0
# lambda/mu: lambda = 2 sigma_0 (9 R/(16 pi dgamma E*^2))^(1/3) for a contact modulus E*.
_LAMBDA = 32 / (9 * math.sqrt(3)) * math.cbrt(9 / (16 * math.pi))


def sphere_pull_off_factor(tabor_parameter: float) -> float:
    """Return the pull-off force of a sphere divided by pi dgamma R: from 2 (rigid sphere) to 1.5 (JKR).

    It is the largest tension of the equations of Maugis for the contact radius a and the radius m a up to which the
    surfaces attract. At a given m, a is the positive root of a quadratic equation. Lengths and forces are in the units
    of Maugis.
    """
    from scipy.optimize import minimize_scalar

    attraction = _LAMBDA * tabor_parameter

    def tension(log_width):
        width = math.exp(log_width)  # m - 1
        s = math.sqrt(width * (2 + width))
        angle = math.atan(s)
        square = attraction / 2 * (s**2 * angle + s - angle)
        linear = 4 * attraction**2 / 3 * (s * angle - width)
        a = 2 / (linear + math.sqrt(linear**2 + 4 * square))
        return attraction * a**2 * (s + (1 + s**2) * angle) - a**3

    # Between a front much narrower than the contact, and a contact much smaller than the range of the attraction.
    return -float(minimize_scalar(lambda log_width: -tension(log_width), bounds=(-40, 20), method="bounded").fun)


def describe_short_range(tabor_parameter: float) -> str:
    """Describe the error of the limit of a short range at a Tabor parameter; "" if the error is small."""
    if tabor_parameter >= SHORT_RANGE_FROM:
        return ""
    factor = sphere_pull_off_factor(tabor_parameter)
    return (
        f"at the Tabor parameter {tabor_parameter:.2g}, the pull-off force of a sphere is {factor:.3g} pi dgamma R by "
        f"the theory of Maugis, {100 * (factor / 1.5 - 1):.2g} % more than for a short range"
    )
