"""Write what theories say of a surface, and published points."""

from job import logged

from icha.records import write_dataset
from icha.reference.dataset import reference_dataset
from icha.spectrum import SelfAffineSpectrum


def make_references(output, *, settings, attributes):
    """Write the references for a surface of the given settings (SI units) to `output`."""
    keys = ("period", "rolloff_wavelength", "short_wavelength", "hurst")
    known = settings["kind"] == "self_affine"
    spectrum = SelfAffineSpectrum(**{key: settings[key] for key in keys}) if known else None
    write_dataset(reference_dataset(spectrum, attrs=attributes), output)


if "snakemake" in globals():
    with logged(snakemake.log[0]):
        make_references(snakemake.output[0], settings=snakemake.params.settings, attributes=snakemake.params.attributes)
