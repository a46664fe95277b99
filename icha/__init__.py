"""ICHA: adhesive contact of rough surfaces with interacting and coalescing asperities."""

import importlib
from typing import TYPE_CHECKING

_HOME = {
    "SelfAffineSpectrum": "surfaces.spectrum",
    "Surface": "surfaces.surface",
    **dict.fromkeys(("SpectrumTable", "merge_spectra", "read_spectrum_table"), "surfaces.tabulated_spectrum"),
    **dict.fromkeys(("Sphere", "Paraboloid", "CylinderPunch", "FlatPunch", "Cone", "Wave"), "surfaces.shapes"),
    "Material": "asperity.material",
    **dict.fromkeys(("Patches", "Stripes"), "asperity.adhesion_map"),
    "Path": "path.targets",
    "read_scan": "configuration.topographies",
    "simulate": "simulation",
    "fit_jkr_test": "references.jkr_test",
    **dict.fromkeys(("plot_area", "plot_contact", "plot_jkr_test", "plot_separation"), "figures.quick"),
    "ConvergenceError": "simulation",
    "fetch_deposit": "deposit.fetch",
    "IchaWarning": "support.usual",
}
__all__ = ["__version__", *_HOME]

if TYPE_CHECKING:  # for editors and type checkers only
    from icha.asperity.adhesion_map import Patches as Patches
    from icha.asperity.adhesion_map import Stripes as Stripes
    from icha.asperity.material import Material as Material
    from icha.configuration.topographies import read_scan as read_scan
    from icha.deposit.fetch import fetch_deposit as fetch_deposit
    from icha.figures.quick import plot_area as plot_area
    from icha.figures.quick import plot_contact as plot_contact
    from icha.figures.quick import plot_jkr_test as plot_jkr_test
    from icha.figures.quick import plot_separation as plot_separation
    from icha.path.targets import Path as Path
    from icha.references.jkr_test import fit_jkr_test as fit_jkr_test
    from icha.simulation import ConvergenceError as ConvergenceError
    from icha.simulation import simulate as simulate
    from icha.support.usual import IchaWarning as IchaWarning
    from icha.surfaces.shapes import Cone as Cone
    from icha.surfaces.shapes import CylinderPunch as CylinderPunch
    from icha.surfaces.shapes import FlatPunch as FlatPunch
    from icha.surfaces.shapes import Paraboloid as Paraboloid
    from icha.surfaces.shapes import Sphere as Sphere
    from icha.surfaces.shapes import Wave as Wave
    from icha.surfaces.spectrum import SelfAffineSpectrum as SelfAffineSpectrum
    from icha.surfaces.surface import Surface as Surface
    from icha.surfaces.tabulated_spectrum import SpectrumTable as SpectrumTable
    from icha.surfaces.tabulated_spectrum import merge_spectra as merge_spectra
    from icha.surfaces.tabulated_spectrum import read_spectrum_table as read_spectrum_table

    __version__: str
else:

    def __getattr__(name):
        """Import a public name at its first use, so that a script imports only what it needs."""
        if name == "__version__":
            from importlib.metadata import version

            return version("icha")
        if name in _HOME:
            return getattr(importlib.import_module(f"icha.{_HOME[name]}"), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
