"""The wheel, built from the sdist and installed in an empty environment: the library, a campaign, its deposit."""

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
import small_campaign as small
import tiny_campaign
import yaml
from conftest import REPOSITORY

from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import write_dataset
from icha.deposit.program import locked_versions

pytestmark = pytest.mark.slow

UV = REPOSITORY / ".venv-tools/bin/uv"
# Bytes of the library and its dependencies. NumPy, SciPy and FINUFFT have 195 MB, xarray with pandas 51 MB, h5py 16 MB.
LARGEST_LIBRARY = 290e6

LIBRARY = """
import icha
import xarray as xr

spectrum = icha.SelfAffineSpectrum(
    period=100e-6, rolloff_wavelength=20e-6, short_wavelength=10e-6, hurst=0.8, rms_slope=1.0
)
surface = spectrum.realise(grid=64, seed=1)
material = icha.Material(contact_modulus=25e6, surface_energy=0.05, interaction_range=2.071e-9)
path = icha.Path(reduced_pressures=[1e-3, 1e-2])
for model in ("asperities", "boundary_elements"):
    run = icha.simulate(surface, material, path, model=model)
    run.to_netcdf(f"{model}.nc")
    assert (xr.load_dataset(f"{model}.nc").contact_area_fraction == run.contact_area_fraction).all()
study = xr.open_datatree("campaign.nc")["slopes"].to_dataset()
print(float(study.contact_area_fraction.sum()))
"""

CAMPAIGN = f"""{tiny_campaign.CAMPAIGN.replace("[1, 2]", "[1]").replace("[bare, soft]", "[bare]")}
publication:
  version: "1.0.0"
  date: 2026-01-31
  authors:
    - {{family_names: Carberry, given_names: Josiah}}
"""


# The environment variables without this virtual environment.
ENVIRONMENT = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
ENVIRONMENT["PATH"] = os.pathsep.join(
    part for part in os.environ["PATH"].split(os.pathsep) if not Path(part).is_relative_to(sys.prefix)
)
ENVIRONMENT["OMP_NUM_THREADS"] = "1"


def call(*command, cwd, status=0):
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert done.returncode == status, done.stdout
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Build sdist and wheel from all files that git does not ignore; return the source folder and both files."""
    source, dist = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("dist")
    listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    for name in call(*listed, cwd=REPOSITORY).splitlines():
        if (REPOSITORY / name).is_file():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((REPOSITORY / name).read_bytes())
    call(UV, "build", "--quiet", "--out-dir", dist, source, cwd=source)
    (sdist,), (wheel,) = dist.glob("*.tar.gz"), dist.glob("*.whl")
    return source, sdist, wheel


@pytest.fixture(scope="module")
def install(built, tmp_path_factory):
    """Return a function that installs the wheel with the locked versions in an empty environment."""
    locked = tmp_path_factory.mktemp("locked") / "locked.txt"
    versions = locked_versions((REPOSITORY / "uv.lock").read_text())
    locked.write_text("\n".join(f"{name}=={version}" for name, version in versions.items()))

    def installed(name, extra=""):
        place = tmp_path_factory.mktemp("environments") / name
        call(UV, "venv", "--quiet", "--python", sys.executable, place, cwd=place.parent)
        asked = ["--constraint", locked, f"{built[2]}{extra}"]
        call(UV, "pip", "install", "--quiet", "--python", place / "bin/python", *asked, cwd=place.parent)
        return place / "bin"

    return installed


@pytest.fixture(scope="module")
def library(install):
    return install("library")


@pytest.fixture(scope="module")
def workflow(install):
    return install("workflow", "[workflow]")


def test_the_wheel_has_the_package_and_the_workflow_and_nothing_else(built):
    source, sdist, wheel = built
    with tarfile.open(sdist) as archive:
        unpacked = {name.partition("/")[2] for name in archive.getnames()}
    assert {"tests/packaging/test_wheel.py", "Snakefile", "hatch_build.py", "docs/index.md"} <= unpacked
    with zipfile.ZipFile(wheel) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    tops = {name.partition("/")[0] for name in content if ".dist-info/" not in name}
    assert tops == {"icha", "icha_workflow"} and "icha/py.typed" in content
    # Files in the wheel have the bytes of the repository, and the wheel contains all files of these folders.
    for name, data in content.items():
        if name.startswith("icha_workflow/"):
            assert (source / name.removeprefix("icha_workflow/")).read_bytes() == data, name
    for folder, place in (
        ("icha", "icha"),
        *((each, f"icha_workflow/{each}") for each in ("workflow", "config", "profiles")),
    ):
        for path in (source / folder).rglob("*"):
            if path.is_file():
                assert f"{place}/{path.relative_to(source / folder).as_posix()}" in content
    assert not [name for name in content if "test" in name.lower() and not name.startswith("icha/")]


def test_the_library_is_small_and_computes_reads_and_writes(library, tmp_path):
    size = """
import importlib.metadata as metadata, os
found = [each.locate_file(file) for each in metadata.distributions() for file in each.files or ()]
print(sum(os.path.getsize(file) for file in found if os.path.isfile(file) and file.suffix != ".pyc"))
"""
    assert int(call(library / "python", "-c", size, cwd=tmp_path)) < LARGEST_LIBRARY
    tree = campaign_tree(
        [(labels._replace(study="slopes"), run) for labels, run in small.runs() if labels.study == "slopes"],
        attrs={"campaign": "paper"},
    )
    write_dataset(tree, tmp_path / "campaign.nc")
    said = call(library / "python", "-c", LIBRARY, cwd=tmp_path)
    assert float(said) == pytest.approx(float(tree["slopes"].contact_area_fraction.sum()))


def test_a_command_without_the_workflow_names_the_missing_package(library, tmp_path):
    for program, *rest in (["icha", "show", "x.nc"], ["python", "-m", "icha"]):
        said = call(library / program, *rest, cwd=tmp_path, status=1)
        assert len(said.splitlines()) == 1 and said.rstrip().endswith("pip install 'icha[workflow]'")


def test_new_and_shipped_campaigns_work_in_any_folder(workflow, tmp_path):
    call(workflow / "icha", "new", "mine", cwd=tmp_path)
    made = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    assert made == {"config/campaigns/mine.yaml", "config/config.schema.json", "config/README.md"}
    for name in ("mine", "smoke", "paper"):
        assert f"\n{name}: " in "\n" + call(workflow / "icha", "describe", name, cwd=tmp_path)
    said = call(workflow / "icha", "run", "smoke", "--dry-run", cwd=tmp_path)
    assert "jobs would run" in said and not (tmp_path / "results").exists()


@pytest.fixture(scope="module")
def work(workflow, tmp_path_factory):
    """Run and publish a campaign; return its folder."""
    folder = tmp_path_factory.mktemp("work")
    (folder / "config/campaigns").mkdir(parents=True)
    (folder / "config/campaigns/tiny.yaml").write_text(CAMPAIGN)
    said = call(workflow / "icha", "run", "tiny", "publish", "--cores", "1", cwd=folder)
    assert "deposit: results/tiny/publish/tiny-1.0.0.zip" in said
    return folder


def test_a_campaign_runs_in_any_folder(work, workflow):
    assert {path.name for path in work.iterdir()} == {"config", "results", ".snakemake"}
    assert (work / "results/tiny/report.html").is_file()
    assert (work / "results/tiny/belongs_to.txt").read_text() == "config/campaigns/tiny.yaml\n"
    assert "Nothing to do" in call(workflow / "icha", "run", "tiny", cwd=work)


def test_the_deposit_contains_the_installed_program_and_is_reproduced(built, work, workflow, tmp_path):
    source = built[0]
    deposit = work / "results/tiny/publish/tiny-1.0.0"
    for path in (deposit / "source").rglob("*"):
        if path.is_file():
            assert path.read_bytes() == (source / path.relative_to(deposit / "source")).read_bytes()
    assert {"Snakefile", "icha", "uv.lock", "Makefile"} <= {path.name for path in (deposit / "source").iterdir()}
    revision = yaml.safe_load((deposit / "CITATION.cff").read_text())["commit"]
    assert revision.startswith("icha-") and len(revision.rpartition("-")[2]) == 64
    assert not [
        path
        for path in deposit.rglob("*")
        if path.suffix in (".md", ".json", ".yaml", ".html") and str(work) in path.read_text()
    ]
    call(workflow / "icha", "verify", deposit, cwd=tmp_path)
    again = ["reproduce", f"{deposit}.zip", "--only", "smallest"]
    said = call(workflow / "icha", *again, cwd=tmp_path)
    assert "identical: every value in 2 files" in said


def test_the_recipe_for_conda_is_valid(tmp_path):
    render = "import sys; from rattler_build import Stage0Recipe, VariantConfig; "
    render += (
        "print(*(each.recipe.package.name for each in Stage0Recipe.from_file(sys.argv[1]).render(VariantConfig())))"
    )
    program = [UV, "run", "--quiet", "--no-project", "--with", "py-rattler-build==0.73.0", "python", "-c", render]
    assert call(*program, REPOSITORY / "recipe/recipe.yaml", cwd=tmp_path).split() == ["icha", "icha-workflow"]
