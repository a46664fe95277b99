"""Entry point of the command `icha`, also as `python -m icha`."""

import sys


def main() -> None:
    """Run the command; if only the library is installed, exit with a message that names what to install."""
    try:
        from icha.cli import main as commands

        commands()
    except ModuleNotFoundError as missing:
        if not missing.name or missing.name.partition(".")[0] == __package__:
            raise
        sys.exit(
            f"Error: {missing.name} is not installed. The command `icha` needs this package; the library does not. "
            "Install all packages of the command with pip install 'icha[workflow]'"
        )


if __name__ == "__main__":
    main()
