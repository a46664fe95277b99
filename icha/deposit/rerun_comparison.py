"""Two folders of results beside each other: the deposit's and those of a rerun, variable by variable.

Of the same program, environment and kind of processor, a rerun has the same bytes. On another processor the last digits
of sums and transforms differ, and what is computed from them does a little more. So two numbers are the same within
tolerance if they differ by no more than `TOLERANCE` of the larger one. Where a quantity goes through zero, its last
digits are those of larger values that it is the difference of; values below `FLOOR` of the variable's largest are
therefore taken for that large. How far a solver stopped from the solution is known to no digit at all: two residuals
are the same within tolerance if they differ by no more than what is allowed of one (`NOISE`).

All else has to be equal: integers, text, where values are missing, dimensions, types and attributes. Storage (chunks,
compression, order in the file) is not compared.

Figures and the report are drawn from what is compared here, by libraries and with fonts that may differ: where one
looks different and no number does, that is a remark and no difference.
"""

import json
import os
import textwrap
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import netCDF4
import numpy as np

from icha.checks.run import FRONT_LIMIT, RESIDUAL_LIMIT
from icha.deposit.deposit_files import COMPUTED
from icha.support.atomic_files import whole_file
from icha.support.in_words import printable
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
# Differences that are allowed of variables of these names, whatever their values.
NOISE = {
    "residual": RESIDUAL_LIMIT,
    "gap_residual": RESIDUAL_LIMIT,
    "front_residual": FRONT_LIMIT,
}
_DRAWN = (".png", ".pdf", ".html")
_BLOCK = 1 << 20
# Characters of an error that are told.
_LONGEST = 300


class Item(NamedTuple):
    """A variable with its attributes, or the attributes or dimensions of a group.

    `deviation` is the largest relative difference of its numbers, as they are compared; infinite where something else
    differs; `detail` says what, with the deposit's value first.
    """

    name: str
    verdict: str
    detail: str = ""
    deviation: float = 0.0


class File(NamedTuple):
    """A file; `items` are those of a netCDF file that had to be opened, for its bytes differ."""

    path: str
    verdict: str
    detail: str = ""
    items: tuple[Item, ...] = ()

    @property
    def kind(self) -> str:
        """The part of the results that it belongs to."""
        return self.path.partition("/")[0]

    @property
    def is_remark(self) -> bool:
        """Whether it only looks different: a figure or a page."""
        return self.verdict == DIFFERENT and self.path.endswith(_DRAWN)


class Comparison(NamedTuple):
    """All files, sorted by their paths."""

    files: tuple[File, ...]

    @property
    def verdict(self) -> str:
        """`identical`, `within tolerance` or `different`: of all that is more than a remark."""
        if any(file.verdict in (DIFFERENT, MISSING, EXTRA) and not file.is_remark for file in self.files):
            return DIFFERENT
        return IDENTICAL if all(file.verdict == IDENTICAL for file in self.files) else WITHIN

    @property
    def remarks(self) -> tuple[File, ...]:
        """Figures and pages that look different."""
        return tuple(file for file in self.files if file.is_remark)


def compare_folders(
    deposit: str | os.PathLike, rerun: str | os.PathLike, paths: Iterable[str] | None = None
) -> Comparison:
    """Compare the results in two folders.

    Parameters
    ----------
    deposit, rerun : folders with `dataset/`, `runs/`, … in them.
    paths : the files that are compared, relative to both; all of `COMPUTED` that are in either if left out.
    """
    deposit, rerun = Path(deposit).resolve(), Path(rerun).resolve()
    paths = sorted({*_results(deposit), *_results(rerun)} if paths is None else {*paths})
    return Comparison(tuple(_compare_files(deposit / path, rerun / path, path) for path in paths))


def _results(folder: Path) -> Iterator[str]:
    for name in COMPUTED:
        top = folder / name
        files = top.rglob("*") if top.is_dir() and not top.is_symlink() else [top]
        yield from (file.relative_to(folder).as_posix() for file in files if file.is_file() or file.is_symlink())


def _compare_files(deposit: Path, rerun: Path, path: str) -> File:
    """Compare two files, of which `path` is the name in the results; whatever is wrong with one makes it different."""
    try:
        return _compared(deposit, rerun, path)
    except Exception as error:  # whatever the content of a file may lead to
        return File(path, DIFFERENT, f"cannot be compared: {textwrap.shorten(repr(error), _LONGEST, placeholder=' …')}")


def _compared(deposit: Path, rerun: Path, path: str) -> File:
    for file, whose in ((deposit, "deposit"), (rerun, "rerun")):
        if file.resolve() != file:  # to the other one's, for instance
            return File(path, DIFFERENT, f"the {whose}'s is a link, or in a folder that is one")
    if not deposit.is_file():
        return File(path, EXTRA, "the deposit has no such file")
    if not rerun.is_file():
        return File(path, MISSING, "the rerun has no such file")
    if _same_bytes(deposit, rerun):
        return File(path, IDENTICAL)
    if path.endswith(".nc"):
        return _compare_datasets(deposit, rerun, path)
    if path == "checks.json":
        return _compare_checks(deposit, rerun, path)
    return File(path, DIFFERENT, "other bytes")


def _same_bytes(one: Path, other: Path) -> bool:
    if one.stat().st_size != other.stat().st_size:
        return False
    with one.open("rb") as a, other.open("rb") as b:
        while block := a.read(_BLOCK):
            if block != b.read(_BLOCK):
                return False
    return True


def _compare_datasets(deposit, rerun, path):
    opened = []
    try:
        for file, whose in ((deposit, "deposit"), (rerun, "rerun")):
            try:
                refuse_traps(file)
                opened.append(netCDF4.Dataset(file))
            except (OSError, ValueError) as error:
                return File(path, DIFFERENT, f"the {whose}'s cannot be opened: {error}")
        items = tuple(_compare_groups(*opened, ""))
    finally:
        for dataset in opened:
            dataset.close()
    verdict = _worst(item.verdict for item in items)
    return File(path, verdict, "other storage of the same content" if verdict == IDENTICAL else "", items)


def _worst(verdicts: Iterable[str]) -> str:
    """Of a whole: what is missing or extra makes it different."""
    verdicts = set(verdicts)
    return DIFFERENT if verdicts - {IDENTICAL, WITHIN} else WITHIN if WITHIN in verdicts else IDENTICAL


def _compare_groups(a: netCDF4.Dataset, b: netCDF4.Dataset, path: str) -> Iterator[Item]:
    """Everything of two groups and of those in them."""
    yield _compare_attributes(a, b, f"{path}/ (attributes)")
    sizes_a, sizes_b = ({name: len(dim) for name, dim in group.dimensions.items()} for group in (a, b))
    for name in dict.fromkeys([*sizes_a, *sizes_b]):
        if sizes_a.get(name) != sizes_b.get(name):
            told = " and ".join(_or_none(sizes.get(name)) for sizes in (sizes_a, sizes_b))
            yield Item(f"{path}/{name} (dimension)", DIFFERENT, f"size: {told}", np.inf)
    for name in dict.fromkeys([*a.variables, *b.variables]):
        yield _compare_if_both(a.variables, b.variables, name, f"{path}/{name}", _compare_variables)
    for name in dict.fromkeys([*a.groups, *b.groups]):
        inside = f"{path}/{name}"
        if name in a.groups and name in b.groups:
            yield from _compare_groups(a.groups[name], b.groups[name], inside)
        else:
            yield _compare_if_both(a.groups, b.groups, name, f"{inside} (group)", None)


def _or_none(value) -> str:
    return "none" if value is None else str(value)


def _compare_if_both(a, b, name, told, compare):
    if name not in b:
        return Item(told, MISSING, "the rerun has none", np.inf)
    if name not in a:
        return Item(told, EXTRA, "the deposit has none", np.inf)
    return compare(a[name], b[name], told)


def _compare_variables(a: netCDF4.Variable, b: netCDF4.Variable, name: str) -> Item:
    for what, one, other in (
        ("type", _type(a), _type(b)),
        ("dimensions", a.dimensions, b.dimensions),
        ("shape", a.shape, b.shape),
    ):
        if one != other:
            return Item(name, DIFFERENT, f"{what}: {_shown(one)} and {_shown(other)}", np.inf)
    for variable in (a, b):
        # Values as they are in the file: missing ones by their marks, text as characters.
        variable.set_auto_maskandscale(False)
        variable.set_auto_chartostring(False)
    noise = NOISE.get(name.rpartition("/")[2], 0.0)
    values = compare_values(np.asarray(a[...]), np.asarray(b[...]), marks=_marks(a), noise=noise)
    attributes = _compare_attributes(a, b, name)
    detail = "; ".join(filter(None, (values.detail, attributes.detail)))
    verdict = _worst((values.verdict, attributes.verdict))
    return Item(name, verdict, detail, max(values.deviation, attributes.deviation))


def _type(variable) -> str:
    return "text" if variable.dtype is str else str(variable.dtype)


def _marks(variable) -> list:
    """Numbers that stand for missing ones."""
    if variable.dtype is str or variable.dtype.kind != "f":
        return []  # compared exactly
    standard = netCDF4.default_fillvals[variable.dtype.str[1:]]
    given = [variable.getncattr(name) for name in ("_FillValue", "missing_value") if name in variable.ncattrs()]
    return list(np.unique(np.array([standard, *np.ravel(given)]).astype(variable.dtype)))


def _compare_attributes(a, b, name: str) -> Item:
    """Compare the attributes of two variables or groups, numbers among them as those of variables."""
    told, verdicts, deviation = [], [IDENTICAL], 0.0
    for key in sorted({*a.ncattrs(), *b.ncattrs()}):
        if key not in a.ncattrs() or key not in b.ncattrs():
            told.append(f"attribute {key}: {'extra' if key in b.ncattrs() else 'missing'}")
            verdicts.append(DIFFERENT)
            continue
        one, other = (np.asarray(each.getncattr(key)) for each in (a, b))
        texts = one.dtype.kind == other.dtype.kind == "U"  # of any length
        if one.shape != other.shape or (one.dtype != other.dtype and not texts):
            found = Item(key, DIFFERENT, f"{_shown(one)} and {_shown(other)}", np.inf)
        else:
            found = compare_values(one, other)
        if found.verdict != IDENTICAL:
            told.append(f"attribute {key}: {found.detail}")
            verdicts.append(found.verdict)
            deviation = max(deviation, found.deviation)
    verdict = _worst(verdicts)
    return Item(name, verdict, "; ".join(told), np.inf if verdict == DIFFERENT and not deviation else deviation)


def compare_values(a: np.ndarray, b: np.ndarray, *, marks: Iterable = (), noise: float = 0.0) -> Item:
    """Compare two arrays of one shape and type.

    Parameters
    ----------
    a, b : the deposit's values and the rerun's.
    marks : numbers that stand for missing ones; they and NaN have to be in the same places.
    noise : a difference that is allowed in any case.
    """
    if a.dtype != object and a.tobytes() == b.tobytes():
        return Item("", IDENTICAL)
    if a.dtype.kind != "f":
        return _compare_exactly(a, b)
    a, b = a.astype(float), b.astype(float)
    missing = np.zeros(a.shape, bool)
    for there_a, there_b in ((np.isnan(a), np.isnan(b)), *((a == mark, b == mark) for mark in marks)):
        if (there_a != there_b).any():
            return Item("", DIFFERENT, f"missing in other places: {_places(a, b, there_a != there_b)}", np.inf)
        missing |= there_a
    size = np.where(missing, 0.0, np.maximum(abs(a), abs(b)))
    largest = np.max(size, where=np.isfinite(size), initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        deviation = np.asarray(abs(a - b) / np.maximum(size, max(FLOOR * largest, noise / TOLERANCE)))
    deviation[missing | (a == b)] = 0.0
    deviation[np.isnan(deviation)] = np.inf  # infinite in one, or of the other sign
    most = float(deviation.max())
    if most == 0.0:
        return Item("", WITHIN, "other signs of zero, or other bits of NaN")
    detail = f"largest relative deviation {most:.2g}, {_place(a, b, np.argmax(deviation))}"
    if most <= TOLERANCE:
        return Item("", WITHIN, detail, most)
    return Item("", DIFFERENT, f"{detail}; {np.count_nonzero(deviation > TOLERANCE)} of {deviation.size} values", most)


def _compare_exactly(a, b) -> Item:
    if a.dtype.kind == "S" and a.ndim and a.dtype.itemsize == 1 and a.shape[-1]:
        a, b = (np.ascontiguousarray(each).view(f"S{each.shape[-1]}")[..., 0] for each in (a, b))
    if a.dtype == object:
        pairs = zip(a.flat, b.flat, strict=True)
        unequal = np.array([not np.array_equal(*pair) for pair in pairs], bool).reshape(a.shape)
    else:
        unequal = np.asarray(a != b)
    if not unequal.any():
        return Item("", IDENTICAL)
    return Item("", DIFFERENT, f"not equal: {_places(a, b, unequal)}", np.inf)


def _places(a, b, where) -> str:
    return f"{np.count_nonzero(where)} of {where.size}, first {_place(a, b, np.argmax(where))}"


def _place(a, b, position) -> str:
    index = ", ".join(str(k) for k in np.unravel_index(position, a.shape))
    return (f"at [{index}]: " if index else "") + f"{_shown(a.flat[position])} and {_shown(b.flat[position])}"


def _shown(value) -> str:
    value = value.item() if isinstance(value, np.ndarray | np.generic) and value.size == 1 else value
    value = value.decode(errors="replace") if isinstance(value, bytes) else value
    text = repr(value) if isinstance(value, str | float) else str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _compare_checks(deposit, rerun, path) -> File:
    """Compare checks: what is checked, and whether it is passed, has to be equal, and values but for their limits."""

    def taken(file):
        return {(check["subject"], check["name"]): check for check in json.loads(file.read_text(encoding="utf-8"))}

    a, b = taken(deposit), taken(rerun)
    items = []
    for key in dict.fromkeys([*a, *b]):
        name = ": ".join(filter(None, key))
        items.append(_compare_if_both(a, b, key, name, _compare_check))
    return File(path, _worst(item.verdict for item in items), "", tuple(items))


def _compare_check(a, b, name) -> Item:
    for key in sorted({*a, *b} - {"value"}):
        if a.get(key) != b.get(key):
            return Item(name, DIFFERENT, f"{key}: {_shown(a.get(key))} and {_shown(b.get(key))}", np.inf)
    values = [np.asarray(check["value"], dtype=float) for check in (a, b)]
    # Most of what is checked would be zero but for rounding: it may differ by what is allowed of it.
    return compare_values(*values, noise=a["limit"])._replace(name=name)


class Line(NamedTuple):
    """A variable that is not identical, in `count` files of a kind; `worst` is the one that differs most."""

    kind: str
    item: Item
    count: int
    worst: str


def lines(comparison: Comparison) -> list[Line]:
    """What is not identical: variables of each kind of file, those that differ most first, and whole files."""
    found: dict[tuple, list[tuple[Item, str]]] = {}
    for file in comparison.files:
        if not file.items and file.verdict != IDENTICAL:
            found[file.kind, file.path] = [(Item(file.path, file.verdict, file.detail, np.inf), file.path)]
        for item in file.items:
            if item.verdict != IDENTICAL:
                found.setdefault((file.kind, item.name, item.verdict), []).append((item, file.path))
    made = []
    for (kind, *_), places in found.items():
        item, worst = max(places, key=lambda place: place[0].deviation)
        made.append(Line(kind, item, len(places), worst))
    return sorted(made, key=lambda line: (line.item.verdict == WITHIN, -line.item.deviation))


def table(comparison: Comparison, most: int = 20) -> str:
    """The result as text: a line for every kind of file, and one for every variable that is not identical.

    Of the latter, at most `most` of those that differ and as many of those within tolerance.
    """
    kinds = list(dict.fromkeys(file.kind for file in comparison.files))
    kinds.sort(key=lambda kind: COMPUTED.index(kind) if kind in COMPUTED else len(COMPUTED))
    width = max(map(len, kinds), default=0)
    shown = [each for each in VERDICTS if any(file.verdict == each for file in comparison.files)]
    text = [" ".join([" " * width, "  files", *(f" {each}" for each in shown)])]
    for kind in kinds:
        own = [file.verdict for file in comparison.files if file.kind == kind]
        counts = [f" {own.count(each) or '':>{len(each)}}" for each in shown]
        text.append(" ".join([f"{kind:<{width}}", f"{len(own):>7}", *counts]).rstrip())
    found = lines(comparison)
    for part in (
        [line for line in found if line.item.verdict != WITHIN],
        [x for x in found if x.item.verdict == WITHIN],
    ):
        text += [printable(_told(line)) for line in part[:most]]
        if len(part) > most:
            text.append(f"… and {len(part) - most} more")
    if comparison.remarks:
        text.append(
            "Figures and pages that look different are drawn from the data above; what draws them may differ from one "
            "machine to another."
        )
    return "\n".join(text)


def _told(line: Line) -> str:
    if line.worst == line.item.name:
        return f"{line.worst}: {line.item.verdict}, {line.item.detail}"
    if line.item.verdict == WITHIN and line.item.deviation:
        # Where is of little interest; the file of `write_json` has it.
        return f"{line.kind}: {line.item.name.lstrip('/')}: {line.item.verdict}, {line.item.deviation:.2g} at most"
    files = line.worst if line.count == 1 else f"{line.count} files, most in {line.worst}"
    return f"{line.kind}: {line.item.name.lstrip('/')}: {line.item.verdict}, {line.item.detail} ({files})"


def write_json(comparison: Comparison, path: str | os.PathLike) -> None:
    """Write all of it to a JSON file; deviations that are infinite are null."""
    content = {
        "verdict": comparison.verdict,
        "tolerance": TOLERANCE,
        "files": [
            {
                "path": file.path,
                "verdict": file.verdict,
                "detail": file.detail,
                "variables": [
                    item._asdict() | {"deviation": item.deviation if np.isfinite(item.deviation) else None}
                    for item in file.items
                ],
            }
            for file in comparison.files
        ],
    }
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
