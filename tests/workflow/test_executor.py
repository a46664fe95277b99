"""The executor that forks jobs, on a workflow of a few scripts, with a small package in the place of `icha`."""

import json
import os
import signal
import subprocess
import sys

import pytest
from conftest import REPOSITORY, is_alive, wait_for

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="jobs are forked on Linux only")

SNAKEFILE = """
rule all:
    input: "one.txt", "two.txt", "alone.txt"

rule report:
    output: "{name}.txt"
    log: "{name}.log"
    benchmark: "{name}.jsonl"
    params: colour="red"
    script: "workflow/scripts/report.py"

use rule report as alone with:
    output: "alone.txt"
    log: "alone.log"
    benchmark: "alone.jsonl"
    threads: 2

ruleorder: alone > heavy > report

rule heavy:
    output: "heavy{megabytes}.txt"
    benchmark: "heavy{megabytes}.jsonl"
    script: "workflow/scripts/heavy.py"

rule wrong:
    output: "wrong{how}"
    script: "workflow/scripts/wrong.py"

rule long:
    output: "long.txt"
    script: "workflow/scripts/long.py"
"""
REPORT = """
import os, sys
from beside import WORD
imported = "icha.ballast" in sys.modules
facts = imported, WORD, len(sys.argv), os.environ["OMP_NUM_THREADS"], snakemake.params.colour, snakemake.rule
print(*facts, os.getcwd(), os.getppid(), snakemake.log[0], file=open(snakemake.output[0], "w"))
"""
WRONG = """
import os, signal, sys
if snakemake.wildcards.how == "3":
    sys.exit(3)
if snakemake.wildcards.how == "1":
    sys.exit("a message")
os.kill(os.getpid(), signal.SIGKILL)
"""
# Memory of the process that jobs are forked from, which does not count as memory of a job.
BALLAST = """
BALLAST = b"x" * (200 << 20)
"""
HEAVY = """
ballast = b"y" * (int(snakemake.wildcards.megabytes) << 20)
del ballast
open(snakemake.output[0], "w").close()
"""
# Only the first run of this job takes long.
LONG = """
import os, time
first = not os.path.exists("pids")
print(os.getpid(), os.getppid(), file=open("pids.part", "w"))
os.rename("pids.part", "pids")
time.sleep(600 * first)
open(snakemake.output[0], "w").close()
"""


@pytest.fixture(scope="module")
def workflow(tmp_path_factory):
    """Return a function that starts Snakemake on this workflow."""
    folder = tmp_path_factory.mktemp("executor")
    files = {
        "Snakefile": SNAKEFILE,
        "icha/__init__.py": "",
        "icha/ballast.py": BALLAST,
        "icha/broken.py": "raise OSError",
    }
    files["icha/support/program.py"] = (REPOSITORY / "icha/support/program.py").read_text()
    scripts = {"report": REPORT, "wrong": WRONG, "long": LONG, "heavy": HEAVY, "beside": "WORD = 'beside'"}
    for name, text in (files | {f"workflow/scripts/{name}.py": text for name, text in scripts.items()}).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    command = [sys.executable, "-m", "snakemake", "--executor", "icha", "--cores", "2", "--keep-going", "--nolock"]
    found = os.pathsep.join([str(folder), str(REPOSITORY / "workflow/plugins")])

    def start(*targets, **environment):
        return subprocess.Popen(
            [*command, *targets],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": found} | environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    start.folder = folder
    return start


@pytest.fixture(scope="module")
def call(workflow):
    """Return the output and the status of one call whose jobs succeed, need memory or fail."""
    process = workflow("all", "heavy0.txt", "heavy100.txt", "wrong3", "wrong1", "wrong9")
    return process.communicate(timeout=120)[0], process.returncode


def test_jobs_are_forks_with_the_settings_of_snakemake(workflow, call):
    output, _ = call
    assert (workflow.folder / "alone.txt").exists(), output
    one, two, alone = ((workflow.folder / f"{name}.txt").read_text().split() for name in ("one", "two", "alone"))
    assert one[:7] == ["True", "beside", "1", "1", "red", "report", str(workflow.folder)], output
    assert two[7] == one[7] and (one[8], two[8]) == ("one.log", "two.log")
    # A job of two threads is not a fork.
    assert alone[:1] == ["False"] and alone[3] == "2" and alone[7] != one[7]
    assert float((workflow.folder / "one.jsonl").read_text().split('"max_rss": ')[1].split(",")[0]) > 1


def test_the_peak_memory_of_a_job_excludes_shared_memory(workflow, call):
    took = {name: json.loads((workflow.folder / f"heavy{name}.jsonl").read_text()) for name in (0, 100)}
    assert took[0]["max_rss"] > 200, call
    assert took[0]["max_uss"] < 50
    assert 100 < took[100]["max_uss"] < 150


def test_failed_jobs_are_reported_with_their_exit_status(call):
    output, status = call
    assert status == 1
    assert "wrong.py ended with status 1." in output and "a message" in output
    assert "wrong.py ended with status 3." in output and "wrong.py was killed by signal 9." in output
    assert "Traceback" not in output


@pytest.fixture
def long(workflow):
    """Return Snakemake, a job that takes long, and the process from which the job was forked."""
    for name in ("pids", "long.txt"):
        (workflow.folder / name).unlink(missing_ok=True)
    process = workflow("long.txt")
    wait_for((workflow.folder / "pids").exists)
    job, server = map(int, (workflow.folder / "pids").read_text().split())
    yield process, job, server
    process.kill()
    process.communicate()


def test_all_processes_end_with_snakemake(long):
    process, job, server = long
    assert is_alive(job) and is_alive(server)
    process.kill()
    wait_for(lambda: not is_alive(job) and not is_alive(server))


def test_a_fork_server_whose_snakemake_was_killed_ends_before_it_imports_libraries(workflow):
    found = os.pathsep.join([str(workflow.folder), str(REPOSITORY / "workflow/plugins")])
    program = "import snakemake_executor_plugin_icha.preload"
    for executor, status in {os.getpid(): 0, os.getppid(): 1}.items():
        environment = os.environ | {"PYTHONPATH": found, "ICHA_EXECUTOR": str(executor)}
        assert subprocess.run([sys.executable, "-c", program], env=environment).returncode == status


@pytest.mark.slow
def test_the_next_call_repeats_a_job_whose_fork_server_was_killed(workflow, long):
    process, job, server = long
    os.kill(server, signal.SIGKILL)
    wait_for(lambda: not is_alive(job))
    output = process.communicate(timeout=120)[0]
    assert process.returncode == 1 and "long.py ended with status 255." in output and "Traceback" not in output
    assert workflow("long.txt").wait(timeout=120) == 0


@pytest.mark.slow
def test_an_interrupted_call_ends_its_jobs(workflow, long):
    process, job, _ = long
    os.kill(job, signal.SIGINT)  # as from a terminal, to all processes
    process.send_signal(signal.SIGINT)
    output = process.communicate(timeout=60)[0]
    assert process.returncode and not is_alive(job) and "Traceback" not in output, output
