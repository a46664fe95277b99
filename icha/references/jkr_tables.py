"""Read the points of a JKR test: force, contact radius and indentation in SI units, from a file or from arrays."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from icha.support.rules import FORCES, INDENTATIONS, NUMBER, FloatRange
from icha.support.tables import numbers_of, read_table
from icha.support.titles import contradicting_unit, problem_with_numbers, stated_unit
from icha.support.units import PHYSICAL_NAMES, conversion_factor

# Columns of numbers: bounds in SI units, and headings.
_RULES = {"force": FORCES, "contact_radius": FloatRange("m", least=0, most=1e9), "indentation": INDENTATIONS}
_END = r"(?![^\W\d_])"
_HEADINGS = {
    "force": rf"(?:force|load|f){_END}",
    "contact_radius": rf"(?:(?:contact[\s_-]*)?radius|a){_END}",
    "indentation": rf"(?:indentation|depth|delta|δ){_END}",
    "branch": rf"(?:branch|direction|segment){_END}",
}
_LOADING = "loading", "load", "approach", "advancing", "in"
_UNLOADING = "unloading", "unload", "retraction", "retract", "receding", "out"
_BRANCH = f"expected {_LOADING[0]} or {_UNLOADING[0]} (also {', '.join(_LOADING[1:] + _UNLOADING[1:])})"


class Points(NamedTuple):
    """Measured points in the order of the test.

    Attributes
    ----------
    values : (n,) float by quantity: `force`, N, and `contact_radius` or `indentation` or both, m.
    unloading : (n,) bool; None if the table has no column of the branch.
    places : name of each point for messages, such as `line 7`.
    """

    values: dict[str, np.ndarray]
    unloading: np.ndarray | None
    places: list[str]


def read_points(table: Any, columns: Mapping[str, str], units: Mapping[str, str]) -> Points:
    """Read the points of a JKR test from the path of a file, or from a mapping or data frame of columns.

    Parameters
    ----------
    table, columns, units : as in `icha.fit_jkr_test`.

    Raises
    ------
    ValueError
        If a column is missing, a unit is missing or wrong, or a value is not a finite number.
    """
    for name, given in (("columns", columns), ("units", units)):
        known = list(_HEADINGS if name == "columns" else _RULES)
        if unknown := [key for key in given if key not in known]:
            raise ValueError(f"{name}: {unknown[0]!r} is not a quantity; expected one of {', '.join(known)}")
    from_file = isinstance(table, str | os.PathLike)
    if from_file:
        headings, rows = read_table(table)
        places = [f"line {number}" for number, _ in rows]
    elif hasattr(table, "keys"):
        headings = [str(key) for key in table.keys()]
    else:
        raise ValueError(f"{type(table).__name__} is not a table; expected a path, a mapping or a data frame")
    found = _find_columns(headings, columns)
    factors = {name: _factor(found[name], name, units.get(name), from_file) for name in _RULES if name in found}
    titles = {name: found[name] for name in factors}
    if from_file:
        numbers = numbers_of(rows, {headings.index(title): repr(title) for title in titles.values()}, NUMBER)
    else:
        numbers = [np.asarray(table[title]) for title in titles.values()]
        places = [f"point {k}" for k in range(1, 1 + numbers[0].size)]
    values = {}
    for name, array in zip(titles, numbers, strict=True):
        if array.shape != (len(places),) or array.dtype.kind not in "fiu":
            raise ValueError(f"column {titles[name]!r}: expected a list of {len(places)} numbers")
        values[name] = array * factors[name]
        for place, value in zip(places, values[name], strict=True):
            if not _RULES[name].contains(value):
                rule = _RULES[name]
                text = (
                    f"column {titles[name]!r}, {place}: {value:.4g} {rule.unit}; expected {rule.expected} {rule.unit}"
                )
                raise ValueError(text)
    unloading = None
    if "branch" in found:
        title = found["branch"]
        texts = [row[headings.index(title)] for _, row in rows] if from_file else [str(text) for text in table[title]]
        for place, text in zip(places, texts, strict=True):
            if text.strip().lower() not in _LOADING + _UNLOADING:
                raise ValueError(f"column {title!r}, {place}: {text[:40]!r}; {_BRANCH}")
        unloading = np.array([text.strip().lower() in _UNLOADING for text in texts])
    return Points(values, unloading, places)


def _find_columns(headings, columns):
    """Return the heading of each quantity; raise ValueError if a needed column is missing, or if several fit."""
    listed = f"expected one of {', '.join(headings)}"
    found = {}
    for name, pattern in _HEADINGS.items():
        plain = [unicodedata.normalize("NFKC", each).strip().lower() for each in headings]
        fitting = [each for each, text in zip(headings, plain, strict=True) if re.match(pattern, text)]
        if name in columns:
            if headings.count(columns[name]) != 1:
                raise ValueError(f"has {headings.count(columns[name]) or 'no'} column {columns[name]!r}; {listed}")
            found[name] = columns[name]
        elif len(fitting) > 1:
            raise ValueError(f"has several columns for {name}: {', '.join(fitting)}; choose one with `columns`")
        elif fitting:
            found[name] = fitting[0]
    if "force" not in found or not {"contact_radius", "indentation"} & found.keys():
        missing = "force" if "force" not in found else "contact radius or indentation"
        raise ValueError(
            f"has no column for {missing} among {', '.join(headings)}; expected headings such as force (mN) and "
            "contact radius (um) or indentation (um). Name other headings with `columns`"
        )
    return found


def _factor(title, name, unit, from_file):
    """Return the factor from the numbers of a column to SI units."""
    si_unit = _RULES[name].unit
    stated = stated_unit(title)
    example = "mN" if si_unit == "N" else "um"
    if unit is None and stated is None and from_file:
        raise ValueError(
            f"column {title!r}: the unit is missing; expected a unit of {PHYSICAL_NAMES[si_unit]} in the heading, such "
            f"as '{title} ({example})', or in `units`"
        )
    if unit is None:
        unit = stated.text if stated else si_unit
    try:
        factor = float(conversion_factor(unit, si_unit))
    except ValueError as error:
        raise ValueError(f"column {title!r}: {error}; expected a unit such as {example}") from None
    if other := contradicting_unit(title, unit, si_unit):
        raise ValueError(f"column {title!r}: the unit is {unit!r}, but the heading states {other!r}; expected the same")
    if problem := problem_with_numbers(title, unit, si_unit):
        raise ValueError(f"column {title!r} {problem}")
    return factor
