"""After an edit only the results that depend on it are computed again.

A copy of the project with a finished campaign is edited. A dry run then lists the jobs that Snakemake would run.
"""

import os
import re
import shutil
import time

import pytest
from conftest import REPOSITORY, SMOKE, copy_project, snakemake
from tiny_campaign import CAMPAIGN

from icha.datasets.files import read_run, write_dataset

AFTER_RUNS = {"analyse", "verdict", "draw_figures", "draw_figure", "report_page"}
# Beginnings of the names of rules of batches and of own figures.
BATCHES = ("make_surfaces", "compute_theories", "run", "draw_figures", "draw_figure")


def planned(project, *arguments):
    """Return the names of the rules that would run (of batches, the beginnings), and how many files are outdated."""
    plan = snakemake(project, "--dry-run", *arguments)
    text = plan.stdout
    assert plan.returncode == 0, text
    rules = set()
    if "Nothing to be done" not in text:
        table = text.split("Job stats:")[1].split("total")[0]
        names = re.findall(r"^(\S+) +\d+$", table, re.MULTILINE)
        rules = {next((each for each in BATCHES if name.startswith(f"{each}_")), name) for name in names} - {"all"}
    warning = re.search(r"^outdated, .*?\)(?: and (\d+) more results?)?$", text, re.MULTILINE)
    return rules, 1 + int(warning[1] or 0) if warning else 0


@pytest.fixture(scope="module")
def own(smoke, tmp_path_factory):
    return shutil.copytree(smoke, tmp_path_factory.mktemp("reruns") / "project")


@pytest.fixture
def edit(own):
    """Return a function that replaces text of a file or adds a statement; edits are undone at the end."""
    before = {}

    def edited(path, old=None, new="\n_ADDED_BY_A_TEST = 1\n"):
        file = own / path
        before.setdefault(file, (file.read_bytes(), file.stat()))
        text = file.read_text(encoding="utf-8")
        assert old is None or old in text, f"{path} does not contain {old!r}"
        file.write_text(text + new if old is None else text.replace(old, new, 1), encoding="utf-8")

    yield edited
    for file, (content, status) in before.items():
        file.write_bytes(content)
        os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))


def test_comments_docstrings_formatting_and_touch_run_nothing_nor_does_a_fresh_clone_with_unpacked_results(
    smoke, tmp_path
):
    clone = copy_project(smoke, tmp_path / "elsewhere")
    for file in [*clone.glob("icha/**/*.py"), *clone.glob("workflow/**/*.py")]:
        text = file.read_text(encoding="utf-8").replace('"""', '"""Changed: ', 1)
        file.write_text(f"# A new comment.\n{text}\n\n# And one at the end.\n", encoding="utf-8")
    now = time.time()
    for file in clone.rglob("*"):
        os.utime(file, (now, now))
    shutil.copytree(smoke / "results", clone / "results")
    shutil.copytree(smoke / ".snakemake", clone / ".snakemake")
    assert planned(clone) == (set(), 0)


@pytest.mark.parametrize(
    ("change", "rules", "outdated"),
    [
        # A new statement in a module.
        (["icha/boundary_elements/contact.py"], {"run", *AFTER_RUNS}, 6),
        (["icha/surfaces/spectrum.py"], {"make_surfaces", "run", "compute_theories", *AFTER_RUNS}, 3 + 25 + 2),
        (["icha/figures/loops.py"], {"draw_figures", "report_page"}, 0),
        ([SMOKE, "license: CC-BY-4.0", "license: CC0-1.0"], {"configuration", *AFTER_RUNS}, 0),
        # The references contain curves of Fuller & Tabor for each material.
        ([SMOKE, "2 mJ/m^2", "3 mJ/m^2"], {"configuration", "compute_theories", "run", *AFTER_RUNS}, 3 + 1),
        ([SMOKE, "seeds: [1, 2]", "seeds: [1, 2, 3]"], {"configuration", "make_surfaces", "run", *AFTER_RUNS}, 0),
    ],
)
def test_what_depends_on_a_change_is_computed_again(change, rules, outdated, own, edit):
    edit(*change)
    assert planned(own) == (rules, outdated)


def computed(project):
    """Run surfaces and runs of the campaign `tiny`; return the names of the computed files."""
    for log in project.glob("results/tiny/logs/*/*.log"):
        log.unlink()
    done = snakemake(project, "runs", configuration="config/campaigns/tiny.yaml")
    assert done.returncode == 0, done.stdout
    logs = (log.read_text() for log in project.glob("results/tiny/logs/*/*.log"))
    return {name for log in logs for name in re.findall(r"^\d+ of \d+: tiny/(\S+)$", log, re.MULTILINE)}


@pytest.mark.slow
def test_only_new_and_changed_files_are_computed(tmp_path):
    project = copy_project(REPOSITORY, tmp_path / "project")
    configuration = project / "config/campaigns/tiny.yaml"
    configuration.write_text(CAMPAIGN)
    run = "runs/load/rough/seed{}/slope1/{}"
    runs = {run.format(seed, material) for seed in (1, 2) for material in ("bare", "soft")}
    assert computed(project) == runs | {"surfaces/rough/seed1", "surfaces/rough/seed2"}

    # A new seed, and results without records of Snakemake: one is cut off, one has been removed, and one of other
    # settings, older than its surface, is in the place of another.
    shutil.rmtree(project / ".snakemake")
    configuration.write_text(CAMPAIGN.replace("seeds: [1, 2]", "seeds: [1, 2, 3]"))
    cut_off, removed, replaced = (run.format(1, "bare"), run.format(2, "soft"), run.format(1, "soft"))
    files = [project / f"results/tiny/{name}.nc" for name in (cut_off, removed, replaced)]
    os.truncate(files[0], 5000)
    files[1].unlink()
    write_dataset(read_run(files[2]).load().assign_attrs(config_sha256="0" * 64), files[2])
    os.utime(files[2], (1e9, 1e9))
    new = {run.format(3, material) for material in ("bare", "soft")} | {"surfaces/rough/seed3"}
    assert computed(project) == new | {cut_off, removed, replaced}
    assert computed(project) == set()
