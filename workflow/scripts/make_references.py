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
    Theories of separate summits are left out where they hold for no such surface or material.
    """
    keys = ("period", "rolloff_wavelength", "short_wavelength", "hurst")
    known = settings["kind"] == "self_affine"
    spectrum = SelfAffineSpectrum(**{key: settings[key] for key in keys}) if known else None
    materials = {(each["rms_slope"], each["name"]): Material(**each["material"]) for each in adhesive}
    moments = read_spectral_moments(surface)
    try:
        dataset = reference_dataset(spectrum, moments, materials, attrs=attributes)
    except ValueError as error:
        print(f"No theories of separate summits of this surface: {error}")
        dataset = reference_dataset(spectrum, attrs=attributes)
    write_dataset(dataset, output)


if "snakemake" in globals():
    with guarded(snakemake):
        make_references(
            snakemake.input.surface,
            snakemake.output[0],
            settings=snakemake.params.settings,
            adhesive=snakemake.params.adhesive,
            attributes=attributes(snakemake),
        )
