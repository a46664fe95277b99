"""Configurations, calls of Snakemake, and the campaign `smoke`, which runs once for all tests of the workflow."""

import contextlib
import copy
import fcntl
import gc
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# Each worker process of pytest-xdist takes one core. Libraries read the variable when they are imported.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# Each job of a workflow is a process of its own, which would otherwise compile all modules.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import pytest
import yaml
from demo_configuration import GOOD
from hypothesis import settings
from snakemake_calls import call_snakemake

REPOSITORY = Path(__file__).parents[1]
PARTS = ("Snakefile", "icha", "workflow", "config", "profiles", ".gitignore", "Makefile", "LICENSE")
PARTS += ("pyproject.toml", "uv.lock", "README.md")
SMOKE = "config/campaigns/smoke.yaml"
# Figures of the campaign `smoke` in tests, one for each kind of input, studies without others of their kind, and
# replacements that make its runs smaller.
FIGURES = ("fig1_jkr", "fig2_area_and_gap", "fig10_model_error", "fig13_loops")
LEFT_OUT = ("multi_slope_truth", "pull_far")
SMALLER = {
    "[3.16e-3, 1.0e-2]\n    turning_points": "[1.0e-3, 3.16e-3]\n    turning_points",
    "pressure: 5.0e-3\n      - reduced_pressure: 1.0e-2": "pressure: 1.5e-3\n      - reduced_pressure: 3.16e-3",
    "study: pull_far": "study: pull",
}
# A figure of the user's own, whose script lies beside the configuration.
SPOTS = """
from matplotlib.figure import Figure


def draw(study):
    'Number of spots against load.'
    figure = Figure()
    figure.subplots().plot(study["reduced_pressure"].values.ravel(), study["spot_count"].values.ravel(), "o")
    return figure
"""
# By whom and where the campaign `smoke` is run: words that are nowhere else.
TRACES = dict.fromkeys(("USER", "LOGNAME", "USERNAME"), "zwetschgenwirt")
TRACES |= {"HOSTNAME": "mirabellenrechner", "TOKEN": "hagebuttengeheimnis"}
# Number of random cases of a test; `--hypothesis-profile thorough` tries more. The cases are the same in every session,
# so no test fails by chance.
settings.register_profile("fast", max_examples=24, deadline=None, derandomize=True, database=None)
settings.register_profile("thorough", settings.get_profile("fast"), max_examples=100)
settings.load_profile("fast")

# Files with the longest tests, the longest first. If such a file came last, one core would wait for it. With
# `--dist worksteal` one worker begins with these files and the campaign, the other in the middle of the list.
LONG = ("cli_run", "wheel", "slurm", "snakemake_versions", "docs", "damaged_surfaces", "every_case_ends", "invariances")
LONG += ("interruptions", "reruns", "workflow", "rough_contacts", "full_contact", "energy_balance", "in_browser")


def _numbers(text):
    """Expand `3` or `1-20`."""
    first, _, last = text.partition("-")
    return list(range(int(first), int(last or first) + 1))


def pytest_addoption(parser):
    """Add the option for the series of random cases of test_every_case_ends.py."""
    parser.addoption("--series", type=_numbers, default="1", help="series of random cases: 3, or 1-20 (default: 1)")


def pytest_collection_modifyitems(items):
    """Sort the longest files to the beginning; exclude imported modules from garbage collection."""
    gc.freeze()
    rank = {f"test_{name}.py": number for number, name in enumerate(LONG)}
    items.sort(key=lambda item: rank.get(item.path.name, len(LONG)))


def snakemake_command(*arguments, configuration=SMOKE):
    """Return command and environment of a call of Snakemake in a copy of the project."""
    chosen = ["--configfile", str(configuration)] if configuration else []
    return [sys.executable, "-m", "snakemake", *arguments, *chosen], dict(os.environ)


def snakemake(project, *arguments, configuration=SMOKE, **variables):
    """Call Snakemake in a copy of the project; return the finished process with its output as `stdout`."""
    command, environment = snakemake_command(*arguments, configuration=configuration)
    environment |= {"PYTHONPATH": str(project)} | variables
    with tempfile.NamedTemporaryFile("w+", encoding="utf-8", errors="replace") as output:
        code = call_snakemake(project, command[2:], environment, output.name)
        return subprocess.CompletedProcess(command, code, output.read())


def smaller_smoke():
    """Return the text of the campaign `smoke` with smaller runs, fewer studies and fewer figures."""
    text = (REPOSITORY / SMOKE).read_text(encoding="utf-8")
    for large, small in SMALLER.items():
        assert large in text
        text = text.replace(large, small)
    figures, studies = "|".join(FIGURES), "|".join(LEFT_OUT)
    for entry in (rf"(?!({figures}):)fig\w+", rf"({studies})"):
        text = re.sub(rf"^  {entry}:\n(    .*\n)+", "", text, flags=re.MULTILINE)
    return text.replace("figures:\n", "figures:\n  spots: {study: challenge, script: spots.py}\n")


def copy_project(source, target, changed=()):
    """Copy the files of the program, some with changed text, and commit them, as in a clone."""
    target.mkdir(parents=True)
    for part in PARTS:
        if (source / part).is_dir():
            shutil.copytree(source / part, target / part, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copyfile(source / part, target / part)
    for file, text in dict(changed).items():
        (target / file).write_text(text, encoding="utf-8")
    author = {"NAME": "nobody", "EMAIL": "nobody@example.org", "DATE": "2000-01-01T00:00:00Z"}
    variables = {f"GIT_{role}_{key}": value for role in ("AUTHOR", "COMMITTER") for key, value in author.items()}
    for command in (["init", "--quiet"], ["add", "."], ["commit", "--quiet", "--message", "A copy"]):
        subprocess.run(["git", *command], cwd=target, env=os.environ | variables, check=True)
    return target


@pytest.fixture
def load(tmp_path):
    """Load GOOD with values changed at dotted keys (`None` as a value deletes the key)."""

    from icha.configuration.load import load_configuration

    def loaded(changes=None, overrides=None, text=GOOD, **options):
        content = yaml.safe_load(text)
        for key, value in copy.deepcopy(changes or {}).items():
            *path, last = key.split(".")
            inside = content
            for part in path:
                inside = inside[int(part) if isinstance(inside, list) else part]
            if value is None:
                del inside[last]
            else:
                inside[int(last) if isinstance(inside, list) else last] = value
        file = tmp_path / "campaign.yaml"
        file.write_text(yaml.safe_dump(content, sort_keys=False))
        return load_configuration(file, overrides, **options)

    return loaded


@pytest.fixture(scope="session")
def smoke(tmp_path_factory):
    """Copy of the project with the finished, smaller campaign `smoke`; tests must not change it."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent  # shared by all worker processes
    project = folder / "smoke"
    with (folder / "smoke.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not project.exists():
            copy_project(REPOSITORY, project, {SMOKE: smaller_smoke(), "config/campaigns/spots.py": SPOTS})
            run = snakemake(project, "all", "references", "publish", **TRACES)
            assert run.returncode == 0, run.stdout
    return project


def wait_for(condition, seconds=120):
    """Wait until a condition is true; a missing file counts as false."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        with contextlib.suppress(FileNotFoundError):
            if condition():
                return
        time.sleep(0.02)
    raise AssertionError(f"the condition was not met in {seconds} s")
