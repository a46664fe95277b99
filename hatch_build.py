"""What the build of a wheel adds to the package: the workflow, as `pyproject.toml` lists it."""

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Workflow(BuildHookInterface):
    """Puts the files of the workflow into a folder of the wheel, beside the package."""

    def initialize(self, version, build_data):
        """Add them, unless it is an editable installation: that has the repository itself."""
        if version == "standard":
            folder = self.config["folder"]
            build_data["force_include"].update({file: f"{folder}/{file}" for file in self.config["files"]})
