"""Compare the results of a deposit with those of a rerun, variable by variable.

With the same program, environment and kind of processor, a rerun has the same bytes. On another processor the last
digits of sums and transforms differ, and the differences grow in what is computed from them. Therefore two numbers are
the same within tolerance if they differ by at most `TOLERANCE` of the larger one. Where a quantity passes through zero,
its last digits are those of the larger values of which it is the difference; therefore values below `FLOOR` of the
variable's largest count as that large. The residual of a solver is not known to any digit: two residuals are the same
within tolerance if they differ by at most what is allowed of one (`NOISE`).

Everything else has to be equal: integers, text, places of missing values, dimensions, types, attributes. Storage
(chunks, compression, order in the file) is not compared. Figures and the report are drawn from what is compared here,
with libraries and fonts that may differ; if only they differ, that is a remark.
"""

import json
import os
import textwrap
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import netCDF4
import numpy as np

from icha.checks.run import FRONT_LIMIT, RESIDUAL_LIMIT
from icha.deposit.verify import COMPUTED, files_of
from icha.support.atomic_files import whole_file
from icha.support.checksums import sha256_of
from icha.support.formatting import printable
from icha.support.input_files import refuse_traps

IDENTICAL, WITHIN, DIFFERENT, MISSING, EXTRA = VERDICTS = (
    "identical",
    "within tolerance",
    "different",
    "missing",
    "extra",
)
TOLERANCE = 1e-6
FLOOR = 1e-6
# Allowed differences of the variables with these names.
NOISE = {"residual": RESIDUAL_LIMIT, "gap_residual": RESIDUAL_LIMIT, "front_residual": FRONT_LIMIT}
# Endings of files that are made from the data.
_DERIVED = (".png", ".pdf", ".html", "checks.json")
# Longest text of an error and of a value, in characters.
_LONGEST_ERROR, _LONGEST_VALUE = 300, 60


class Difference(NamedTuple):
    """A difference between two files.

    Attributes
    ----------
    name : the variable, group or dimension; empty if it is about the file as a whole.
    verdict : one of `VERDICTS` but the first.
    detail : what differs, with the deposit's value first.
    deviation : largest relative difference of numbers; infinite where something else differs.
    """

    name: str
    verdict: str
    detail: str
    deviation: float = np.inf


class File(NamedTuple):
    """A file of the results and its differences."""

    path: str
    differences: tuple[Difference, ...]

    @property
    def verdict(self) -> str:
        """One of `VERDICTS`."""
        verdicts = {each.verdict for each in self.differences}
        if self.differences and not self.differences[0].name:
            return self.differences[0].verdict
        return DIFFERENT if verdicts - {WITHIN} else WITHIN if verdicts else IDENTICAL

    @property
    def kind(self) -> str:
        """The part of the results that it belongs to, such as `runs`."""
        return self.path.partition("/")[0]

    @property
    def is_remark(self) -> bool:
        """True for a file that is made from the data and only differs in its bytes."""
        return self.verdict == DIFFERENT and self.path.endswith(_DERIVED)


class Comparison(NamedTuple):
    """All files, sorted by path."""

    files: tuple[File, ...]

    @property
    def verdict(self) -> str:
        """`identical`, `within tolerance` or `different`, without regard to remarks."""
        if any(file.verdict in (DIFFERENT, MISSING, EXTRA) and not file.is_remark for file in self.files):
            return DIFFERENT
        return IDENTICAL if all(file.verdict == IDENTICAL for file in self.files) else WITHIN


def compare_folders(
    deposit: str | os.PathLike, rerun: str | os.PathLike, paths: Iterable[str] | None = None
) -> Comparison:
    """Compare the results in two folders.

    Parameters
    ----------
    deposit, rerun : folders with `dataset/`, `runs/`, … in them.
    paths : the files to compare, relative to both; if left out, everything computed (`COMPUTED`) in either folder.
    """
    deposit, rerun = Path(deposit), Path(rerun)
    if paths is None:
        paths = {path for folder in (deposit, rerun) for path in files_of(folder) if path.split("/")[0] in COMPUTED}
    return Comparison(tuple(_compare_files(deposit / path, rerun / path, path) for path in sorted(paths)))


def _compare_files(deposit: Path, rerun: Path, path: str) -> File:
    """Compare two files; one that cannot be read is different."""
    try:
        return File(path, tuple(_differences(deposit, rerun)))
    except Exception as error:  # whatever the content of a file may lead to
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
        yield Difference("", DIFFERENT, "other bytes")


def _compare_groups(a: netCDF4.Dataset, b: netCDF4.Dataset, path: str) -> Iterator[Difference]:
    """Compare two groups and the groups in them."""
    yield from _compare_attributes(a, b, f"{path}/ (attributes)")
    sizes_a, sizes_b = ({name: len(dim) for name, dim in group.dimensions.items()} for group in (a, b))
    for name in dict.fromkeys([*sizes_a, *sizes_b]):
        if sizes_a.get(name) != sizes_b.get(name):
            detail = f"size: {sizes_a.get(name, 'none')} and {sizes_b.get(name, 'none')}"
            yield Difference(f"{path}/{name} (dimension)", DIFFERENT, detail)
    for name, one, other in _paired(a.variables, b.variables):
        yield from _compare_variables(one, other, f"{path}/{name}")
    for name, one, other in _paired(a.groups, b.groups):
        if one is None or other is None:
            yield _only_in_one(f"{path}/{name} (group)", one)
        else:
            yield from _compare_groups(one, other, f"{path}/{name}")


def _paired(a, b) -> Iterator[tuple]:
    """Keys of two mappings with the values of both; None where there is no value."""
    return ((key, a.get(key), b.get(key)) for key in dict.fromkeys([*a, *b]))


def _only_in_one(name: str, of_deposit) -> Difference:
    if of_deposit is None:
        return Difference(name, EXTRA, "the deposit has none")
    return Difference(name, MISSING, "the rerun has none")


def _compare_variables(a: netCDF4.Variable | None, b: netCDF4.Variable | None, name: str) -> Iterator[Difference]:
    if a is None or b is None:
        yield _only_in_one(name, a)
        return
    for what, one, other in (
        ("type", *("text" if each.dtype is str else str(each.dtype) for each in (a, b))),
        ("dimensions", a.dimensions, b.dimensions),
        ("shape", a.shape, b.shape),
    ):
        if one != other:
            yield Difference(name, DIFFERENT, f"{what}: {_shown(one)} and {_shown(other)}")
            return
    for variable in (a, b):
        variable.set_auto_scale(False)
        variable.set_auto_chartostring(False)
    found = compare_values(a[...], b[...], noise=NOISE.get(name.rpartition("/")[2], 0.0))
    if found:
        yield found._replace(name=name)
    yield from _compare_attributes(a, b, name)


def _compare_attributes(a, b, name: str) -> Iterator[Difference]:
    """Compare the attributes of two variables or groups, numbers among them as those of variables."""
    for key, one, other in _paired(*({key: each.getncattr(key) for key in each.ncattrs()} for each in (a, b))):
        if one is None or other is None:
            yield Difference(name, DIFFERENT, f"attribute {key}: {'extra' if one is None else 'missing'}")
            continue
        one, other = np.asarray(one), np.asarray(other)
        texts = one.dtype.kind == other.dtype.kind == "U"  # of any length
        if one.shape != other.shape or (one.dtype != other.dtype and not texts):
            yield Difference(name, DIFFERENT, f"attribute {key}: {_shown(one)} and {_shown(other)}")
        elif found := compare_values(one, other):
            yield found._replace(name=name, detail=f"attribute {key}: {found.detail}")


def compare_values(a: np.ndarray, b: np.ndarray, *, noise: float = 0.0) -> Difference | None:
    """Compare two arrays of one shape and type; None if they are identical.

    Parameters
    ----------
    a, b : values of the deposit and of the rerun; missing are those that are masked or NaN.
    noise : a difference that is allowed in any case.
    """
    masked_a, masked_b = np.ma.getmaskarray(a), np.ma.getmaskarray(b)
    a, b = np.asarray(np.ma.getdata(a)), np.asarray(np.ma.getdata(b))
    if a.dtype != object and a.tobytes() == b.tobytes():
        return None
    if a.dtype.kind != "f":
        return _compare_exactly(a, b)
    missing, missing_b = masked_a | np.isnan(a), masked_b | np.isnan(b)
    if (missing != missing_b).any():
        return Difference("", DIFFERENT, f"missing in other places: {_places(a, b, missing != missing_b)}")
    a, b = a.astype(float), b.astype(float)
    size = np.where(missing, 0.0, np.maximum(abs(a), abs(b)))
    largest = np.max(size, where=np.isfinite(size), initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        deviation = np.asarray(abs(a - b) / np.maximum(size, max(FLOOR * largest, noise / TOLERANCE)))
    deviation[missing | (a == b)] = 0.0
    deviation[np.isnan(deviation)] = np.inf  # infinite in one of them, or of the other sign
    most = float(deviation.max())
    if most == 0.0:
        return Difference("", WITHIN, "other signs of zero, or other bits of NaN", 0.0)
    detail = f"largest relative deviation {most:.2g}, {_place(a, b, np.argmax(deviation))}"
    if most <= TOLERANCE:
        return Difference("", WITHIN, detail, most)
    count = np.count_nonzero(deviation > TOLERANCE)
    return Difference("", DIFFERENT, f"{detail}; {count} of {deviation.size} values", most)


def _compare_exactly(a: np.ndarray, b: np.ndarray) -> Difference | None:
    if a.dtype == np.dtype("S1") and a.ndim and a.shape[-1]:  # text as characters
        a, b = (np.ascontiguousarray(each).view(f"S{each.shape[-1]}")[..., 0] for each in (a, b))
    if a.dtype == object:
        pairs = zip(a.flat, b.flat, strict=True)
        unequal = np.array([not np.array_equal(*pair) for pair in pairs], bool).reshape(a.shape)
    else:
        unequal = np.asarray(a != b)
    return Difference("", DIFFERENT, f"not equal: {_places(a, b, unequal)}") if unequal.any() else None


def _places(a, b, where) -> str:
    return f"{np.count_nonzero(where)} of {where.size}, first {_place(a, b, np.argmax(where))}"


def _place(a, b, position) -> str:
    index = ", ".join(str(k) for k in np.unravel_index(position, a.shape))
    return (f"at [{index}]: " if index else "") + f"{_shown(a.flat[position])} and {_shown(b.flat[position])}"


def _shown(value) -> str:
    value = value.item() if isinstance(value, np.ndarray | np.generic) and value.size == 1 else value
    value = value.decode(errors="replace") if isinstance(value, bytes) else value
    text = repr(value) if isinstance(value, str | float) else str(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE - 3]}..."


def table(comparison: Comparison, most: int = 20) -> str:
    """Write the result as text: a line for every kind of file, and one for every variable that is not identical.

    Of the latter, at most `most` that differ and as many within tolerance, those that deviate most first.
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
        text += [printable(line) for line in found[:most]]
        if len(found) > most:
            text.append(f"… and {len(found) - most} more")
    if any(file.is_remark for file in comparison.files):
        text.append("Figures, pages and checks are made from the data above; if only they differ, nothing is wrong.")
    return "\n".join(text)


def _lines(comparison: Comparison, within: bool) -> list[str]:
    """A line for each variable of each kind of file that is within tolerance, or for each that differs more."""
    grouped = defaultdict(list)
    for file in comparison.files:
        for each in file.differences:
            if (each.verdict == WITHIN) == within:
                grouped[file.kind if each.name else file.path, each.name, each.verdict].append((each, file.path))
    lines = []
    for (kind, name, verdict), found in grouped.items():
        worst, path = max(found, key=lambda entry: entry[0].deviation)
        files = path if len(found) == 1 else f"{len(found)} files, most in {path}"
        detail = f"{worst.deviation:.2g} at most" if within else worst.detail
        about = f"{kind}: {name.lstrip('/')}: {verdict}, {detail} ({files})" if name else f"{path}: {verdict}, {detail}"
        lines.append((-worst.deviation, about))
    return [line for _, line in sorted(lines)]


def write_json(comparison: Comparison, path: str | os.PathLike) -> None:
    """Write all differences to a JSON file; infinite deviations are null."""
    files = [
        {
            "path": file.path,
            "verdict": file.verdict,
            "variables": [
                each._asdict() | {"deviation": each.deviation if np.isfinite(each.deviation) else None}
                for each in file.differences
            ],
        }
        for file in comparison.files
    ]
    content = {"verdict": comparison.verdict, "tolerance": TOLERANCE, "files": files}
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
