"""The elastic half-space between the spots: who displaces whom by how much."""
