"""What the work of a step of a path leaves open: where its events happen, and how its pressure bends."""


def pressure_jump(width, change, slope, end_slope):
    """By how much a change of the pressure over a step misses that along the tangents at its ends, Pa."""
    return change - 0.5 * width * (slope + end_slope)


def unresolved_work(width, pressure_jump):
    """Bound of the error of the work of a step with events: they may all lie at either of its ends, J/m^2."""
    return 0.5 * abs(width * pressure_jump)


def integration_error(width, slope, end_slope):
    """Bound of the error of the work of a step where it is smooth, J/m^2."""
    return width**2 * abs(end_slope - slope) / 24
