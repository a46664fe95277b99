"""Which configuration a call of Snakemake means, and how it is told what is wrong with it."""

from pathlib import Path

from snakemake.logging import logger

from icha.configuration.errors import ConfigurationError
from icha.configuration.load import Configuration, load_configuration
from icha.support.formatting import printable, printable_lines

DEFAULT = "config/config.yaml"


def campaign_configuration(workflow, root: str) -> Configuration:
    """Read the file of `--configfile`, or else the default one below `root`, with the values of `--config` in place.

    Snakemake's own `config` is not used: it would mix the campaigns of two files, and lets keys be given twice.
    A wrong configuration ends the program with its message alone.
    """
    settings = workflow.config_settings
    files = [_as_given(path) for path in settings.configfiles]
    try:
        if len(files) > 1:
            names = ", ".join(map(str, files))
            raise ConfigurationError(f"--configfile: {names}; allowed: one file, for one campaign is one file")
        configuration = load_configuration(files[0] if files else _as_given(Path(root, DEFAULT)), dict(settings.config))
    except ConfigurationError as error:
        raise SystemExit(f"The configuration cannot be run:\n{printable_lines(error)}") from None
    for warning in configuration.warnings:
        logger.warning(f"Warning: {printable(warning)}")
    return configuration


def _as_given(path) -> Path:
    """The path relative to the working directory, where it lies in it: short in messages, and true for copies."""
    path = Path(path)
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
