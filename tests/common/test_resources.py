from pathlib import Path

import pytest

from drake_affetto.common import resources
from drake_affetto.common.errors import InputError

ROOT = Path(__file__).parents[2]


def test_models_stand_beside_the_package_in_a_checkout():
    assert resources.models_dir() == ROOT / "models"


def test_models_in_the_package_come_first(tmp_path, monkeypatch):
    package = tmp_path / "drake_affetto"
    for folder in (package / "models", tmp_path / "models"):
        folder.mkdir(parents=True)
        (folder / "package.xml").touch()
    monkeypatch.setattr(
        resources, "__file__", str(package / "common/resources.py")
    )
    assert resources.models_dir() == package / "models"
    (package / "models/package.xml").unlink()
    assert resources.models_dir() == tmp_path / "models"


def test_missing_models_are_told_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr(
        resources, "__file__", str(tmp_path / "p/common/resources.py")
    )
    with pytest.raises(InputError, match=r"package\.xml") as caught:
        resources.models_dir()
    assert "\n" not in str(caught.value)


def test_resolve_takes_packages_and_paths(tmp_path):
    uri = "package://drake_affetto/package.xml"
    assert resources.resolve(uri) == ROOT / "models/package.xml"
    file = tmp_path / "x.sdf"
    file.touch()
    assert resources.resolve(file) == file
    assert resources.resolve(str(file)) == file


@pytest.mark.parametrize(
    "uri", ["package://drake_affetto/sdf/none.sdf", "none.sdf", "", "models"]
)
def test_resolve_names_the_file_that_is_missing(uri):
    with pytest.raises(InputError, match="no such file") as caught:
        resources.resolve(uri)
    assert uri in str(caught.value)


def test_parser_then_knows_the_package():
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    parser = Parser(MultibodyPlant(0.001))
    assert not parser.package_map().Contains("drake_affetto")
    resources.configure_parser(parser)
    path = Path(parser.package_map().GetPath("drake_affetto"))
    assert path.resolve() == ROOT / "models"
