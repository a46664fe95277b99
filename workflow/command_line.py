"""Read the configuration that is selected by the options of Snakemake."""

from pathlib import Path

from snakemake.logging import logger

from icha.configuration.errors import ConfigurationError
from icha.configuration.load import Configuration, load_configuration
from icha.support.formatting import printable, printable_lines

DEFAULT = "config/config.yaml"


def campaign_configuration(workflow, root: str) -> Configuration:
    """Read the file of `--configfile`, or the default file in `root`, and replace values by those of `--config`.

    Snakemake's own `config` is not used, because Snakemake would merge two files and accept duplicate keys.

    Raises
    ------
    SystemExit
        If the configuration has errors; the message lists the errors.
    """
    settings = workflow.config_settings
    files = [_shortened(path) for path in settings.configfiles]
    try:
        if len(files) > 1:
            names = ", ".join(map(str, files))
            raise ConfigurationError(f"--configfile: {names}; expected one file, because one file describes a campaign")
        file = files[0] if files else _shortened(Path(root, DEFAULT))
        configuration = load_configuration(file, dict(settings.config), results="results")
    except ConfigurationError as error:
        raise SystemExit(f"The configuration cannot be run:\n{printable_lines(error)}") from None
    for warning in configuration.warnings:
        logger.warning(f"Warning: {printable(warning)}")
    return configuration


def _shortened(path: str | Path) -> Path:
    """Return a path in the working directory as a relative path, which remains valid in a copy of the directory."""
    path = Path(path)
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
