"""Configurations that are refused."""

import re

import pytest

from icha.configuration.errors import ConfigurationError


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
