"""Names of the models of contact that a run may be computed with."""

ASPERITIES, BOUNDARY_ELEMENTS = "asperities", "boundary_elements"
# The first is what is meant where none is named.
MODELS = (ASPERITIES, BOUNDARY_ELEMENTS)


def first_of(models) -> str:
    """The one of some models that stands for all of them where only one is shown: asperities, or else the first."""
    return ASPERITIES if ASPERITIES in models else next(iter(models))
