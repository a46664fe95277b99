"""One thread for linear algebra, as in a run: with more they are slower on arrays this small."""

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(autouse=True, scope="session")
def one_thread():
    with threadpool_limits(1):
        yield
