"""Configurations to load, right ones and wrong ones."""

import re

import pytest
import yaml
from demo_configuration import GOOD

from icha.configuration.errors import ConfigurationError
from icha.configuration.load import load_configuration


@pytest.fixture
def load(tmp_path):
    """Load GOOD with values changed at dotted keys (`None` as a value deletes the key)."""

    def loaded(changes=None, overrides=None, text=GOOD):
        content = yaml.safe_load(text)
        for key, value in (changes or {}).items():
            *path, last = key.split(".")
            inside = content
            for part in path:
                inside = inside[int(part) if isinstance(inside, list) else part]
            if value is None:
                del inside[last]
            else:
                inside[int(last) if isinstance(inside, list) else last] = value
        file = tmp_path / "campaign.yaml"
        file.write_text(yaml.safe_dump(content, sort_keys=False))
        return load_configuration(file, overrides)

    return loaded


@pytest.fixture
def refused(load, tmp_path):
    """Load GOOD with a value changed (or several), and check the message."""

    def refuse(key, value, message):
        with pytest.raises(ConfigurationError) as error:
            load({key: value} if key else value)
        lines = str(error.value).splitlines()
        assert all(re.match(rf"{tmp_path}/campaign\.yaml(, line \d+)?: ", line) for line in lines), lines
        assert any(message in line for line in lines), lines
        assert all(re.search("expected|allowed|Remove|Use|Correct", line) for line in lines), lines

    return refuse
