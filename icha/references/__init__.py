"""References for comparison with ICHA: theories of rough contact, and published points."""
