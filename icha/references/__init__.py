"""What ICHA is compared with: theories of rough contact and published points."""

from icha.references.dataset import reference_dataset

__all__ = ["reference_dataset"]
