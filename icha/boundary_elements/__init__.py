"""Boundary elements in the limit of a short range of adhesion: a contact model that resolves patches, not ranges."""
