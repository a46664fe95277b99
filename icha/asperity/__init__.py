"""One contact spot: material, law, and what becomes of two that overlap."""
