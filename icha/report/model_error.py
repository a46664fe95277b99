"""The section on how far the model is from boundary elements."""

from __future__ import annotations

import itertools

import numpy as np

from icha.analysis.model_error import SUMMARISED
from icha.datasets.labels import place_of, slopes_of, surfaces_and_slopes
from icha.datasets.variables.model_error import SHORT_RANGE
from icha.support.statistics import ENOUGH, ensemble


def entry_section(errors):
    """What the page says about one entry of the model error: a row for every surface, material and load."""

    def scatter(state, name):
        """Mean, half the width of its 95 % interval of five seeds or more, and smallest and largest of fewer."""
        values = state[name].values[np.isfinite(state[name].values)]
        if not len(values):
            return None  # of no snapshot
        over = ensemble(values)
        if len(values) >= ENOUGH:
            return float(over.mean), float(over.confidence), None
        return float(over.mean), None, (float(values.min()), float(values.max())) if len(values) > 1 else None

    rows = []
    for (surface, slope), material in itertools.product(
        surfaces_and_slopes(errors), errors["material"].values.tolist()
    ):
        contact = errors.isel(place_of(errors, {"surface": surface, "rms_slope": slope, "material": material}))
        for p in errors["reduced_pressure"].values.tolist():
            state = contact.sel(reduced_pressure=p)
            # Not all combinations of an entry are asked for.
            if not np.isfinite(state["area_error"]).any():
                continue
            rows.append(
                {
                    "surface": surface,
                    "rms_slope": slope,
                    "material": material,
                    "reduced_pressure": p,
                    "area": float(state["contact_area_fraction"].mean()),
                    "true_area": float(state["contact_area_fraction_boundary_elements"].mean()),
                    **{name: scatter(state, name) for name in SUMMARISED},
                }
            )

    def spread(name):
        values = errors[name].values[np.isfinite(errors[name].values)]
        if not len(values):
            return None
        return {"median": float(np.median(values)), "least": float(values.min()), "most": float(values.max())}

    tabor = errors["tabor_parameter"].values
    return {
        "name": errors.attrs["entry"],
        "study": errors.attrs["study"],
        "short_range": errors.attrs["truth"] == SHORT_RANGE,
        "axes": {
            "rms_slope": slopes_of(errors),
            **{label: errors[label].values.tolist() for label in ("material", "seed")},
        },
        "states": int(errors["area_error"].count()),
        "grids": sorted({int(n) for n in errors["solution_grid"].values.ravel() if np.isfinite(n)}),
        "adhesive": bool((errors["surface_energy"] > 0).any()),
        "tabor": list(dict.fromkeys(f"{mu:.2g}" for mu in (np.nanmin(tabor), np.nanmax(tabor)))),
        "load_error": float(np.abs(errors["load_error"]).max()),
        "residual": float(errors["residual"].max()),
        "rows": rows,
        **{name: spread(name) for name in (*SUMMARISED, "perimeter_correction")},
    }
