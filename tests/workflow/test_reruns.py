"""After an edit only the results that depend on it are computed again.

A copy of the project with a finished campaign is edited. A dry run then lists the jobs that Snakemake would run.
"""

import ast
import os
import re
import shutil
import sys
import time
from pathlib import Path

import pytest
from conftest import REPOSITORY, SMOKE, copy_project, snakemake

from icha.contact.models import MODELS

RUNS_AND_AFTER = {
    "run",
    "campaign_dataset",
    "table",
    "comparison",
    "model_error",
    "answers",
    "sensitivity",
    "checks",
    "verdict",
    "figure",
    "report_page",
}


def planned(project, *arguments):
    """Return the number of jobs of each rule that would run, and the messages of these jobs."""
    plan = snakemake(project, "--dry-run", *arguments)
    text = plan.stdout
    assert plan.returncode == 0, text
    jobs = {}
    if "Nothing to be done" not in text:
        table = text.split("Job stats:")[1].split("total")[0]
        jobs = {name: int(count) for name, count in re.findall(r"^(\w+) +(\d+)$", table, re.MULTILINE)}
        jobs.pop("all", None)
    return jobs, re.findall(r"^Job \d+: (.*)$", text, re.MULTILINE)


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
    for file in [*clone.glob("icha/**/*.py"), *clone.glob("workflow/**/*.py"), *clone.glob("workflow/**/*.smk")]:
        text = file.read_text(encoding="utf-8")
        if file.suffix == ".py":
            tree = ast.parse(text)
            doc = tree.body[0] if tree.body and ast.get_docstring(tree) else None
            if doc is not None:
                lines = text.splitlines(keepends=True)
                text = "".join(['"""Another docstring."""\n', *lines[doc.end_lineno :]])
            text = f"# A new comment.\n{text}\n\n# And one at the end.\n"
        file.write_text(text, encoding="utf-8")
    now = time.time()
    for file in clone.rglob("*"):
        os.utime(file, (now, now))
    shutil.copytree(smoke / "results", clone / "results")
    shutil.copytree(smoke / ".snakemake", clone / ".snakemake")
    assert planned(clone) == ({}, [])


@pytest.mark.parametrize(
    ("path", "rules", "some"),
    [
        ("icha/boundary_elements/contact.py", RUNS_AND_AFTER, {"run": 6 + 1}),
        ("icha/figures/fig13_loops.py", {"figure", "report_page"}, {"figure": 1}),
    ],
)
def test_a_new_statement_runs_the_jobs_that_use_its_module(path, rules, some, own, edit):
    edit(path)
    jobs, _ = planned(own)
    assert set(jobs) == rules and some.items() <= jobs.items()


@pytest.mark.parametrize(
    ("changes", "some", "without"),
    [
        ({"name: ICHA developers": "name: A team"},
         {"configuration": 1, "campaign_dataset": 1, "report_page": 1}, {"surface", "run", "reference"}),
        ({"license: CC-BY-4.0": "license: CC0-1.0"}, {"run": 27, "surface": 3, "campaign_dataset": 1}, set()),
        ({"25 MPa": "25000 kPa", "fig1_jkr: {}": "fig1_jkr: {tabor_parameter: 4}"},
         {"configuration": 1, "figure": 1, "report_page": 1}, {"run", "surface"}),
        # The references contain curves of Fuller & Tabor for each material.
        ({"2 mJ/m^2": "3 mJ/m^2"}, {"run": 3 + 1, "reference": 1}, {"surface"}),
        ({"seeds: [1, 2]": "seeds: [1, 2, 3]"}, {"surface": 1, "run": 3 + 3}, set()),
    ],
)  # fmt: skip
def test_a_changed_value_runs_the_jobs_that_use_it(changes, some, without, own, edit):
    for old, new in changes.items():
        edit(SMOKE, old, new)
    jobs, messages = planned(own)
    assert some.items() <= jobs.items() and not without & set(jobs)
    if "seeds: [1, 2]" in changes:
        assert all("seed 3" in each for each in messages if each.startswith(("Surface", "Sweep")))


def test_published_points_run_references(own, edit):
    edit("icha/references/literature.json", "0.185", "0.186")
    jobs, messages = planned(own)
    assert {"reference", "figure", "report_page"} <= set(jobs) and "Figure fig2_area_and_gap" in messages
    assert "run" not in jobs


@pytest.fixture
def fingerprint(monkeypatch):
    """The module `workflow/fingerprint.py`, newly imported."""
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow"))
    monkeypatch.delitem(sys.modules, "fingerprint", raising=False)
    import fingerprint

    return fingerprint


# Scripts that take long.
EXPENSIVE = {"make_surface", "run_sweep", "make_references"}


def test_fingerprints_contain_the_modules_that_a_script_uses(fingerprint):
    # A run imports the module of its model by name, a figure its own module.
    by_name = {"run_sweep": [model.module for model in MODELS.values()], "draw_figure": ["icha.figures.fig1_jkr"]}
    files = {
        file.stem: fingerprint.files_of(file, *by_name.get(file.stem, ()))
        for file in (REPOSITORY / "workflow/scripts").glob("*.py")
    }
    for module, scripts in {
        "boundary_elements/contact": {"run_sweep"},
        "equilibrium/newton": {"run_sweep"},
        "asperity/jkr": {"run_sweep", "make_references"},
        "simulation": {"run_sweep"},
        "references/persson": {"make_references"},
        "surfaces/spectrum": {"make_surface", "make_references"},
        "configuration/campaign": set(),
        "figures/style": set(),
        "report/report": set(),
    }.items():
        assert {script for script in EXPENSIVE if f"icha/{module}.py" in files[script]} == scripts, module
    for script, module in {
        "draw_figure": "figures/style",
        "make_report": "report/report",
        "publish": "configuration/campaign",
    }.items():
        assert f"icha/{module}.py" in files[script]


def test_fingerprints_of_contact_models_are_separate_and_exclude_what_changes_no_number(fingerprint):
    script = REPOSITORY / "workflow/scripts/run_sweep.py"
    asperities, patches = (set(fingerprint.files_of(script, model.module)) for model in MODELS.values())
    assert any("/equilibrium/" in name for name in asperities - patches)
    assert "icha/boundary_elements/contact.py" in patches - asperities
    assert not any("/equilibrium/" in name for name in patches - asperities)
    assert not {"job.py", "icha/support/printable.py", "icha/support/program.py"} & (asperities | patches)
    # Modules that write and read datasets are part of the fingerprint.
    assert {"icha/support/atomic_files.py", "icha/datasets/files.py"} <= asperities


def test_fingerprints_refuse_imports_that_they_cannot_follow(tmp_path, fingerprint):
    script = tmp_path / "script.py"
    script.write_text("from icha import simulate\n")
    with pytest.raises(ValueError, match="from the module that defines it"):
        fingerprint.code_fingerprint(script)


@pytest.mark.parametrize("cache", ["complete", "cut off", "not writable"])
def test_a_changed_module_is_read_again_despite_the_cache(cache, tmp_path, fingerprint, monkeypatch):
    monkeypatch.setattr(fingerprint, "_CACHE", tmp_path / "cache.json")
    module = tmp_path / "module.py"
    module.write_text('from os import path, sep\n\nNAME = "data.csv"\n')
    first = fingerprint.code_fingerprint(module)
    if cache == "not writable":
        (tmp_path / "cache.json").mkdir()
    fingerprint.save_cache()

    def begin():
        fingerprint._syntaxes.clear()
        fingerprint._syntax_of.cache_clear()

    begin()
    if cache == "cut off":
        (tmp_path / "cache.json").write_text((tmp_path / "cache.json").read_text()[:-9])
    with monkeypatch.context() as reading:
        if cache == "complete":
            reading.setattr(fingerprint, "_read", None)
        assert fingerprint.code_fingerprint(module) == first
    begin()
    module.write_text('from os import path, sep\n\nNAME = "data.txt"\n')
    assert fingerprint.code_fingerprint(module) != first


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc/uptime")
def test_files_of_the_system_that_a_module_names_are_not_part_of_it(fingerprint, tmp_path):
    script = tmp_path / "ask.py"
    script.write_text("UPTIME = '/proc/uptime'\n")
    first, before = fingerprint.code_fingerprint(script), Path("/proc/uptime").read_text()
    while Path("/proc/uptime").read_text() == before:
        time.sleep(0.01)
    assert fingerprint.code_fingerprint(script) == first
