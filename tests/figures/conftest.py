import pytest
import small_campaign as small

from icha.datasets.files import read_dataset
from icha.datasets.surface_file import write_surface


@pytest.fixture(scope="session")
def surface(tmp_path_factory):
    """Return the dataset of the topography of the small campaign."""
    path = tmp_path_factory.mktemp("surface") / "s.nc"
    write_surface(path, small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
    return read_dataset(path)
