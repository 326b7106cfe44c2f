"""Four lessons, taught once for all tests of this folder."""

import os

import pytest


@pytest.fixture(scope="session", autouse=True)
def cache(tmp_path_factory):
    """A cache of lessons that is empty when the tests begin."""
    before = os.environ.get("AFFETTO_CACHE")
    folder = tmp_path_factory.mktemp("cache")
    os.environ["AFFETTO_CACHE"] = str(folder)
    yield folder
    if before is None:
        del os.environ["AFFETTO_CACHE"]
    else:
        os.environ["AFFETTO_CACHE"] = before
