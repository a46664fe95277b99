"""Check the locked packages for known vulnerabilities: `uv audit`, which queries the database OSV.

    python tests/packaging/audit.py [OPTION...]

Options are those of `uv audit`, such as `--ignore ID` or `--service-url URL` for a copy of the database. The status is
0 without known vulnerabilities, else 1. If the database cannot be reached, for instance without a network, the audit
is skipped with a message and status 0, or 2 with `ICHA_REQUIRE_AUDIT=1`.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
UV = REPOSITORY / ".venv-tools/bin/uv"
# The status of uv if vulnerabilities are known.
_VULNERABLE = 1


def audit(*options: str) -> int:
    """Run the audit, print its output, and return the status."""
    command = [UV, "audit", "--locked", "--preview-features", "audit", *options]
    done = subprocess.run(command, cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    unreachable = re.search("Request failed|error sending request|requires network access", done.stdout)
    if done.returncode in (0, _VULNERABLE) or not unreachable:
        print(done.stdout, end="")
        return done.returncode
    reasons = [line.strip() for line in done.stdout.splitlines() if line.strip().startswith(("error:", "cause:"))]
    print(f"audit: skipped, because the database could not be reached: {'; '.join(reasons)}")
    return 2 if os.environ.get("ICHA_REQUIRE_AUDIT") == "1" else 0


if __name__ == "__main__":
    sys.exit(audit(*sys.argv[1:]))
