"""Failure of what stands beside the model."""


class NotSolved(RuntimeError):
    """Boundary elements, or a variant between them and the model, did not converge; the message says which."""
