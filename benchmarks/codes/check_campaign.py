"""Check the campaign dataset that write_campaign.py wrote.

python check_campaign.py FOLDER COUNT
"""

import sys
from pathlib import Path

from make_runs import labels

from icha.analysis.checks import check_campaign
from icha.datasets.files import read_campaign

folder, count = Path(sys.argv[1]), int(sys.argv[2])
check_campaign(read_campaign(folder / f"{count}.nc"), labels(count))
