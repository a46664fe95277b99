"""How far the model reaches."""

# Beyond these the spots have lost their identity: soon after, the computed mean planes of a surface without
# adhesion meet.
MAX_REDUCED_PRESSURE = 0.15
MAX_AREA_FRACTION = 0.25
# Longest step of the mean separation, in h_rms, that may be asked for, and the one taken if none is.
MAX_STEP = 0.5
DEFAULT_STEP = 0.15
