"""Compare the results of a deposit with those of a rerun, variable by variable.

With the same program, environment and kind of processor, the files of a rerun are identical byte for byte. On another
processor, the last digits of sums and Fourier transforms differ, and these differences grow in later computations.
Therefore numbers count as equal within a tolerance. Everything else must be equal: integers, text, positions of missing
values, dimensions, types, attributes. Storage (chunks, compression, order in the file) is not compared.
"""

import os
import textwrap
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import netCDF4
import numpy as np

from icha.checks.run import FRONT_LIMIT, RESIDUAL_LIMIT
from icha.deposit.verify import COMPUTED, files_of
from icha.support.checksums import sha256_of
from icha.support.formatting import format_count, printable
from icha.support.input_files import refuse_traps

IDENTICAL, WITHIN, DIFFERENT = "identical", "within tolerance", "different"
# Largest difference of two equal numbers, divided by the larger number. Numbers smaller than `FLOOR` times the largest
# number of the variable are divided by this limit instead: they are often differences of large numbers, and then have
# the absolute error of the large ones.
TOLERANCE, FLOOR = 1e-6, 1e-6
# Largest absolute differences within tolerance, by variable: all digits of a residual are rounding errors.
NOISE = {"residual": RESIDUAL_LIMIT, "gap_residual": RESIDUAL_LIMIT, "front_residual": FRONT_LIMIT}
# Endings of files that only show results of other files. Their differences count as remarks, because other machines
# have other fonts and libraries.
_DERIVED = (".png", ".pdf", ".html", "checks.json")
# Largest number of variables that the text of a comparison lists.
_MOST_LINES = 20
# Largest number of characters of an error or a value in a message.
_LONGEST = 100


class Difference(NamedTuple):
    """A difference between a file of the deposit and the same file of the rerun.

    Attributes
    ----------
    path : path of the file.
    name : name of the variable or group that differs; "" if the file as a whole differs.
    verdict : `WITHIN` or `DIFFERENT`.
    detail : description of the difference; first the value in the deposit, then the value in the rerun.
    deviation : largest relative difference of the numbers; infinite if something else differs.
    """

    path: str
    name: str
    verdict: str
    detail: str
    deviation: float = np.inf

    @property
    def is_remark(self) -> bool:
        """True if the file only shows results of other files, like a figure, and both folders have the file."""
        return self.path.endswith(_DERIVED) and not self.detail.startswith("only in")


class Comparison(NamedTuple):
    """Paths of all compared files, and their differences."""

    files: tuple[str, ...]
    differences: tuple[Difference, ...]

    @property
    def verdict(self) -> str:
        """Verdict on all files: `IDENTICAL`, `WITHIN` or `DIFFERENT`; remarks do not count as different."""
        if any(each.verdict == DIFFERENT and not each.is_remark for each in self.differences):
            return DIFFERENT
        return WITHIN if self.differences else IDENTICAL


def compare_folders(
    deposit: str | os.PathLike, rerun: str | os.PathLike, paths: Iterable[str] | None = None
) -> Comparison:
    """Compare the results in two folders: all computed files, or only `paths`, which are relative to both folders."""
    deposit, rerun = Path(deposit), Path(rerun)
    if paths is None:
        paths = {path for folder in (deposit, rerun) for path in files_of(folder) if path.split("/")[0] in COMPUTED}
    files, differences = tuple(sorted(paths)), []
    for path in files:
        try:
            differences += [Difference(path, *each) for each in _compare_files(deposit / path, rerun / path)]
        except Exception as error:  # a file of unknown origin may cause any error
            reason = textwrap.shorten(repr(error), _LONGEST, placeholder=" …")
            differences.append(Difference(path, "", DIFFERENT, f"cannot be compared: {reason}"))
    return Comparison(files, tuple(differences))


def _compare_files(deposit: Path, rerun: Path) -> Iterator[tuple]:
    """Yield the fields of the differences between two files, without the path."""
    if not deposit.is_file() or not rerun.is_file():
        yield "", DIFFERENT, f"only in the {'rerun' if rerun.is_file() else 'deposit'}"
    elif sha256_of(deposit) == sha256_of(rerun):
        return
    elif deposit.suffix == ".nc":
        for file in (deposit, rerun):
            refuse_traps(file)
        with netCDF4.Dataset(deposit) as a, netCDF4.Dataset(rerun) as b:
            for each in _paired(dict(_members(a)), dict(_members(b))):
                yield from _compare_members(*each)
    else:
        yield "", DIFFERENT, "the bytes differ"


def _members(group: netCDF4.Dataset, path: str = "") -> Iterator[tuple[str, netCDF4.Dataset | netCDF4.Variable]]:
    """Yield a group of a netCDF file, its variables, and the same for all groups inside, with their paths."""
    yield f"{path}/ (group)", group
    yield from ((f"{path}/{name}", variable) for name, variable in group.variables.items())
    for name, inner in group.groups.items():
        yield from _members(inner, f"{path}/{name}")


def _paired(a: Mapping, b: Mapping) -> Iterator[tuple]:
    """Yield each key of two mappings with the value in each mapping; None stands for a missing value."""
    return ((key, a.get(key), b.get(key)) for key in dict.fromkeys([*a, *b]))


def _compare_members(name: str, a, b) -> Iterator[tuple]:
    """Compare two variables or groups with the same path; None stands for a missing one."""
    if a is None or b is None:
        yield name, DIFFERENT, f"only in the {'rerun' if a is None else 'deposit'}"
        return
    if isinstance(a, netCDF4.Variable):
        for quantity in ("dtype", "dimensions", "shape"):
            one, other = getattr(a, quantity), getattr(b, quantity)
            if one != other:
                yield name, DIFFERENT, f"{quantity}: {_shown(one)} and {_shown(other)}"
                return
        if found := compare_values(_values(a), _values(b), noise=NOISE.get(name.rpartition("/")[2], 0.0)):
            yield name, *found
    for key, one, other in _paired(*({key: each.getncattr(key) for key in each.ncattrs()} for each in (a, b))):
        if type(one) is not type(other) or not np.array_equal(one, other):
            yield name, DIFFERENT, f"attribute {key}: {_shown(one)} and {_shown(other)}"


def _values(variable: netCDF4.Variable) -> np.ndarray:
    """Return the values of a variable in a file, with NaN for missing numbers."""
    variable.set_auto_maskandscale(False)
    values = np.asarray(variable[...])
    if values.dtype.kind == "f":
        fill = getattr(variable, "_FillValue", netCDF4.default_fillvals[values.dtype.str[1:]])
        values = np.where(values == fill, np.nan, values)
    return values


def compare_values(a: np.ndarray, b: np.ndarray, *, noise: float = 0.0) -> tuple[str, str, float] | None:
    """Compare two arrays of the same shape and type; NaN stands for a missing value.

    `noise` is the largest absolute difference that is within tolerance for values of any size. Return verdict,
    description and largest relative deviation; None if the arrays are identical.
    """
    is_number = a.dtype.kind == "f"
    unequal = np.isnan(a) != np.isnan(b) if is_number else np.asarray(a != b)
    if unequal.any():
        text = "missing in other places" if is_number else "not equal"
        count = f"{np.count_nonzero(unequal)} of {unequal.size}"
        return DIFFERENT, f"{text}: {count}, first {_place(a, b, np.argmax(unequal))}", np.inf
    if not is_number or np.array_equal(a, b, equal_nan=True):
        return None
    missing = np.isnan(a)
    size = np.where(missing, 0.0, np.maximum(abs(a), abs(b)))
    largest = np.max(size, where=np.isfinite(size), initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        deviation = np.asarray(abs(a - b) / np.maximum(size, max(FLOOR * largest, noise / TOLERANCE)))
    deviation[missing | (a == b)] = 0.0
    deviation[np.isnan(deviation)] = np.inf  # one value is infinite, or both are infinite with opposite signs
    most = float(deviation.max())
    detail = f"largest relative deviation {most:.2g}, {_place(a, b, np.argmax(deviation))}"
    if most <= TOLERANCE:
        return WITHIN, detail, most
    return DIFFERENT, f"{detail}; {np.count_nonzero(deviation > TOLERANCE)} of {deviation.size} values", most


def _place(a: np.ndarray, b: np.ndarray, position: int) -> str:
    index = ", ".join(str(k) for k in np.unravel_index(position, a.shape))
    return (f"at [{index}]: " if index else "") + f"{_shown(a.flat[position])} and {_shown(b.flat[position])}"


def _shown(value: object) -> str:
    value = value.item() if isinstance(value, np.ndarray | np.generic) and value.size == 1 else value
    return textwrap.shorten(repr(value), _LONGEST, placeholder=" …")


def format_comparison(comparison: Comparison) -> str:
    """Return the comparison as text, with one line for each variable that is not identical, the largest first.

    The text lists at most `_MOST_LINES` variables that differ, and at most `_MOST_LINES` variables within tolerance.
    """
    grouped: dict[tuple[str, str], list[Difference]] = defaultdict(list)
    for each in comparison.differences:
        place = f"{each.path.split('/')[0]}: {each.name.lstrip('/')}" if each.name else each.path
        grouped[each.verdict, place].append(each)
    text = []
    for verdict in (DIFFERENT, WITHIN):
        found = [(max(group, key=lambda each: each.deviation), key, len(group)) for key, group in grouped.items()]
        found = sorted((each for each in found if each[1][0] == verdict), key=lambda each: -each[0].deviation)
        for worst, (_, place), count in found[:_MOST_LINES]:
            files = worst.path if count == 1 else f"{count} files, the largest in {worst.path}"
            text.append(printable(f"{place}: {verdict}, {worst.detail} ({files})"))
        text += [f"… and {len(found) - _MOST_LINES} more"] if len(found) > _MOST_LINES else []
    same = len(set(comparison.files) - {each.path for each in comparison.differences})
    text.append(f"{format_count(same, 'file')} of {len(comparison.files)}: every variable is identical")
    if any(each.is_remark for each in comparison.differences):
        text.append("Figures, pages and checks are made from the data; if only these files differ, nothing is wrong.")
    return "\n".join(text)
