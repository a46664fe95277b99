"""One contact spot: material, law and coalescence; criteria for sticky surfaces."""
