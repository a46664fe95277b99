"""The command `icha`, also as `python -m icha`; where only the library is installed, it says what else it needs."""

import sys


def main() -> None:
    """Entry point."""
    try:
        from icha.cli import main as commands

        commands()
    except ModuleNotFoundError as missing:
        if not missing.name or missing.name.partition(".")[0] == __package__:
            raise
        sys.exit(
            f"Error: {missing.name} is not installed: commands need more than the library does; needed: "
            "pip install 'icha[workflow]'"
        )


if __name__ == "__main__":
    main()
