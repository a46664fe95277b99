"""What is computed again after an edit: what depends on it, and nothing else.

A copy of the project with a finished campaign is edited; a dry run then says which jobs Snakemake would run.
"""

import ast
import os
import re
import shutil
import sys
import time
from pathlib import Path

import pytest
from conftest import FIGURES, copy_project, snakemake

from icha.contact.models import MODELS

REPOSITORY = Path(__file__).parents[2]

ALL_RULES = {
    "configuration",
    "surface",
    "reference",
    "boundary_elements",
    "boundary_element_loop",
    "run",
    "campaign_dataset",
    "comparison",
    "model_error",
    "checks",
    "verdict",
    "figure",
    "report_page",
}
BESIDE_RUNS = {"reference", "boundary_elements", "boundary_element_loop"}
WHAT_FOLLOWS_RUNS = ALL_RULES - {"configuration", "surface"} - BESIDE_RUNS


def planned(project, *arguments):
    """Rules that would run, with the number of their jobs, and the messages of those jobs."""
    plan = snakemake(project, "--dry-run", *arguments)
    text = plan.stdout
    assert plan.returncode == 0, text
    jobs = {}
    if "Nothing to be done" not in text:
        table = text.split("Job stats:")[1].split("total")[0]
        jobs = {name: int(count) for name, count in re.findall(r"^(\w+) +(\d+)$", table, re.MULTILINE)}
        jobs.pop("all", None)
    return jobs, re.findall(r"^Job \d+: (.*)$", text, re.MULTILINE)


def replace(file, old, new):
    text = file.read_text(encoding="utf-8")
    assert old in text, f"{file.name} no longer holds {old!r}"
    file.write_text(text.replace(old, new, 1), encoding="utf-8")


def add_statement(file):
    """Change what a module does, if only by a name that nobody asks for."""
    assert file.is_file()
    with file.open("a", encoding="utf-8") as module:
        module.write("\n_ADDED_BY_A_TEST = 1\n")


@pytest.fixture
def fingerprint(monkeypatch):
    """The module of the workflow."""
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow"))
    import fingerprint

    return fingerprint


@pytest.mark.slow
def test_nothing_runs_twice(project):
    assert planned(project) == ({}, [])


def test_comments_docstrings_formatting_and_touch_run_nothing(project):
    now = time.time()
    for file in [*project.glob("icha/**/*.py"), *project.glob("workflow/**/*.py"), *project.glob("workflow/**/*.smk")]:
        text = file.read_text(encoding="utf-8")
        if file.suffix == ".py":
            tree = ast.parse(text)
            doc = tree.body[0] if tree.body and ast.get_docstring(tree) else None
            if doc is not None:
                lines = text.splitlines(keepends=True)
                text = "".join(['"""Another docstring."""\n', *lines[doc.end_lineno :]])
            text = f"# A new comment.\n{text}\n\n# And one at the end.\n"
        file.write_text(text, encoding="utf-8")
        os.utime(file, (now, now))
    os.utime(project / "config/campaigns/smoke.yaml", (now, now))
    assert planned(project) == ({}, [])


@pytest.mark.slow
def test_a_fresh_clone_with_unpacked_results_runs_nothing(smoke, tmp_path):
    clone = copy_project(smoke, tmp_path / "elsewhere")
    now = time.time()
    for file in clone.rglob("*"):
        os.utime(file, (now, now))
    shutil.copytree(smoke / "results", clone / "results")
    shutil.copytree(smoke / ".snakemake", clone / ".snakemake")
    assert planned(clone) == ({}, [])


SOLVERS = {"solve_boundary_elements", "follow_boundary_elements"}


@pytest.mark.parametrize(
    ("module", "scripts"),
    {
        "boundary_elements/contact": {"run_sweep"},
        "equilibrium/equilibrium": {"run_sweep"},
        "asperity/jkr": {"run_sweep", "make_references"},
        "half_space/interaction": {"run_sweep"},
        "simulation": {"run_sweep"},
        "path/loading": {"run_sweep"},
        "path/energy_balance": {"run_sweep"},
        # Boundary elements know nothing of the model: they are not solved again.
        "references/finite_range": SOLVERS,
        "references/persson": {"make_references"},
        "surfaces/spectrum": {"make_surface", "make_references"},
        "configuration/campaign": {"publish"},
        "report/report": {"make_report"},
    }.items(),
)
def test_scripts_whose_fingerprint_a_module_is_part_of(module, scripts, fingerprint):
    folder = REPOSITORY / "workflow/scripts"
    # A run imports its model by name.
    told = {"run_sweep": [model.module for model in MODELS.values()]}
    having = {
        file.stem
        for file in folder.glob("*.py")
        if f"icha/{module}.py" in fingerprint.files_of(file, *told.get(file.stem, ()))
    }
    assert having == scripts


def test_what_surrounds_all_scripts_is_part_of_no_fingerprint(fingerprint):
    script = REPOSITORY / "workflow/scripts/run_sweep.py"
    sweep = fingerprint.files_of(script, *(model.module for model in MODELS.values()))
    around = {"job.py", *(f"icha/support/{name}.py" for name in ("ownership", "printable", "processes"))}
    assert not around & set(sweep)
    # What writes and reads datasets is.
    assert {"icha/support/atomic_files.py", "icha/datasets/files.py"} <= set(sweep)


def test_models_of_contact_know_nothing_of_each_other(fingerprint):
    script = REPOSITORY / "workflow/scripts/run_sweep.py"
    asperities, patches = (set(fingerprint.files_of(script, model.module)) for model in MODELS.values())
    assert "icha/equilibrium/equilibrium.py" in asperities - patches
    assert "icha/boundary_elements/contact.py" in patches - asperities
    assert not any("/equilibrium/" in name for name in patches - asperities)


def test_the_physics_runs_sweeps_and_what_follows(project):
    add_statement(project / "icha/simulation.py")
    jobs, _ = planned(project)
    assert jobs["run"] == 19
    assert set(jobs) == WHAT_FOLLOWS_RUNS


@pytest.mark.slow
def test_the_spectrum_runs_surfaces_and_all_that_needs_them(project):
    add_statement(project / "icha/surfaces/spectrum.py")
    jobs, _ = planned(project)
    assert jobs["surface"] == 3
    assert set(jobs) == ALL_RULES - {"configuration"}


@pytest.mark.slow
def test_other_authors_run_the_dataset_which_names_them_and_no_sweep(project):
    replace(project / "config/campaigns/smoke.yaml", "name: ICHA developers", "name: A team")
    jobs, _ = planned(project)
    assert {"configuration", "campaign_dataset", "report_page"} <= set(jobs)
    assert not {"surface", "run", *BESIDE_RUNS} & set(jobs)


@pytest.mark.slow
def test_another_licence_runs_all_that_names_it(project):
    replace(project / "config/campaigns/smoke.yaml", "license: CC-BY-4.0", "license: CC0-1.0")
    jobs, _ = planned(project)
    assert jobs["run"] == 19 and jobs["surface"] == 3 and set(jobs) >= BESIDE_RUNS | {"campaign_dataset", "comparison"}


@pytest.mark.slow
def test_a_figure_runs_itself_and_the_report(project):
    add_statement(project / "icha/figures/fig3_distributions.py")
    jobs, messages = planned(project)
    assert jobs == {"figure": 1, "report_page": 1}
    assert "Figure fig3_distributions" in messages


@pytest.mark.slow
def test_the_style_runs_all_figures(project):
    add_statement(project / "icha/figures/style.py")
    jobs, _ = planned(project)
    assert jobs == {"figure": len(FIGURES), "report_page": 1}


@pytest.mark.slow
def test_a_model_of_contact_runs_its_own_sweeps(project):
    add_statement(project / "icha/boundary_elements/contact.py")
    jobs, messages = planned(project)
    assert jobs["run"] == 6 + 1 and set(jobs) <= WHAT_FOLLOWS_RUNS | {"run"}
    assert all(", boundary_elements/" in each for each in messages if "Sweep" in each)


@pytest.mark.slow
def test_boundary_elements_run_without_the_sweeps(project):
    add_statement(project / "icha/references/finite_range.py")
    jobs, _ = planned(project)
    assert jobs["boundary_elements"] == 6
    what_follows = {"model_error", "checks", "verdict", "figure", "report_page"}
    assert set(jobs) == {"boundary_elements", "boundary_element_loop"} | what_follows


@pytest.mark.slow
def test_a_finer_grid_costs_its_own_solutions(project):
    replace(project / "config/campaigns/smoke.yaml", "refinement: 2", "refinement: 3")
    jobs, messages = planned(project)
    assert jobs["boundary_elements"] == 4
    assert "run" not in jobs
    assert not [message for message in messages if "cmc_300nm" in message]


@pytest.mark.slow
def test_a_solution_that_is_lost_is_the_only_one_computed_again(project):
    (project / "results/smoke/references/boundary_elements/adhesive/challenge/seed2/slope1/cmc_300nm/p0.01.nc").unlink()
    jobs, _ = planned(project)
    assert jobs["boundary_elements"] == 1
    assert "run" not in jobs


@pytest.mark.slow
def test_the_page_template_runs_the_report(project):
    with (project / "icha/report/templates/report.html").open("a") as template:
        template.write("<!-- changed -->\n")
    assert planned(project)[0] == {"report_page": 1}


@pytest.mark.slow
def test_literature_runs_references_and_what_shows_them(project):
    replace(project / "icha/references/literature.json", "0.185", "0.186")
    jobs, messages = planned(project)
    assert set(jobs) == {"reference", "figure", "report_page"}
    assert "Figure fig2_area_and_gap" in messages


@pytest.mark.slow
def test_a_script_runs_its_own_rule_and_what_follows(project):
    add_statement(project / "workflow/scripts/compare_runs.py")
    assert set(planned(project)[0]) == {"comparison", "report_page"}


@pytest.mark.slow
def test_the_configurations_model_runs_nothing(project):
    for name in ("campaign", "load", "cases", "design", "studies"):
        add_statement(project / f"icha/configuration/{name}.py")
    assert planned(project) == ({}, [])


@pytest.mark.slow
def test_another_way_to_write_a_value_runs_no_sweep(project):
    replace(project / "config/campaigns/smoke.yaml", "25 MPa", "25000 kPa")
    jobs, _ = planned(project)
    assert "run" not in jobs and "surface" not in jobs
    assert "configuration" in jobs


@pytest.mark.slow
def test_a_value_runs_the_sweeps_that_it_concerns(project):
    replace(project / "config/campaigns/smoke.yaml", "2 mJ/m^2", "3 mJ/m^2")
    jobs, _ = planned(project)
    assert jobs["run"] == 3 + 1
    # A curve of Fuller & Tabor is that of the material.
    assert jobs["reference"] == 1 and not {"surface", "boundary_elements"} & set(jobs)


@pytest.mark.slow
def test_a_new_seed_costs_its_own_sweeps(project):
    replace(project / "config/campaigns/smoke.yaml", "seeds: [1, 2]", "seeds: [1, 2, 3]")
    jobs, messages = planned(project)
    assert jobs["surface"] == 1 and jobs["run"] == 3 + 3 and jobs["boundary_elements"] == 3
    own = ("Surface", "Sweep", "Boundary")
    assert all("seed 3" in message for message in messages if message.startswith(own))


@pytest.mark.slow
def test_an_option_of_a_figure_draws_that_figure(project):
    replace(project / "config/campaigns/smoke.yaml", "fig1_jkr: {}", "fig1_jkr: {tabor_parameter: 4}")
    jobs, messages = planned(project)
    assert jobs == {"configuration": 1, "figure": 1, "report_page": 1}
    assert "Figure fig1_jkr" in messages


def test_fingerprints_refuse_imports_that_they_cannot_follow(tmp_path, fingerprint):
    script = tmp_path / "script.py"
    script.write_text("from icha import simulate\n")
    with pytest.raises(ValueError, match="from the module that defines it"):
        fingerprint.code_fingerprint(script)
    script = tmp_path / "other.py"
    script.write_text("from icha.simulation import simulate\n")
    publish = REPOSITORY / "workflow/scripts/publish.py"
    assert fingerprint.code_fingerprint(script) != fingerprint.code_fingerprint(publish)


@pytest.fixture
def syntax(monkeypatch, tmp_path):
    """The module of the workflow, as a process begins with it, which keeps what it has read in `tmp_path`."""
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow"))
    import syntax

    monkeypatch.setattr(syntax, "_KEPT", tmp_path / "kept/syntax.json")

    def begun():
        for function in (syntax.syntax_of, syntax._kept, syntax._reader):
            function.cache_clear()
        syntax._new.clear()
        return syntax

    yield begun
    begun()


def _kept(syntax):
    syntax._keep()
    return syntax._KEPT.read_text(encoding="ascii")


def test_what_a_module_says_is_read_once_and_again_when_it_says_something_else(tmp_path, syntax, monkeypatch):
    module = tmp_path / "module.py"
    module.write_text('from os import path, sep\n\nNAME = "data.csv"\n')
    read = syntax().syntax_of(module)
    assert [tuple(each) for each in read.imports] == [(0, "os", "path"), (0, "os", "sep")]
    assert read.names == ["data.csv"]
    _kept(syntax_module := sys.modules["syntax"])
    with monkeypatch.context() as without:
        without.setattr(syntax_module, "_read", None)
        again = syntax().syntax_of(module)
    assert (again.digest, again.names) == (read.digest, read.names)
    assert [tuple(each) for each in again.imports] == [tuple(each) for each in read.imports]
    module.write_text('from os import path, sep\n\nNAME = "data.txt"\n')
    other = syntax().syntax_of(module)
    assert other.names == ["data.txt"] and other.digest != read.digest


@pytest.mark.parametrize("spoil", ["damaged", "cut off", "by another version"])
def test_what_was_kept_of_modules_is_believed_only_if_it_is_what_was_written(tmp_path, syntax, spoil, monkeypatch):
    module = tmp_path / "module.py"
    module.write_text("from os import path\n")
    read = syntax().syntax_of(module)
    text = _kept(sys.modules["syntax"])
    file = sys.modules["syntax"]._KEPT
    if spoil == "by another version":
        monkeypatch.setattr(sys, "version", "3.99")
    else:
        assert '"path"' in text
        file.write_text(text.replace('"path"', '"sep"') if spoil == "damaged" else text[:-30], encoding="ascii")
    assert syntax()._kept() == {}
    assert syntax().syntax_of(module) == read


def test_what_cannot_be_kept_of_modules_is_read_all_the_same(tmp_path, syntax, monkeypatch):
    module = tmp_path / "module.py"
    module.write_text("import os\n")
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(syntax(), "_KEPT", tmp_path / "file/syntax.json")
    assert syntax().syntax_of(module).imports == [(0, "os", None)]
    sys.modules["syntax"]._keep()


@pytest.mark.skipif(sys.platform != "linux", reason="needs a file of the system that says something else every time")
def test_files_of_the_system_that_a_module_names_are_not_part_of_it(fingerprint, tmp_path):
    script = tmp_path / "ask.py"
    script.write_text("UPTIME = '/proc/uptime'\n")
    first, before = fingerprint.code_fingerprint(script), Path("/proc/uptime").read_text()
    while Path("/proc/uptime").read_text() == before:
        time.sleep(0.01)
    assert fingerprint.code_fingerprint(script) == first
