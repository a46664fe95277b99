"""Write the campaign dataset of the files that make_runs.py made.

python write_campaign.py FOLDER COUNT
"""

import sys
from pathlib import Path

from make_runs import labels

from icha.datasets.campaign_file import write_campaign

folder, count = Path(sys.argv[1]), int(sys.argv[2])
runs = labels(count)
write_campaign(((each, folder / f"{each}.nc") for each in runs), folder / f"{count}.nc", design=runs)
