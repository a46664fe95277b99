"""Style, labels and units of all figures. The same data always give figure files with the same bytes."""

import os
import textwrap
from collections.abc import Iterable, Mapping
from contextlib import contextmanager
from functools import partial
from string import ascii_lowercase
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from icha.support.atomic_files import whole_file
from icha.support.formatting import choose_unit, format_quantity

# Widths of one and of two columns of a journal page, inches.
ONE_COLUMN = 3.5
TWO_COLUMNS = 7.1

# M. Okabe and K. Ito, Color Universal Design (2008): distinguishable with any colour vision.
BLUE, VERMILLION, GREEN = "#0072B2", "#D55E00", "#009E73"
ORANGE, SKY, PURPLE, BLACK = "#E69F00", "#56B4E9", "#CC79A7", "#000000"
COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
DASHES = ("-", (0, (5, 2)), (0, (1, 1.5)), (0, (5, 2, 1, 2)), (0, (3, 1, 1, 1, 1, 1)))
GREY = "0.45"
# Space around the values on an axis, divided by their range.
_MARGIN = 0.06

RC = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 9,
    "axes.labelsize": 9.5,
    "axes.linewidth": 0.7,
    "axes.titlesize": 9.5,
    "axes.titlepad": 4,
    "axes.formatter.useoffset": False,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.minor.width": 0.5,
    "ytick.minor.width": 0.5,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.5,
    "figure.dpi": 100,
    "savefig.dpi": 300,
    "pdf.fonttype": 42,
}


@contextmanager
def _style():
    """Set the style `RC` for all drawing inside the context; matplotlib settings of the user have no effect."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(RC)
        yield


# Decorator of functions that draw a figure.
in_style = _style()


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure without a window and without pyplot's global state; width and height are in inches."""
    figure = Figure(figsize=(width, height), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.05, h_pad=0.06)
    FigureCanvasAgg(figure)
    return figure


def new_panels(
    height: float, rows: int = 1, columns: int = 2, *, width: float = TWO_COLUMNS, **options: object
) -> tuple[Figure, np.ndarray]:
    """Return a figure and an array of panels; `options` are those of `Figure.subplots`.

    Several panels have the marks (a), (b), … outside their upper left corners.
    """
    figure = new_figure(width, height)
    panels = figure.subplots(rows, columns, squeeze=False, **options)
    for axes, letter in zip(panels.ravel() if panels.size > 1 else (), ascii_lowercase, strict=False):
        axes.set_title(f"({letter})", loc="left", fontweight="bold")
    return figure, panels


def new_grid(
    count: int,
    most: int,
    row_height: float,
    column_width: float,
    *,
    room: tuple[float, float] = (0.0, 0.0),
    least: float = 1.0,
    xlabel: str = "",
    ylabel: str = "",
    **options: object,
) -> tuple[Figure, np.ndarray]:
    """Return a figure with `count` panels in rows of at most `most`, and its panels.

    `room` is added to the width and the height of the panels, inches; `least` is the least width in columns. Panels
    without a panel below have the label `xlabel`, panels without a panel on the left the label `ylabel`.
    """
    columns = min(count, most)
    rows = -(-count // columns)
    size = {"height": rows * row_height + room[1], "width": max(columns, least) * column_width + room[0]}
    figure, grid = new_panels(rows=rows, columns=columns, **size, **options)
    panels = grid.ravel()[:count]
    for axes in grid.ravel()[count:]:
        axes.remove()
    for axes in panels[-columns:]:
        axes.tick_params(labelbottom=True)
        axes.set_xlabel(xlabel)
    for axes in panels[::columns]:
        axes.set_ylabel(ylabel)
    return figure, panels


@in_style
def empty_page(reason: str) -> Figure:
    """Return a figure that only states why there is nothing to draw."""
    figure = new_figure(5.0, 2.5)
    figure.text(0.5, 0.5, textwrap.fill(reason, 60), ha="center", va="center", color=GREY, parse_math=False)
    return figure


def save(figure: Figure, png: str | os.PathLike, pdf: str | os.PathLike) -> None:
    """Write a figure as PNG and as PDF, without the date and the name of the software."""
    with _style():
        with whole_file(png) as temporary:
            figure.savefig(temporary, format="png", metadata={"Software": None})
        with whole_file(pdf) as temporary:
            nothing = {"CreationDate": None, "Creator": None, "Producer": None}
            figure.savefig(temporary, format="pdf", metadata=nothing)


def logarithmic_axes(axes: Axes, directions: str = "xy") -> None:
    """Make axes logarithmic; if an axis has fewer than two powers of ten, also label ticks between powers of ten."""
    for direction in directions:
        axes.set(**{f"{direction}scale": "log"})
        axis = getattr(axes, f"{direction}axis")
        axis.set_minor_formatter(partial(_minor_label, axis))


def _minor_label(axis, value, _):
    """Return the label of a tick between powers of ten: of 2 and 5, or on a short axis of all digits; else ""."""
    low, high = sorted(axis.get_view_interval())
    exponent = np.floor(np.log10(value))
    digit = value / 10.0**exponent
    powers = 10.0 ** np.arange(np.floor(np.log10(low)), np.log10(high) + 1)
    visible = [np.count_nonzero((low <= each * powers) & (each * powers <= high)) for each in (1, 2, 5)]
    shown = visible[0] < 2 and (sum(visible) < 2 or np.isclose(digit, (2, 5)).any())
    return rf"${digit:g}\times10^{{{exponent:g}}}$" if shown else ""


def limits_around(values: np.ndarray) -> tuple[float, float]:
    """Return the limits of an axis around some values."""
    room = _MARGIN * np.ptp(values)
    return float(values.min() - room), float(values.max() + room)


def legend_handle(x=(), y=(), **look) -> Line2D:
    """Return a line that is only drawn in a legend; `look` are keyword arguments of `Axes.plot`."""
    return Line2D(x, y, **look)


def format_number(value: float) -> str:
    """Return a number as text, such as `0.01`, `25`, or `3.2 × 10⁻⁵` in mathtext."""
    if value == 0:
        return "0"
    exponent = int(np.floor(np.log10(abs(value)) + 1e-12))
    if -3 <= exponent <= 3:
        return f"{value:.4g}".replace("-", "−")
    mantissa = f"{value / 10.0**exponent:.3g}"
    power = f"10^{{{exponent}}}"
    return f"${power}$" if mantissa == "1" else rf"${mantissa}\times{power}$"


class Interface(NamedTuple):
    """Variables that distinguish materials; None where a material lacks a variable or has no run."""

    contact_modulus: float | None
    surface_energy: float | None
    receding_energy: float | None
    interaction_range: float | None
    flaw_radius: float | None
    layer_thickness: float | None
    layer_poisson_ratio: float | None
    adhesion_map_kind: str | None


def interfaces_of(studies: Iterable[xr.Dataset]) -> dict[str, Interface]:
    """Return the interface of every material of some studies, by name."""
    found: dict[str, Interface] = {}
    for study in studies:
        names = study["material"].values.tolist()
        columns = [study[each].values.tolist() if each in study else [None] * len(names) for each in Interface._fields]
        for name, *values in zip(names, *columns, strict=True):
            found.setdefault(name, Interface(*(None if each != each or each == "" else each for each in values)))
    return found


def material_labels(interfaces: Mapping[str, Interface]) -> dict[str, str]:
    """Return a legend text for each material, with quantities in the same units for all; no two are the same.

    The text has modulus and work of adhesion, and where a material has them a map of works of adhesion, another work of
    receding edges, the thickness of a layer, and flaws. Materials that do not differ in these have the Poisson ratio of
    their layer and the range of attraction if these differ, or else their names.
    """
    labels = {name: _usual_words(each, interfaces.values()) for name, each in interfaces.items()}
    ratios = {name: _poisson_ratio(each) for name, each in interfaces.items()}
    ranges = {name: _range(each) for name, each in interfaces.items()}
    for texts in (ratios, ranges, {name: name for name in interfaces}):
        alike: dict[str, list[str]] = {}
        for name, label in labels.items():
            alike.setdefault(label, []).append(name)
        for label, names in alike.items():
            if len({texts[name] for name in names}) > 1:
                labels |= {name: f"{label}, {texts[name]}" for name in names}
    return labels


def _usual_words(interface, interfaces):
    """Return what the label of a material contains, whatever the other materials are."""

    def of(name, symbol, unit):
        value = getattr(interface, name)
        largest = max((getattr(each, name) or 0.0 for each in interfaces), default=0.0)
        factor, prefixed = choose_unit(largest, unit)
        return f"{symbol} = {value * factor:.4g} {prefixed}" if value else f"{symbol} = 0"

    work, kind = of("surface_energy", r"$\Delta\gamma$", "J/m²"), interface.adhesion_map_kind
    words = [of("contact_modulus", r"$E^{\ast}$", "Pa"), f"mean {work} ({kind})" if kind else work]
    if interface.receding_energy not in (None, interface.surface_energy):
        words.append(of("receding_energy", "receding", "J/m²"))
    if interface.layer_thickness:
        words.append(f"thickness {format_quantity(interface.layer_thickness, 'm')}")
    if interface.flaw_radius and interface.surface_energy:
        words.append(f"flaw radius {format_quantity(interface.flaw_radius, 'm')}")
    return ", ".join(words)


def _poisson_ratio(interface):
    """Return the Poisson ratio of a layer as text; a half-space does not depend on it."""
    return "" if interface.layer_poisson_ratio is None else f"Poisson ratio {interface.layer_poisson_ratio:.4g}"


def _range(interface):
    """Return the range of attraction as text; without adhesion, it does not matter."""
    return f"range {format_quantity(interface.interaction_range, 'm')}" if interface.surface_energy else ""


def slope_label(slope: float) -> str:
    """Return a legend text with an rms slope."""
    return rf"$h′_{{\mathrm{{rms}}}}$ = {slope:g}"
