"""Data of the figures of studies with `sample`: results at one target, and the names of parameters and quantities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.contact.models import MODELS
from icha.datasets.quantities import quantity, state_words, symbol_of
from icha.support.formatting import choose_unit

if TYPE_CHECKING:
    import xarray as xr


def responses(data: xr.Dataset, target: int) -> xr.Dataset:
    """Return the results at one target and of the whole loop, for the model that is closest to the truth.

    Raises
    ------
    NothingToDraw
        If no case has a result there.
    """
    from icha.figures.select import NothingToDraw

    number = data.sizes["target"] - 1 if target < 0 else target
    if "response" not in data.dims:
        raise NothingToDraw(f"study {data.attrs['study']}: no case has a result")
    models = data["response_model"].values.tolist()
    shown = data["response_target"].isin((number, -1)) & (data["response_model"] == best_model(models))
    if not shown.any():
        raise NothingToDraw(f"study {data.attrs['study']}: no case has a result at target {number}")
    return data.isel(response=shown.values)


def best_model(models: Sequence[str]) -> str:
    """Return boundary elements if a study has them, otherwise the asperity model."""
    return next(name for name in reversed(MODELS) if name in models)


def title_of(data: xr.Dataset, row: xr.Dataset) -> str:
    """Return quantity and state of a result, such as `contact area at p* = 0.01`."""
    number = int(row["response_target"])
    words = quantity(str(row["response_quantity"].item())).name
    if number < 0:
        return words
    kind, target = str(data["stop_kind"].values[number]), float(data["stop_target"].values[number])
    return f"{words} at {state_words(kind, target)}"


def scale_of(data: xr.Dataset, name: str) -> tuple[float, str]:
    """Return factor and label of the axis of a parameter."""
    unit = data[name].attrs["units"]
    if unit == "1":
        return 1.0, symbol_of(name)
    factor, prefixed = choose_unit(float(np.abs(data[name].values).max()), unit)
    return factor, f"{symbol_of(name)} ({prefixed})"
