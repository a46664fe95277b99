"""Write predictions of theories for a surface, and data points from publications."""

from icha.asperity.material import Material
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import read_spectral_moments
from icha.references.theories import reference_dataset
from icha.surfaces.spectrum import SelfAffineSpectrum


def make_theories(surface, output, *, settings, adhesive, attributes):
    """Write the references for a surface: predictions of theories, and published data points.

    Theories of separate summits are omitted if they do not apply to the surface or the materials. `adhesive` has rms
    slopes and materials of the contacts with adhesion. Settings are in SI units.
    """
    keys = ("period", "rolloff_wavelength", "short_wavelength", "hurst")
    known = settings["kind"] == "self_affine"
    spectrum = SelfAffineSpectrum(**{key: settings[key] for key in keys}) if known else None
    materials = {(each["rms_slope"], each["name"]): Material(**each["material"]) for each in adhesive}
    moments = read_spectral_moments(surface)
    try:
        dataset = reference_dataset(spectrum, moments, materials, attrs=attributes)
    except ValueError as error:
        print(f"Theories of separate summits do not apply to this surface: {error}")
        dataset = reference_dataset(spectrum, attrs=attributes)
    write_dataset(dataset, output)
