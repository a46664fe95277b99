"""Bins of gaps and pressures (`icha.contact.bins`) as variables of a dataset."""

import numpy as np

from icha.datasets.variables.terms import Table, Variable

# Lower and upper edge of a bin, as CF has bounds.
BOUND = "bound"


def bin_table(quantity: str, units: str, over: str = "") -> Table:
    """Descriptions of the variables that say where the bins of a quantity are.

    `<quantity>_bin_edges` are the edges; `<quantity>_bin_centre`, a coordinate, has `<quantity>_bin_bounds` as its
    bounds (CF 1.11, section 7.1), which have its units and its long name. In Pa it must not be a coordinate
    variable, along a dimension of its own name, which CF would take for a height.

    Parameters
    ----------
    quantity : what is binned.
    units : of the edges.
    over : by what the quantity is divided, if by anything.
    """
    over = f" over {over}" if over else ""
    bins, inside = f"{quantity}_bin", f"{quantity} in the bin{over}"
    middle = {"bounds": f"{bins}_bounds", "comment": "middle of the bin"}
    return {
        f"{bins}_edges": Variable((f"{quantity}_edge",), units, f"edges of the {quantity} bins{over}"),
        f"{bins}_centre": Variable((bins,), units, inside, further=middle, coordinate=True),
        f"{bins}_bounds": Variable((bins, BOUND), units, inside),
    }


def bin_values(quantity: str, edges: np.ndarray) -> dict[str, np.ndarray]:
    """Values of the variables of `bin_table`."""
    return {
        f"{quantity}_bin_edges": edges,
        f"{quantity}_bin_centre": (edges[:-1] + edges[1:]) / 2,
        f"{quantity}_bin_bounds": np.column_stack([edges[:-1], edges[1:]]),
    }
