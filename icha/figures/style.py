"""Style, labels and units of all figures. The same data always give figure files with the same bytes."""

import os
import textwrap
from contextlib import contextmanager
from functools import partial
from string import ascii_lowercase

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


# Variables that distinguish materials.
INTERFACE = ["contact_modulus", "surface_energy", "receding_energy", "interaction_range"]

# Symbol and unit of each variable in the label of a material.
_LABELS = (
    ("contact_modulus", r"$E^{\ast}$", "Pa"),
    ("surface_energy", r"$\Delta\gamma$", "J/m²"),
    ("receding_energy", "receding", "J/m²"),
)


def material_label(study: xr.Dataset, material: str) -> str:
    """Return a legend text with the modulus and the surface energy of a material, in the same units for a whole study.

    The work of adhesion of receding edges is added if it differs from the surface energy, and the range of attraction
    if two materials of the study are otherwise the same.
    """
    values = study.sel(material=material)
    words, alike = [], True
    for name, symbol, unit in _LABELS:
        value = float(values[name])
        factor, prefixed = choose_unit(float(study[name].max()), unit)
        if name != "receding_energy" or value != values["surface_energy"]:
            words.append(f"{symbol} = {value * factor:.4g} {prefixed}" if value > 0 else f"{symbol} = 0")
        alike &= study[name] == values[name]
    if int(alike.sum()) > 1:
        words.append(f"range {format_quantity(float(values['interaction_range']), 'm')}")
    return ", ".join(words)


def slope_label(slope: float) -> str:
    """Return a legend text with an rms slope."""
    return rf"$h′_{{\mathrm{{rms}}}}$ = {slope:g}"
