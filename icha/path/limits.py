"""How far the model reaches: rules for the states and the steps of a path."""

from icha.support.rules import LENGTH, POSITIVE, Real

# Beyond these the spots have lost their identity: soon after, the computed mean planes of a surface without
# adhesion meet.
MAX_REDUCED_PRESSURE = 0.15
MAX_AREA_FRACTION = 0.25
# Smaller loads, but for none at all, and areas are less than the errors of the equilibria that have them.
LEAST_PRESSURE, LEAST_AREA = 1e-12, 1e-9
# Shortest and longest step of the mean separation, in h_rms, that may be asked for, and the one taken if none is. With
# the shortest a path has some ten thousand equilibria.
MIN_STEP, MAX_STEP = 1e-4, 0.5
DEFAULT_STEP = 0.15
# Of the energy that jumps have set free so far, the part that may be unknown after a step for not knowing where in it
# its events happened.
UNRESOLVED_LOSS = 5e-4
# The same of the work so far, where jumps set next to nothing free: the equilibria leave more of it open.
UNRESOLVED_REST = 1e-10
# Of the work so far, the part by which work and energy may disagree in a step without events that is not short.
UNBALANCED_WORK = 3e-6

# By the kind of quantity.
STATES = {
    "reduced_pressure": Real(least=LEAST_PRESSURE, most=MAX_REDUCED_PRESSURE, model_ends=True),
    "relative_load": POSITIVE,
    "area_fraction": Real(least=LEAST_AREA, most=MAX_AREA_FRACTION, model_ends=True),
    "mean_separation": LENGTH,
}
STEP = Real("h_rms", least=MIN_STEP, most=MAX_STEP)
