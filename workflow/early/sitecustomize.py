"""What Python does first in a job: hand its script over, if there is a warm process (workflow/warm.py).

Python imports a module of this name before it runs anything. Here it comes before the preamble that Snakemake puts
into every script, whose imports alone take a tenth of a second.
"""

import os
import sys

if os.environ.get("ICHA_WARM_JOBS") and len(sys.orig_argv) == 2 and "/.snakemake/scripts/" in sys.orig_argv[1]:
    from hand_over import hand_over

    hand_over(sys.orig_argv[1])

# The environment's own module of this name, if it has one.
sys.path.remove(os.path.dirname(__file__))
_this = sys.modules.pop("sitecustomize")
try:
    import sitecustomize  # noqa: F401
except ImportError:
    sys.modules["sitecustomize"] = _this
