"""Jobs that a process with everything imported runs in forks of itself."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

WORKFLOW = Path(__file__).parents[2] / "workflow"
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="jobs are forked on Linux only")

# As Snakemake starts it, with what the job is told at its top.
SCRIPT = "import sys\nsnakemake = 'what the job is told'\n"


@pytest.fixture
def starter(tmp_path):
    """Start a script under a warm process that has imported `fractions`; end that process as its starter does."""
    code = f"import sys, os, json; sys.path.insert(0, {str(WORKFLOW)!r}); import warm; warm.start(['fractions']); "
    code += "told = [os.environ['ICHA_WARM_JOBS'], os.environ['PYTHONPATH'], warm._started[0].pid]; "
    code += "print(json.dumps(told), flush=True); sys.stdin.read()"
    process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    address, path, server = json.loads(process.stdout.readline())
    jobs = []

    def start(body, threads="1", **environment):
        script = tmp_path / f".snakemake/scripts/job{len(jobs)}.py"
        script.parent.mkdir(parents=True, exist_ok=True)
        script.write_text(SCRIPT + body)
        environment |= {"ICHA_WARM_JOBS": address, "PYTHONPATH": path, "OMP_NUM_THREADS": threads}
        jobs.append(
            subprocess.Popen(
                [sys.executable, str(script)],
                cwd=tmp_path,
                env=os.environ | environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        return jobs[-1]

    start.server, start.process, start.folder = server, process, Path(address).parent
    yield start
    for job in jobs:
        job.kill()
        job.communicate()
    process.stdin.close()
    process.wait(30)
    process.stdout.close()


def alive(pid):
    """Whether a process runs: one that has ended and that nobody asked for its status does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def wait_until(condition):
    for _ in range(1000):
        if condition():
            return
        time.sleep(0.02)
    raise AssertionError("this never came")


TELL = """
import os
print("fractions" in sys.modules, len(sys.argv), os.getcwd(), os.environ.get("COLOUR"), snakemake)
print(os.getpid(), file=sys.stderr)
"""


def test_a_job_runs_in_a_fork_as_if_it_ran_by_itself(starter, tmp_path):
    job = starter(TELL, COLOUR="red")
    out, error = job.communicate(timeout=60)
    assert out.split("\n")[0] == f"True 1 {tmp_path} red what the job is told"
    assert int(error) != job.pid
    assert job.returncode == 0


def test_a_job_of_two_threads_runs_by_itself(starter):
    job = starter(TELL, threads="2")
    out, error = job.communicate(timeout=60)
    assert out.startswith("False") and int(error) == job.pid


def test_a_job_runs_by_itself_once_the_process_is_gone(starter):
    os.kill(starter.server, signal.SIGKILL)
    wait_until(lambda: not alive(starter.server))
    job = starter(TELL)
    out, error = job.communicate(timeout=60)
    assert out.startswith("False") and int(error) == job.pid and job.returncode == 0


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ("sys.exit(3)", 3),
        ("sys.exit('a message')", 1),
        ("raise ValueError('wrong')", 1),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", 256 - signal.SIGKILL),
    ],
)
def test_the_status_of_a_job_is_its_own(starter, body, status):
    job = starter(body)
    _, error = job.communicate(timeout=60)
    assert job.returncode == status
    assert "message" in error or "wrong" in error or status in (3, 256 - signal.SIGKILL)


def test_a_job_ends_when_the_call_that_wants_it_ends(starter):
    job = starter("import os, time; print(os.getpid(), flush=True); time.sleep(600)")
    worker = int(job.stdout.readline())
    assert alive(worker)
    job.kill()
    wait_until(lambda: not alive(worker))


def test_the_process_ends_with_the_one_that_started_it_and_leaves_nothing(starter):
    assert starter.folder.is_dir()
    starter.process.kill()
    wait_until(lambda: not alive(starter.server))
    wait_until(lambda: not starter.folder.exists())


def test_the_process_ends_while_it_is_still_importing(tmp_path):
    (tmp_path / "slow.py").write_text(
        "import time\nprint('here', flush=True)\nfor _ in range(6000):\n    time.sleep(0.1)\n"
    )
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    listener = socket.socket(socket.AF_UNIX)
    folder = tmp_path / "folder"
    folder.mkdir()
    listener.bind(str(folder / "jobs"))
    command = [sys.executable, str(WORKFLOW / "warm.py"), str(listener.fileno()), str(folder), "slow"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    server = subprocess.Popen(command, env=environment, pass_fds=[listener.fileno()], text=True, **pipes)
    assert server.stdout.readline() == "here\n"
    server.stdin.close()
    server.wait(30)
    assert not folder.exists()
    server.stdout.close()
    listener.close()


def test_an_environments_own_sitecustomize_is_still_imported(tmp_path):
    (tmp_path / "own").mkdir()
    (tmp_path / "own/sitecustomize.py").write_text("import sys; sys.own = True\n")
    early = str(WORKFLOW / "early")
    code = "import sys; print(sys.own, 'early' in ''.join(sys.path))"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([early, str(tmp_path / "own")])}
    found = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert (found.stdout, found.stderr) == ("True False\n", "")
