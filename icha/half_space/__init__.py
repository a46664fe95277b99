"""The elastic half-space between the spots: the displacement that every spot causes at the others."""
