"""Examples and links of the documentation: configurations load, Python runs, commands exist, links work."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections import Counter
from functools import cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

import compared_campaign as compared
import numpy as np
import own_slopes_campaign as crops
import pytest
import xarray as xr
import yaml
from outside_validators import sealed
from sampled_cases import sampled

import icha
from icha.configuration.campaign import Campaign
from icha.configuration.load import load_configuration
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_campaign, write_dataset
from icha.datasets.results import FIGURE_ENDINGS
from icha.datasets.table import as_csv, tidy_table
from icha.figures.registry import draw_figure
from icha.uncertainty.estimates import estimate_campaign
from icha.uncertainty.sensitivity import sensitivity_of_campaign

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
TUTORIAL = DOCS / "tutorial.md"
# Pages with instructions.
GUIDES = [TUTORIAL, ROOT / "README.md", *sorted(DOCS.glob("howto/*.md"))]
PAGES = [*sorted(DOCS.rglob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]


@cache
def blocks(page, language):
    """Return the code blocks of one language with their first lines."""
    text = page.read_text(encoding="utf-8")
    found = re.finditer(rf"^```{language}\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    return [(text[: match.start()].count("\n") + 1, match[1]) for match in found]


# Configurations.


@cache
def tutorial_campaign():
    """Return the campaign of the tutorial, to which other pages add sections."""
    (first, *_) = [block for _, block in blocks(TUTORIAL, "yaml") if re.search("^name:", block, re.MULTILINE)]
    return first


def merge_block(campaign, block):
    """Return a configuration with a block added: sections are merged, their entries replaced."""
    merged = dict(campaign)
    for section, entries in block.items():
        before = merged.get(section)
        merged[section] = before | entries if isinstance(before, dict) and isinstance(entries, dict) else entries
    return merged


def campaigns(page):
    """Yield the full configurations of a page: a block with a name is complete, others add to the one before."""
    current = yaml.safe_load(tutorial_campaign())
    for line, block in blocks(page, "yaml"):
        added = yaml.safe_load(block)
        if added is None or not set(added) & set(Campaign.model_fields):
            continue  # a comment, or a section of another file
        current = dict(added) if "name" in added else merge_block(current, added)
        yield line, current


def write_data(folder):
    """Write small files with the names and units of the pages; those of the challenge are in 0.1 mm."""
    import h5py

    spectrum = icha.SelfAffineSpectrum(period=100e-6, rolloff_wavelength=40e-6, short_wavelength=12e-6, hurst=0.8)
    heights = spectrum.realise(grid=36, seed=1).scaled_to_rms_slope(0.2).heights
    y, x = np.indices(heights.shape) / len(heights)
    folder.mkdir(parents=True, exist_ok=True)
    np.save(folder / "heights.npy", heights / 1e-6)
    q = np.geomspace(2 * np.pi / 100e-6, 2 * np.pi / 13e-6, 20)
    icha.SpectrumTable(q, spectrum.psd(q)).save(folder / "sample.txt")
    (folder / "rubber.csv").write_text("pressure,area\n0.8,0.12\n2.4,0.37\n", encoding="utf-8")
    (folder / "lens.csv").write_text("force,depth,radius\n-0.02,-0.1,40\n0.2,1.7,70\n", encoding="utf-8")
    z = heights / 1e-4
    np.savetxt(folder / "surface.2048x2048.ASCII.dat", z)
    np.savetxt(folder / "surface.0512x0512.ASCII.xyz.dat", np.column_stack([x.ravel(), y.ravel(), z.ravel()]))
    with h5py.File(folder / "surface.8192x8192.h5", "w") as file:
        file["surface"] = z


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder like that of the project, with the data of the pages."""
    folder = tmp_path_factory.mktemp("project")
    write_data(folder / "config/data")
    shutil.copytree(ROOT / "config/topographies", folder / "config/topographies")
    (folder / "config/campaigns").mkdir()
    shutil.copyfile(DOCS / "examples/own_figure.py", folder / "config/campaigns/own_figure.py")
    return folder


def loaded(folder, campaign):
    path = folder / f"config/campaigns/{campaign['name']}.yaml"
    path.write_text(yaml.safe_dump(campaign, sort_keys=False), encoding="utf-8")
    return load_configuration(path).campaign


@pytest.mark.parametrize("page", GUIDES, ids=lambda page: page.stem)
def test_every_configuration_is_a_valid_one(page, folder):
    for line, campaign in campaigns(page):
        try:
            assert loaded(folder, campaign).all_runs
        except ValueError as error:
            pytest.fail(f"{page.name}, block at line {line}: {error}")


def test_settings_of_a_cluster_are_those_of_the_profile():
    profile = (ROOT / "profiles/slurm/config.yaml").read_text(encoding="utf-8")
    for line, block in blocks(DOCS / "howto/cluster.md", "yaml"):
        settings = yaml.safe_load(block)
        for key in {*settings, *settings.get("default-resources", ()), *settings.get("set-resources", ())}:
            assert re.search(rf"^[# ]*{key}:", profile, re.MULTILINE), f"block at line {line}: {key}"


def test_studies_have_the_runs_that_the_page_counts(folder):
    *_, (_, campaign) = campaigns(DOCS / "howto/vary.md")
    counts = Counter(case.study for case in loaded(folder, campaign).all_runs)
    counted = {"roughness": 18, "energy": 4, "along": 3, "chosen": 6, "short": 2, "light": 1}
    assert {study: counts[study] for study in counted} == counted
    text = (DOCS / "howto/vary.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`((?:milled|weak)-[^`]*)`", text))
    made = {name for case in loaded(folder, campaign).all_runs for name in (case.surface, case.material)}
    assert named and named <= made


# Python.


@cache
def small_run(case, settings):
    """A run of a campaign, but on a surface of few summits."""
    path, material = (dict(each) for each in settings)
    spectrum = icha.SelfAffineSpectrum(period=1e-3, rolloff_wavelength=0.4e-3, short_wavelength=0.15e-3, hurst=0.7)
    surface = spectrum.realise(grid=32, seed=case.seed).scaled_to_rms_slope(case.rms_slope)
    return icha.simulate(surface, icha.Material(**material), icha.Path(**path), seed=case.seed)


def frozen(settings):
    return tuple((key, tuple(value) if isinstance(value, list) else value) for key, value in settings.items())


def write_results(folder, campaign):
    """The dataset of a campaign, of small surfaces."""
    runs = []
    for case in campaign.all_runs:
        path = campaign.studies[case.study].path_settings()
        material = campaign.materials[case.material].model_dump(exclude_none=True)
        runs.append((case, small_run(case, (frozen(path), frozen(material)))))
    attributes = {"title": campaign.title, "campaign": campaign.name}
    write_dataset(campaign_tree(runs, attrs=attributes), folder / f"results/{campaign.name}/dataset/{campaign.name}.nc")


@pytest.fixture(scope="module")
def with_results(folder):
    """The folder with the datasets that the pages read: of the tutorial with seeds, pulling as well, and of others."""
    tutorial = yaml.safe_load(tutorial_campaign())
    ((_, pulling), *_) = campaigns(DOCS / "howto/unloading.md")
    study = tutorial["studies"]["load"] | {"seeds": [1, 2]}
    pull = pulling["studies"]["pull"] | {"max_step": 0.5, "turning_points": [], "materials": ["weak"]}
    pull["targets"] = {"reduced_pressures": pull["targets"]["reduced_pressures"][:1]}
    write_results(folder, loaded(folder, tutorial | {"studies": {"load": study, "pull": pull}}))
    ((_, measured), *_) = campaigns(DOCS / "howto/measured_campaign.md")
    measured["studies"]["ensemble"]["seeds"] = [1, 2]
    write_results(folder, loaded(folder, measured))
    figure = [folder / f"results/mine/figures/fig2_area_and_gap.{ending}" for ending in FIGURE_ENDINGS]
    figure[0].parent.mkdir()
    inputs = {"campaign": str(folder / "results/mine/dataset/mine.nc")}
    draw_figure("fig2_area_and_gap", *figure, inputs=inputs, arguments={"study": "load"})
    table = as_csv(tidy_table(read_campaign(folder / "results/mine/dataset/mine.nc")))
    (folder / "results/mine/dataset/mine.csv").write_text(table, encoding="utf-8")
    answers = estimate_campaign(compared.tree_of_both())["one"].to_dataset()
    write_dataset(xr.DataTree.from_dict({"/load": answers}), folder / "results/mine/aggregated/answers.nc")
    runs, samples = sampled("uncertain")
    sensitivity = sensitivity_of_campaign(campaign_tree(runs), {"uncertain": samples})
    write_dataset(sensitivity, folder / "results/mine/aggregated/sensitivity.nc")
    deposit = folder / "results/mine/publish/mine-1.0.0"
    (deposit / "dataset").mkdir(parents=True)
    shutil.copyfile(folder / "results/mine/dataset/mine.nc", deposit / "dataset/mine.nc")
    sealed(deposit)
    write_dataset(crops.tree(), folder / "results/crops/dataset/crops.nc")
    return folder


# The example on hysteresis takes a quarter of an hour.
@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if blocks(page, "python") and page.stem != "hysteresis"],
    ids=lambda page: page.stem,
)
def test_every_piece_of_python_runs(page, with_results, monkeypatch, tmp_path):
    monkeypatch.setenv("MPLBACKEND", "agg")
    code = blocks(page, "python")
    monkeypatch.chdir(tmp_path)
    for name in ("results", "config"):
        (tmp_path / name).symlink_to(with_results / name)
    names = {"__name__": "page"}
    # One after the other, as they are read.
    for line, block in code:
        exec(compile("\n" * line + block, page.name, "exec"), names)
    drawn = [match for _, block in code for match in re.findall(r'savefig\("(.*?)"', block)]
    assert all((tmp_path / name).stat().st_size > 0 for name in drawn)


# Commands.


def commands(page):
    for line, block in blocks(page, "sh"):
        for command in block.replace("\\\n", " ").splitlines():
            if command.strip() and not command.strip().startswith("#"):
                yield line, shlex.split(command, comments=True)


MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
MAKE_TARGETS = {name for names in re.findall(r"^([\w .-]+):", MAKEFILE, re.MULTILINE) for name in names.split()}
RULES = "".join(path.read_text(encoding="utf-8") for path in [ROOT / "Snakefile", *ROOT.glob("workflow/rules/*")])


def check_icha(arguments):
    """Parse the arguments as `icha` does, without running anything."""
    import click
    import typer

    from icha.cli import app

    group = typer.main.get_command(app)
    options = ("--help", "--version")
    if not arguments or arguments[0] in options:
        return
    command = group.get_command(click.Context(group), arguments[0])
    assert command is not None, f"there is no command icha {arguments[0]}"
    if arguments[-1] != "--help":
        command.make_context(arguments[0], list(arguments[1:]))


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "sh")], ids=lambda page: page.stem)
def test_every_command_exists(page):
    known = {"git", "cd", "source", "cp", "mkdir", "export", "sudo", "sbatch", "squeue", "scancel", "sinfo"}
    known |= {"podman", "pre-commit", "pytest"}
    installers = {"pip", "python", "python3", "uv", "uvx", "pipx"}
    for line, (program, *arguments) in commands(page):
        where = f"{page.name}, block at line {line}: {program} {shlex.join(arguments)}"
        program = Path(program).name
        if program in installers:
            if "icha" in arguments:  # `uvx --from … icha run smoke`
                check_icha(arguments[arguments.index("icha") + 1 :])
        elif program == "icha":
            check_icha(arguments)
        elif program == "make":
            assert {each for each in arguments if "=" not in each} <= MAKE_TARGETS, where
        elif program == "snakemake":
            assert arguments[0].startswith("-") or f"\nrule {arguments[0]}:" in RULES, where
        else:
            assert program in known, where
        for word in arguments:
            name = word.partition("=")[2] or word
            if name.startswith("config/campaigns/") and "mine" not in name and "scan" not in name:
                assert (ROOT / name).exists(), where


# The site.


@pytest.mark.slow
def test_the_site_is_built_without_a_warning_and_needs_no_network(tmp_path):
    """Sphinx warns about broken links within the site, and about pages without a link to them."""
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "docs", str(tmp_path)]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=os.environ | {"OMP_NUM_THREADS": "1"})
    assert built.returncode == 0, built.stderr
    for page in tmp_path.rglob("*.html"):
        fetched = re.findall(r'<(?!a\b)[^>]* (?:href|src)="((?:https?:)?//[^"]*)"', page.read_text(encoding="utf-8"))
        assert not fetched, page
    for style in tmp_path.rglob("*.css"):
        assert not re.search(r"(url\(|@import )[\"']?(https?:)?//", style.read_text(encoding="utf-8")), style


def test_links_of_the_sources_lead_to_files():
    """The sources are also read in the browser of the repository."""
    broken = []
    for page in [*DOCS.rglob("*.md"), ROOT / "README.md", ROOT / "config/README.md"]:
        text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            parts = urlsplit(target)
            if not parts.scheme and parts.path and not (page.parent / unquote(parts.path)).exists():
                broken.append(f"{page.relative_to(ROOT)}: {target}")
    assert not broken, "\n".join(broken)


def test_the_page_of_formats_lists_every_ending_of_every_reader():
    """Formats that ICHA reads itself are in the first table, all others of SurfaceTopography in the second."""
    from SurfaceTopography.IO import readers

    page = (DOCS / "formats.md").read_text(encoding="utf-8")
    usual = {
        ending for reader in readers for ending in reader._file_extensions or () if ending not in ("003", "004", "005")
    }
    assert not [ending for ending in sorted(usual) if f"`.{ending}`" not in page]
