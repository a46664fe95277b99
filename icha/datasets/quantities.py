"""The one table of quantities: name in words, symbol and unit of each variable, for figures, tables, pages and texts.

The keys are names of variables in datasets, kinds of targets, and parameters of surfaces and materials. Whoever writes
a quantity for a reader takes the words from here, so that a quantity has the same name everywhere.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from icha.path.targets import UNITS
from icha.support.formatting import choose_unit, format_quantity


class Quantity(NamedTuple):
    """Words for a quantity.

    Attributes
    ----------
    name : name in words.
    symbol : symbol in TeX without dollar signs; empty for a quantity that has only a name.
    unit : SI unit in the notation of CF; "1" for numbers without a unit.
    short : shorter symbol in texts and tables; the symbol itself if empty.
    scale : "percent" for fractions that texts give in per cent, otherwise empty. Values with a unit have a prefix.
    """

    name: str
    symbol: str = ""
    unit: str = "1"
    short: str = ""
    scale: str = ""

    def label(self, unit: str = "") -> str:
        """Return the label of an axis of a figure: name, symbol, and the unit with its prefix in brackets, if any."""
        symbol = f"  ${self.symbol}$" if self.symbol else ""
        return f"{self.name}{symbol}" + (f" ({unit})" if unit else "")

    @property
    def text(self) -> str:
        """Symbol as plain text, such as `p*`, `A/A0` or `E*`; the name if there is no symbol."""
        return plain(self.short or self.symbol) or self.name

    def in_unit(self, value: float) -> tuple[float, str]:
        """Return the factor and the unit in which a value (SI) has few digits; "" is the unit of plain numbers."""
        if self.scale == "percent":
            return 100.0, "%"
        return (1.0, "") if self.unit == "1" else choose_unit(value, self.unit)


_RMS = r"h_{\mathrm{rms}}"
_SLOPE = r"h′_{\mathrm{rms}}"
_MODULUS = r"E^{\ast}"
_REDUCED = rf"F/({_MODULUS}{_SLOPE}A_0)"
_QUANTITIES = {
    # states of a contact
    "nominal_pressure": Quantity("nominal pressure", "p", "Pa"),
    "reduced_pressure": Quantity("reduced pressure", _REDUCED, short=r"p^{\ast}"),
    "relative_load": Quantity("relative load", rf"F/({_MODULUS}A_0)", short=rf"p/{_MODULUS}"),
    "contact_area_fraction": Quantity("contact area", "A/A_0", scale="percent"),
    "area_over_load": Quantity("contact area over load", rf"A{_MODULUS}{_SLOPE}/F"),
    "area_over_relative_load": Quantity("contact area over load", rf"A{_MODULUS}/F"),
    "mean_separation": Quantity("mean separation", r"\bar{u}", "m"),
    "mean_gap": Quantity("mean gap", r"\langle u\rangle", "m"),
    "reduced_separation": Quantity("mean separation", rf"\bar{{u}}/{_RMS}"),
    "reduced_gap": Quantity("mean gap", rf"\langle u\rangle/{_RMS}"),
    "contact_stiffness": Quantity("contact stiffness", "K", "Pa m^-1"),
    "reduced_stiffness": Quantity("contact stiffness", rf"K {_RMS}/({_MODULUS}{_SLOPE})"),
    "stiffness_over_pressure": Quantity("stiffness over pressure", rf"K {_RMS}/p"),
    "spot_count": Quantity("number of contact patches"),
    "force": Quantity("force", "F", "N"),
    "indentation": Quantity("indentation", r"-\bar{u}", "m"),
    "contact_radius": Quantity("contact radius", r"\sqrt{A/\pi}", "m"),
    "stiffness": Quantity("stiffness", "dF/dδ", "N m^-1"),
    "pressure": Quantity("pressure", "p", "Pa"),
    "gap": Quantity("gap", "u", "m"),
    # pull-off and loss
    "pull_off_pressure": Quantity("pull-off pressure", "", "Pa"),
    "pull_off_force": Quantity("pull-off force", "", "N"),
    "hysteresis_loss": Quantity("hysteresis loss", "", "J m^-2"),
    "hysteresis_loss_over_surface_energy": Quantity(r"hysteresis loss over $\Delta\gamma$"),
    "loss_over_contact": Quantity("loss divided by contact area and advancing work"),
    "loss_by_jump_in": Quantity("jump-in", "", "J m^-2"),
    "loss_by_jump_off": Quantity("jump-off", "", "J m^-2"),
    "loss_by_coalescence": Quantity("coalescence", "", "J m^-2"),
    "loss_by_load_jump": Quantity("jumps at constant load", "", "J m^-2"),
    "front_dissipation": Quantity("receding edge", "", "J m^-2"),
    "loss_unattributed": Quantity("unattributed", "", "J m^-2"),
    "largest_contact_area_fraction": Quantity("largest contact area", "A/A_0", scale="percent"),
    "largest_reduced_pressure": Quantity("largest reduced pressure", _REDUCED),
    "work_of_adhesion_approach": Quantity("work of adhesion on approach", "", "J m^-2"),
    "work_of_adhesion_retraction": Quantity("work of adhesion on retraction", "", "J m^-2"),
    "pull_off_force_over_jkr": Quantity("pull-off force over that of JKR"),
    # errors of the asperity model
    "area_error": Quantity("error of contact area", r"A/A_{\mathrm{BEM}}-1", scale="percent"),
    "separation_error": Quantity("error of separation", r"\bar{u}/\bar{u}_{\mathrm{BEM}}-1", scale="percent"),
    "gap_error": Quantity("error of mean gap", r"\langle u\rangle/\langle u\rangle_{\mathrm{BEM}}-1", scale="percent"),
    "pressure_distribution_distance": Quantity("distance of $P(p)$", "W_1/p"),
    "gap_distribution_distance": Quantity("distance of $P(u)$", f"W_1/{_RMS}"),
    "jaccard": Quantity("overlap of the contact maps"),
    # materials and surfaces
    "contact_modulus": Quantity("contact modulus", _MODULUS, "Pa"),
    "surface_energy": Quantity("surface energy", r"\Delta\gamma", "J m^-2"),
    "receding_energy": Quantity("surface energy of receding edges", "", "J m^-2"),
    "interaction_range": Quantity("range of attraction", "", "m"),
    "flaw_radius": Quantity("flaw radius", "", "m"),
    "layer_thickness": Quantity("thickness of the layer", "", "m"),
    "layer_poisson_ratio": Quantity("Poisson ratio of the layer"),
    "tabor_parameter": Quantity("Tabor parameter", r"\mu"),
    "rms_slope": Quantity("rms slope", _SLOPE),
    "rms_height": Quantity("rms height", _RMS, "m"),
    "hurst": Quantity("Hurst exponent", "H"),
    "rolloff_wavelength": Quantity("roll-off wavelength", r"\lambda_{\mathrm{r}}", "m"),
    "short_wavelength": Quantity("shortest wavelength", r"\lambda_{\mathrm{s}}", "m"),
    "cutoff": Quantity("cutoff wavelength", r"\lambda_{\mathrm{c}}", "m"),
    "rms_curvature": Quantity("rms curvature", "", "m^-1"),
    "nayak_parameter": Quantity("Nayak’s parameter"),
    "period": Quantity("period", "L", "m"),
    "grid": Quantity("grid", "n"),
}
# The kinds of targets that are named unlike their variable.
_QUANTITIES["area_fraction"] = _QUANTITIES["contact_area_fraction"]._replace(scale="")
# The parts of a loss.
LOSS_PARTS = (
    "loss_by_jump_in",
    "loss_by_jump_off",
    "loss_by_coalescence",
    "loss_by_load_jump",
    "front_dissipation",
    "loss_unattributed",
)


def quantity(name: str) -> Quantity:
    """Return the words for a quantity; the words of a name that the table lacks are the name itself."""
    return _QUANTITIES.get(name) or Quantity(name.replace("_", " "))


def label_of(name: str, unit: str = "") -> str:
    """Return the label of a quantity on an axis of a figure, with its unit in brackets, if any."""
    return quantity(name).label(unit)


def symbol_of(name: str) -> str:
    """Return the symbol of a quantity for a figure; its name if there is no symbol."""
    symbol = quantity(name).symbol
    return f"${symbol}$" if symbol else quantity(name).name


def plain(symbol: str) -> str:
    """Return a symbol in TeX as plain text: `E*`, `h'rms`, `h_rms`, `A/A0`."""
    for pattern, text in _PLAIN:
        symbol = re.sub(pattern, text, symbol)
    return symbol


_GREEK = {"gamma": "γ", "delta": "δ", "lambda": "λ", "mu": "µ", "pi": "π"}
_PLAIN = (
    (r"\\[,; ]", " "),
    (r"\^?\{?\\ast\}?", "*"),
    (r"′_\{\\mathrm\{(\w+)\}\}", r"'\1"),
    (r"\\mathrm\{(\w+)\}", r"\1"),
    (r"\\bar\{u\}", "ū"),
    (r"\\langle u\\rangle", "⟨u⟩"),
    (r"\\sqrt\{(.*)\}", r"√(\1)"),
    (r"\\Delta", "Δ"),
    (r"\\(gamma|delta|lambda|mu|pi)", lambda found: _GREEK[found[1]]),
    (r"\^\{(\d+/\d+)\}", r"^(\1)"),
    (r"_(\d)", r"\1"),
    (r"[{}]", ""),
)


def state_words(kind: str, target: float) -> str:
    """Return the target of a state as plain text, such as `p* = 0.01` or `pressure 10 kPa`."""
    unit = UNITS.get(kind, "")
    return f"{quantity(kind).name} {format_quantity(target, unit)}" if unit else f"{quantity(kind).text} = {target:g}"
