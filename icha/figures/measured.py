"""Measurements that figures show beside runs: areas against load (figure 5), and values of indenters (17 to 19)."""

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from icha.support.tables import read_columns


class Measured(NamedTuple):
    """A measurement.

    Attributes
    ----------
    label, citation : name in the legend; source of the numbers.
    material : material of the measurement; None if it is not given.
    values : measured values in SI units, arrays of the same length by quantity.
    rms_slope : rms slope of the measured roughness; None if it is not given.
    contact_modulus : E*, Pa, if the loads are pressures in Pa; None if they are reduced pressures p/(E* h'rms).
    works : works of adhesion of the material, advancing and receding, J/m^2; None without a material.
    """

    label: str
    citation: str
    material: str | None
    values: dict[str, np.ndarray]
    rms_slope: float | None = None
    contact_modulus: float | None = None
    works: tuple[float, float] | None = None


def read_measurements(tables: Sequence[str | os.PathLike], known: Sequence[Mapping[str, Any]]) -> list[Measured]:
    """Return the measurements in some tables.

    For each table, `known` has the other fields of `Measured`, `columns` (factors by heading), and `quantities` (names
    of the values by column).
    """
    found = []
    for table, fields in zip(tables, map(dict, known), strict=True):
        columns, names = fields.pop("columns"), fields.pop("quantities")
        values = dict(zip(names, read_columns(table, columns, signed=columns), strict=True))
        found.append(Measured(values=values, **fields))
    return found


def name_sources(measurements: Iterable[Measured]) -> str:
    """Return labels and citations of measurements, for a caption."""
    return "; ".join(f"{each.label} ({each.citation})" for each in measurements)
