"""Write what theories say of a surface, and published points."""

from job import attributes, guarded

from icha.asperity.material import Material
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import read_spectral_moments
from icha.references.theories import reference_dataset
from icha.surfaces.spectrum import SelfAffineSpectrum


def make_references(surface, output, *, settings, adhesive, attributes):
    """Write the references for the surface file `surface` to `output`.

    `settings` are those of the surface and `adhesive` tells the contacts with adhesion, both in SI units.
    """
    keys = ("period", "rolloff_wavelength", "short_wavelength", "hurst")
    known = settings["kind"] == "self_affine"
    spectrum = SelfAffineSpectrum(**{key: settings[key] for key in keys}) if known else None
    materials = {(each["rms_slope"], each["name"]): Material(**each["material"]) for each in adhesive}
    write_dataset(reference_dataset(spectrum, read_spectral_moments(surface), materials, attrs=attributes), output)


if "snakemake" in globals():
    with guarded(snakemake):
        make_references(
            snakemake.input.surface,
            snakemake.output[0],
            settings=snakemake.params.settings,
            adhesive=snakemake.params.adhesive,
            attributes=attributes(snakemake),
        )
