"""Compare the results of a deposit with those of a rerun, variable by variable.

With the same program, environment and kind of processor, the files of a rerun are identical byte for byte. On another
processor, the last digits of sums and Fourier transforms differ, and these differences grow in later computations.
Therefore two numbers count as equal within a tolerance:

- Two numbers are equal if their difference is at most `TOLERANCE` times the larger number.
- Two values smaller than `FLOOR` times the largest value of the variable are equal if their difference is at most
  `TOLERANCE` times `FLOOR` times this largest value. A value near zero is often a difference of large values, and then
  has the absolute error of the large values.
- Two residuals of a solver are equal if they differ by at most the largest residual that the solver accepts (`NOISE`),
  because all digits of a residual are rounding errors.

Everything else must be equal: integers, text, positions of missing values, dimensions, types, attributes. Storage
(chunks, compression, order in the file) is not compared. Figures and the report show the compared values. Figures may
differ because other machines have other fonts and libraries. If only figures or the report differ, the comparison
prints a remark, and the results still count as reproduced.
"""

import os
import textwrap
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import netCDF4
import numpy as np

from icha.checks.run import FRONT_LIMIT, RESIDUAL_LIMIT
from icha.deposit.verify import COMPUTED, files_of
from icha.support.checksums import sha256_of
from icha.support.formatting import printable
from icha.support.input_files import refuse_traps

VERDICTS = ("identical", "within tolerance", "different", "missing", "extra")
IDENTICAL, WITHIN, DIFFERENT, MISSING, EXTRA = VERDICTS
TOLERANCE = 1e-6
FLOOR = 1e-6
# Largest absolute differences that are within tolerance, by the name of the variable.
NOISE = {"residual": RESIDUAL_LIMIT, "gap_residual": RESIDUAL_LIMIT, "front_residual": FRONT_LIMIT}
# Endings of the names of files that are made from the data. Differences between these files count only as remarks.
_DERIVED = (".png", ".pdf", ".html", "checks.json")
# Largest number of variables that the text of a comparison lists.
_MOST_LINES = 20
# Largest number of characters of an error, and of a value, in a message.
_LONGEST_ERROR, _LONGEST_VALUE = 300, 60


class Difference(NamedTuple):
    """A difference between a file of the deposit and the same file of the rerun.

    Attributes
    ----------
    name : name of the variable, group or dimension that differs; "" if the file as a whole differs.
    verdict : one of `VERDICTS` except `identical`.
    detail : description of the difference; first the value in the deposit, then the value in the rerun.
    deviation : largest relative difference of the numbers; infinite if something else differs.
    """

    name: str
    verdict: str
    detail: str
    deviation: float = np.inf


class File(NamedTuple):
    """A file of the results, and its differences between deposit and rerun."""

    path: str
    differences: tuple[Difference, ...]

    @property
    def verdict(self) -> str:
        """Verdict on the whole file, one of `VERDICTS`."""
        verdicts = {each.verdict for each in self.differences}
        if self.differences and not self.differences[0].name:
            return self.differences[0].verdict
        return DIFFERENT if verdicts - {WITHIN} else WITHIN if verdicts else IDENTICAL

    @property
    def kind(self) -> str:
        """First folder in the path of the file, such as `runs`."""
        return self.path.partition("/")[0]

    @property
    def is_remark(self) -> bool:
        """True if the file only shows results of other files, like a figure, and differs from the file of the rerun."""
        return self.verdict == DIFFERENT and self.path.endswith(_DERIVED)


class Comparison(NamedTuple):
    """Comparison of all files of a deposit with those of a rerun, sorted by path."""

    files: tuple[File, ...]

    @property
    def verdict(self) -> str:
        """Verdict on all files: `identical`, `within tolerance` or `different`; remarks do not count."""
        if any(file.verdict in (DIFFERENT, MISSING, EXTRA) and not file.is_remark for file in self.files):
            return DIFFERENT
        return IDENTICAL if all(file.verdict == IDENTICAL for file in self.files) else WITHIN


def compare_folders(
    deposit: str | os.PathLike, rerun: str | os.PathLike, paths: Iterable[str] | None = None
) -> Comparison:
    """Compare the results in two folders.

    Parameters
    ----------
    deposit, rerun : folders of results, which contain `dataset/`, `runs/`, ….
    paths : files to compare, relative to both folders. Default: all computed files (`COMPUTED`).
    """
    deposit, rerun = Path(deposit), Path(rerun)
    if paths is None:
        paths = {path for folder in (deposit, rerun) for path in files_of(folder) if path.split("/")[0] in COMPUTED}
    return Comparison(tuple(_compare_files(deposit / path, rerun / path, path) for path in sorted(paths)))


def _compare_files(deposit: Path, rerun: Path, path: str) -> File:
    """Compare a file in two folders; a file that cannot be read counts as different."""
    try:
        return File(path, tuple(_differences(deposit, rerun)))
    except Exception as error:  # a file of unknown origin may cause any error
        reason = textwrap.shorten(repr(error), _LONGEST_ERROR, placeholder=" …")
        return File(path, (Difference("", DIFFERENT, f"cannot be compared: {reason}"),))


def _differences(deposit: Path, rerun: Path) -> Iterator[Difference]:
    if not deposit.is_file():
        yield Difference("", EXTRA, "the deposit has no such file")
    elif not rerun.is_file():
        yield Difference("", MISSING, "the rerun has no such file")
    elif sha256_of(deposit) == sha256_of(rerun):
        return
    elif deposit.suffix == ".nc":
        for file in (deposit, rerun):
            refuse_traps(file)
        with netCDF4.Dataset(deposit) as a, netCDF4.Dataset(rerun) as b:
            yield from _compare_groups(a, b, "")
    else:
        yield Difference("", DIFFERENT, "the bytes differ")


def _compare_groups(a: netCDF4.Dataset, b: netCDF4.Dataset, path: str) -> Iterator[Difference]:
    """Yield the differences between two groups of netCDF files, including the groups inside them."""
    yield from _compare_attributes(a, b, f"{path}/ (attributes)")
    sizes_a, sizes_b = ({name: len(dim) for name, dim in group.dimensions.items()} for group in (a, b))
    for name, size, other in _paired(sizes_a, sizes_b):
        if size != other:
            yield Difference(f"{path}/{name} (dimension)", DIFFERENT, f"size: {size} and {other}")
    for compare, members, kind in ((_compare_variables, "variables", ""), (_compare_groups, "groups", " (group)")):
        for name, one, other in _paired(getattr(a, members), getattr(b, members)):
            if one is None:
                yield Difference(f"{path}/{name}{kind}", EXTRA, "only in the rerun")
            elif other is None:
                yield Difference(f"{path}/{name}{kind}", MISSING, "only in the deposit")
            else:
                yield from compare(one, other, f"{path}/{name}")


def _paired(a: Mapping, b: Mapping) -> Iterator[tuple]:
    """Yield each key of two mappings with the value in each mapping; None stands for a missing value."""
    return ((key, a.get(key), b.get(key)) for key in dict.fromkeys([*a, *b]))


def _compare_variables(a: netCDF4.Variable, b: netCDF4.Variable, name: str) -> Iterator[Difference]:
    for quantity in ("dtype", "dimensions", "shape"):
        one, other = getattr(a, quantity), getattr(b, quantity)
        if one != other:
            yield Difference(name, DIFFERENT, f"{quantity}: {_shown(one)} and {_shown(other)}")
            return
    noise = NOISE.get(name.rpartition("/")[2], 0.0)
    found = compare_values(_values(a), _values(b), noise=noise)
    if found:
        yield found._replace(name=name)
    yield from _compare_attributes(a, b, name)


def _values(variable: netCDF4.Variable) -> np.ndarray:
    """Return the values of a variable in a file, with NaN for missing numbers."""
    variable.set_auto_maskandscale(False)
    values = np.asarray(variable[...])
    if values.dtype.kind == "f":
        fill = getattr(variable, "_FillValue", netCDF4.default_fillvals[values.dtype.str[1:]])
        values = np.where(values == fill, np.nan, values)
    return values


def _compare_attributes(a, b, name: str) -> Iterator[Difference]:
    for key, one, other in _paired(*({key: each.getncattr(key) for key in each.ncattrs()} for each in (a, b))):
        if type(one) is not type(other) or not np.array_equal(one, other):
            yield Difference(name, DIFFERENT, f"attribute {key}: {_shown(one)} and {_shown(other)}")


def compare_values(a: np.ndarray, b: np.ndarray, *, noise: float = 0.0) -> Difference | None:
    """Compare two arrays of the same shape and type; return the difference, or None if the arrays are identical.

    Parameters
    ----------
    a, b : values in the deposit and in the rerun; NaN stands for a missing value.
    noise : largest absolute difference that is within tolerance for values of any size.
    """
    if a.dtype.kind != "f":
        unequal = np.asarray(a != b)
        return Difference("", DIFFERENT, f"not equal: {_places(a, b, unequal)}") if unequal.any() else None
    missing = np.isnan(a)
    if (missing != np.isnan(b)).any():
        return Difference("", DIFFERENT, f"missing in other places: {_places(a, b, missing != np.isnan(b))}")
    if np.array_equal(a, b, equal_nan=True):
        return None
    size = np.where(missing, 0.0, np.maximum(abs(a), abs(b)))
    largest = np.max(size, where=np.isfinite(size), initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        deviation = np.asarray(abs(a - b) / np.maximum(size, max(FLOOR * largest, noise / TOLERANCE)))
    deviation[missing | (a == b)] = 0.0
    deviation[np.isnan(deviation)] = np.inf  # one value is infinite, or both are infinite with opposite signs
    most = float(deviation.max())
    detail = f"largest relative deviation {most:.2g}, {_place(a, b, np.argmax(deviation))}"
    if most <= TOLERANCE:
        return Difference("", WITHIN, detail, most)
    count = np.count_nonzero(deviation > TOLERANCE)
    return Difference("", DIFFERENT, f"{detail}; {count} of {deviation.size} values", most)


def _places(a: np.ndarray, b: np.ndarray, where: np.ndarray) -> str:
    return f"{np.count_nonzero(where)} of {where.size}, first {_place(a, b, np.argmax(where))}"


def _place(a: np.ndarray, b: np.ndarray, position: int) -> str:
    index = ", ".join(str(k) for k in np.unravel_index(position, a.shape))
    return (f"at [{index}]: " if index else "") + f"{_shown(a.flat[position])} and {_shown(b.flat[position])}"


def _shown(value: object) -> str:
    value = value.item() if isinstance(value, np.ndarray | np.generic) and value.size == 1 else value
    return textwrap.shorten(repr(value), _LONGEST_VALUE, placeholder=" …")


def format_comparison(comparison: Comparison) -> str:
    """Return the comparison as text, with one line for each kind of file, and for each variable that is not identical.

    The largest deviations come first. The text lists at most `_MOST_LINES` variables that differ, and at most
    `_MOST_LINES` variables within tolerance.
    """
    kinds = sorted({file.kind for file in comparison.files}, key=COMPUTED.index)
    width = max(map(len, kinds), default=0)
    verdicts = [each for each in VERDICTS if any(file.verdict == each for file in comparison.files)]
    text = [" ".join([" " * width, "  files", *(f" {each}" for each in verdicts)])]
    for kind in kinds:
        counts = Counter(file.verdict for file in comparison.files if file.kind == kind)
        columns = [f" {counts[each] or '':>{len(each)}}" for each in verdicts]
        text.append(" ".join([f"{kind:<{width}}", f"{counts.total():>7}", *columns]).rstrip())
    for within in (False, True):
        found = _lines(comparison, within)
        text += [printable(line) for line in found[:_MOST_LINES]]
        if len(found) > _MOST_LINES:
            text.append(f"… and {len(found) - _MOST_LINES} more")
    if any(file.is_remark for file in comparison.files):
        text.append("Figures, pages and checks are made from the data; if only these files differ, nothing is wrong.")
    return "\n".join(text)


def _lines(comparison: Comparison, within: bool) -> list[str]:
    """Return one line for each unequal variable: those within tolerance if `within` is True, else the others."""
    grouped = defaultdict(list)
    for file in comparison.files:
        for each in file.differences:
            if (each.verdict == WITHIN) == within:
                place = f"{file.kind}: {each.name.lstrip('/')}" if each.name else file.path
                grouped[place, each.verdict].append((each.deviation, each.detail, file.path))
    lines = []
    for (place, verdict), found in grouped.items():
        deviation, detail, path = max(found)
        files = path if len(found) == 1 else f"{len(found)} files, the largest in {path}"
        lines.append((-deviation, f"{place}: {verdict}, {detail}" + (f" ({files})" if place != path else "")))
    return [line for _, line in sorted(lines)]
