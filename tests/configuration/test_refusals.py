"""Wrong configurations (`refusals.yaml`): each is refused with file, key, value and what is expected."""

from pathlib import Path

import pytest
import yaml
from demo_configuration import REPOSITORY

_TEXT = (Path(__file__).parent / "refusals.yaml").read_text(encoding="utf-8")
CASES = yaml.safe_load(_TEXT.replace("SCAN", str(REPOSITORY / "config/topographies/synthetic_scan.txt")))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["message"].replace(" ", "_")[:70])
def test_wrong_configurations_are_refused(case, refused):
    refused("", case["changes"], case["message"])
