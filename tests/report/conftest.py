"""Pages that several tests look at."""

import pytest

from drake_affetto import report
from support import report_data


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    return report_data.write_all(tmp_path_factory.mktemp("studies"))


@pytest.fixture(scope="module")
def whole(folders, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    return report.write_report(folders, path)


@pytest.fixture(scope="module")
def demo(folders, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "demo.html"
    return report.write_report(folders[:1], path)
