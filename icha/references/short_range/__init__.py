"""Contact in the limit of short range where it is known in closed form, and the boundary elements held against it."""
