"""Ask whether vulnerabilities of the locked packages are known: `uv audit`, which asks the database OSV.

    python tests/packaging/audit.py [OPTION...]

Options are those of `uv audit`, such as `--ignore ID` or `--service-url URL` for a copy of the database. The status is
0 if none is known, 1 if some are. Where the database cannot be asked, for want of a network for one, that is said, and
the status is 0; it is 2 with `ICHA_REQUIRE_AUDIT=1`.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
UV = REPOSITORY / ".venv-tools/bin/uv"
# The status of uv where it has asked, and vulnerabilities are known; what it says of them may be any text.
_VULNERABLE = 1


def audit(*options: str) -> int:
    """Ask, print what is said, and return the status."""
    asked = [UV, "audit", "--locked", "--preview-features", "audit", *options]
    done = subprocess.run(asked, cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    asked_in_vain = re.search("Request failed|error sending request|requires network access", done.stdout)
    if done.returncode in (0, _VULNERABLE) or not asked_in_vain:
        print(done.stdout, end="")
        return done.returncode
    reasons = [line.strip() for line in done.stdout.splitlines() if line.strip().startswith(("error:", "cause:"))]
    print(f"audit: skipped, the database could not be asked: {'; '.join(reasons)}")
    return 2 if os.environ.get("ICHA_REQUIRE_AUDIT") == "1" else 0


if __name__ == "__main__":
    sys.exit(audit(*sys.argv[1:]))
