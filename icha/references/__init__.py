"""References for comparison with ICHA: theories of rough contact, published points, boundary elements by Tamaas."""
