"""Read the points of a JKR test: force, contact radius and indentation in SI units, from a file or from arrays."""

from __future__ import annotations

import math
import os
import re
import unicodedata
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import median_filter

from icha.support.rules import FloatRange
from icha.support.tables import numbers_of, read_table
from icha.support.titles import (
    bracketed_texts,
    contradicting_unit,
    problem_with_numbers,
    problem_with_words,
    stated_unit,
)
from icha.support.units import PHYSICAL_NAMES, conversion_factor

# SI unit and an example of a unit of the numbers; beginning of the headings.
_UNITS = {"force": ("N", "mN"), "contact_radius": ("m", "um"), "indentation": ("m", "um")}
_HEADINGS = {
    "force": r"force|load|f",
    "contact_radius": r"(?:contact[\s_-]*)?radius|a",
    "indentation": r"indentation|depth|delta|δ",
    "branch": r"branch|direction|segment",
}
_LOADING = "loading", "load", "approach", "advancing", "in"
_UNLOADING = "unloading", "unload", "retraction", "retract", "receding", "out"
_BRANCH = f"expected {_LOADING[0]} or {_UNLOADING[0]} (also {', '.join(_LOADING[1:] + _UNLOADING[1:])})"

# A number that exceeds every other one in its column by this factor is not a measured value.
_FAR = 30
# Nor is one whose distance from the median of five neighbours exceeds this multiple of the range of the medians, and of
# the median distance. At the turning point of a test the distance is about one step, at a jump-in less than the range.
_SPIKE, _USUAL_SPIKES, _NEIGHBOURS = 1.0, 30, 5
# Smallest number of points that determine a work of adhesion.
LEAST_POINTS = 3
# A table is sorted if one of its columns never decreases, although another one does before the largest force. All
# three numbers are in units of the range of this other column. Only decreases larger than the first number count. Their
# sum must be larger than the second number plus, because of noise, the third number times the number of points.
_DECREASE, _DECREASES, _BY_NOISE = 0.07, 0.2, 0.005
# Number of neighbours of a median; least rise of these medians in a second loading, as a share of the range of
# the forces, and in units of the median distance of the points from them.
_MEDIAN, _RISE, _CLEAR_RISE = 5, 0.15, 10.0
# A contact is clearly larger if the difference is more than this share of the range; noise also makes differences.
_CLEARLY = 0.2
# In a reversed test, contact radii of loading exceed those of unloading at equal force: in the median by more than this
# share of the largest radius.
_REVERSED = 0.05
# Largest number of points that a message names.
_NAMED = 5


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
    """Read the points of a JKR test; arguments as in `icha.fit_jkr_test`.

    Raises
    ------
    ValueError
        If a column is missing, a unit is missing or wrong, or a value is not a finite number.
    """
    for name, given, known in (("columns", columns, _HEADINGS), ("units", units, _UNITS)):
        if unknown := [key for key in given if key not in known]:
            raise ValueError(f"{name}: {unknown[0]!r} is not a quantity; expected one of {', '.join(known)}")
    from_file = isinstance(table, str | os.PathLike)
    if from_file:
        headings, rows = read_table(table)
        places, lists = [f"line {number}" for number, _ in rows], zip(*(row for _, row in rows), strict=True)
    elif hasattr(table, "items"):
        headings, lists = zip(*((str(title), list(values)) for title, values in table.items()), strict=True)
        places = [f"point {k}" for k in range(1, 1 + len(lists[0]))]
    else:
        raise ValueError(f"{type(table).__name__} is not a table; expected a path, a mapping or a data frame")
    by_title, found = dict(zip(headings, lists, strict=True)), _find_columns(headings, columns)
    titles = {name: title for name, title in found.items() if name in _UNITS}
    factors = [_factor(title, name, units.get(name), from_file) for name, title in titles.items()]
    if from_file:
        at = {headings.index(title): repr(title) for title in titles.values()}
        signed = {headings.index(title) for name, title in titles.items() if name != "contact_radius"}
        numbers = numbers_of(rows, at, FloatRange(least=0), signed)
    else:
        numbers = [np.asarray(by_title[title]) for title in titles.values()]
        for title, array in zip(titles.values(), numbers, strict=True):
            is_list = array.size and array.shape == (len(places),) and array.dtype.kind in "fiu"
            if not is_list or not np.isfinite(array).all():
                raise ValueError(f"column {title!r}: expected a list of {len(places) or 'several'} finite numbers")
    for title, array in zip(titles.values(), numbers, strict=True):
        size = np.abs(array)
        largest = int(np.argmax(size))
        if size[largest] > _FAR * max(size[size < size[largest]], default=math.inf):
            raise ValueError(
                f"column {title!r}, {places[largest]}: {array[largest]:.6g} is more than {_FAR} times every other "
                "number; expected measured values. Correct or remove the points that mark missing values by it"
            )
    unloading = None
    if title := found.get("branch"):
        texts = [str(text).strip().lower() for text in by_title[title]]
        for place, text in zip(places, texts, strict=True):
            if text not in _LOADING + _UNLOADING:
                raise ValueError(f"column {title!r}, {place}: {text[:40]!r}; {_BRANCH}")
        unloading = np.isin(texts, _UNLOADING)
    for title, array in zip(titles.values(), numbers, strict=True) if unloading is None else ():
        if (far := _spikes(array)).size:
            raise ValueError(f"column {title!r}: {far_from_the_rest([(places[k], f'{array[k]:.6g}') for k in far])}")
    values = {name: array * factor for name, array, factor in zip(titles, numbers, factors, strict=True)}
    return Points(values, unloading, places)


def _spikes(values):
    """Return the indices of single points that lie far from the points before and after them."""
    if len(values) < 4 * _NEIGHBOURS:
        return np.array([], int)
    middle, ends = median_filter(values, _NEIGHBOURS), _NEIGHBOURS // 2
    distance = np.abs(values - middle)[ends:-ends]
    return ends + np.flatnonzero(distance > max(_SPIKE * np.ptp(middle), _USUAL_SPIKES * np.median(distance)))


def far_from_the_rest(points: Sequence[tuple[str, str]]) -> str:
    """Return the message about points, each with its place and its values, that are far from all others."""
    named = ", ".join(f"{place} ({value})" for place, value in points[:_NAMED]) + ", ..." * (len(points) > _NAMED)
    count = "is one point that lies" if len(points) == 1 else f"are {len(points)} points that lie"
    return f"there {count} far from the others: {named}; expected points of one curve. Correct or remove these points"


def _find_columns(headings, columns):
    """Return the heading of each quantity; raise ValueError if a needed column is missing, or if several fit."""
    listed, found = ", ".join(headings), dict(columns)
    for name in _HEADINGS.keys() - columns.keys():
        start = re.compile(rf"(?:{_HEADINGS[name]})(?![^\W\d_])")
        fitting = [each for each in headings if start.match(unicodedata.normalize("NFKC", each).strip().lower())]
        if len(fitting) > 1:
            raise ValueError(f"has several columns for {name}: {', '.join(fitting)}; choose one with `columns`")
        found |= dict.fromkeys([name], *fitting) if fitting else {}
    for title in found.values():
        if headings.count(title) != 1:
            raise ValueError(f"has {headings.count(title) or 'no'} column {title!r}; expected one of {listed}")
    if "force" not in found or not {"contact_radius", "indentation"} & found.keys():
        missing = "force" if "force" not in found else "contact radius or indentation"
        raise ValueError(
            f"has no column for {missing} among {listed}; expected headings such as force (mN) and contact radius (um) "
            "or indentation (um). Name other headings with `columns`"
        )
    return {name: found[name] for name in _HEADINGS if name in found}


def _factor(title, name, unit, from_file):
    """Return the factor from the numbers of a column to SI units."""
    si_unit, example = _UNITS[name]
    stated = stated_unit(title)
    unit = unit or (stated.text if stated else "" if from_file else si_unit)
    if not unit:
        others = bracketed_texts(title)
        stated_text = f"{others[0]!r} is not a unit of {PHYSICAL_NAMES[si_unit]}" if others else "the unit is missing"
        raise ValueError(
            f"column {title!r}: {stated_text}; expected a unit of {PHYSICAL_NAMES[si_unit]} in the heading, such "
            f"as '{name.replace('_', ' ')} ({example})', or in `units`"
        )
    try:
        factor = float(conversion_factor(unit, si_unit))
    except ValueError as error:
        raise ValueError(f"column {title!r}: {error}; expected a unit such as {example}") from None
    if other := contradicting_unit(title, unit, si_unit):
        raise ValueError(f"column {title!r}: the unit is {unit!r}, but the heading states {other!r}; expected the same")
    if problem := problem_with_numbers(title, unit, si_unit) or problem_with_words(title, name):
        raise ValueError(f"column {title!r} {problem}")
    return factor


def refuse_wrong_signs(values: Mapping[str, np.ndarray], places: Sequence[str]) -> None:
    """Raise ValueError if forces are not positive in compression, or indentations not towards the sample.

    Arguments as in `Points`.
    """
    force, contact = values["force"], values.get("contact_radius")
    top, bottom = int(np.argmax(force)), int(np.argmin(force))
    size = values["indentation"] if contact is None else contact
    grows = size[bottom] - size[top] > _CLEARLY * np.ptp(size)
    if not force[top] > 0 or (grows and force[top] < -force[bottom]):
        raise ValueError(
            f"{places[bottom]}, the smallest force, looks like the largest load; expected forces that are positive in "
            "compression. Change the sign of the forces"
        )
    if "indentation" in values and values["indentation"][bottom] > values["indentation"][top]:
        raise ValueError(
            f"{places[bottom]}, the smallest force, has a larger indentation than {places[top]}, the largest force; "
            "expected indentations that are positive towards the sample. Change the sign of the indentations"
        )


def refuse_lost_order(values: Mapping[str, np.ndarray], places: Sequence[str]) -> None:
    """Raise ValueError if points are not those of one loading and one unloading in the order of the test.

    Arguments as in `Points`.
    """
    force = values["force"]
    top = int(np.argmax(force))
    if column := _sorted_column(values, top):
        raise ValueError(
            f"is sorted by {column}, so neighbouring points jump between loading and unloading; expected the points "
            "in the order of the test. Restore this order; `icha jkr` also takes a column `branch`"
        )
    if (again := _second_loading(force)) is not None:
        raise ValueError(
            f"{places[again]}: the force rises for the second time; expected one loading and one unloading. Select the "
            f"points of one cycle, and check the largest force, {places[top]}"
        )
    if (contact := values.get("contact_radius")) is not None:
        order = np.argsort(force[: top + 1])
        before = np.interp(force[top:], force[order], contact[order], left=np.nan, right=np.nan)
        growth = (contact[top:] - before)[np.isfinite(before)]
        if growth.size >= LEAST_POINTS and np.median(growth) < -_REVERSED * contact.max():
            raise ValueError(
                "has larger contact radii before the largest force than after it, at equal force; expected the points "
                "in the order of the test. They are probably in the reverse order"
            )


def _sorted_column(values, top):
    """Return the column by which a table is sorted, so that the order of the test is lost; None without one."""
    steps = {name: np.diff(column) / (np.ptp(column) or 1.0) for name, column in values.items()}
    decreases = [each[:top][each[:top] < -_DECREASE] for each in steps.values()]
    is_lost = any(len(each) > 1 and -each.sum() > _DECREASES + _BY_NOISE * top for each in decreases)
    return next((name for name, each in steps.items() if is_lost and (each >= 0).all()), None)


def _second_loading(force):
    """Return the first point of a second loading; None without one.

    It has more than half the largest force; or, after this force, medians of neighbours rise by much more than noise to
    a force in compression.
    """
    high, low = force > 0.5 * force.max(), force < 0.25 * force.max()
    end = np.argmax(high) + np.flatnonzero(low[np.argmax(high) :])
    again = end[0] + np.flatnonzero(high[end[0] :]) if end.size else end
    if not again.size:
        middle, top = median_filter(force, _MEDIAN), int(np.argmax(force))
        clear = max(_RISE * np.ptp(force), _CLEAR_RISE * float(np.median(np.abs(force - middle))))
        rise = middle[top:] - np.minimum.accumulate(middle[top:])
        again = top + np.flatnonzero((rise > clear) & (middle[top:] > clear))
    return int(again[0]) if again.size else None
