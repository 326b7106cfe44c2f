"""Each room's public names, and that asking for a face costs nothing."""

import importlib
import os
from pathlib import Path
import subprocess
import sys

import pytest

import drake_affetto

ROOT = Path(__file__).parents[1]
# These rooms are not imported from: they hold what others are made of, or
# commands.
WITHOUT = {"common", "cli", "report"}
ROOMS = sorted(
    path.parent.name
    for path in (ROOT / "drake_affetto").glob("*/__init__.py")
    if path.parent.name not in WITHOUT
)


@pytest.mark.parametrize("room", ROOMS)
def test_every_name_of_a_face_is_there(room):
    face = importlib.import_module(f"drake_affetto.{room}")
    assert face.__all__
    for name in face.__all__:
        value = getattr(face, name)
        home = getattr(value, "__module__", None)
        if home is not None and not home.startswith("pydrake"):
            assert home.startswith(f"drake_affetto.{room}"), name


@pytest.mark.parametrize("room", ROOMS)
def test_type_checkers_see_the_same_names(room):
    text = (ROOT / "drake_affetto" / room / "__init__.py").read_text()
    declared = text.split("if TYPE_CHECKING:")[1].split("__getattr__")[0]
    for name in importlib.import_module(f"drake_affetto.{room}").__all__:
        assert f" {name}" in declared, name


def test_the_package_itself_offers_station_and_scenario():
    scenario = drake_affetto.load_scenario("drumming")
    assert isinstance(scenario, drake_affetto.Scenario)
    assert drake_affetto.AffettoStation.__name__ == "AffettoStation"


def test_a_face_imports_nothing_heavy():
    # That of the environments registers them with gymnasium, which does.
    code = (
        "import importlib, sys\n"
        f"for room in {sorted(set(ROOMS) - {'envs'})!r}:\n"
        "    importlib.import_module(f'drake_affetto.{room}')\n"
        "heavy = {'numpy', 'scipy', 'sklearn', 'pydrake', 'numba', 'cv2'}\n"
        "print(sorted(heavy & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert (done.stdout, done.stderr) == ("[]\n", "")


def test_the_package_is_typed():
    assert (ROOT / "drake_affetto" / "py.typed").is_file()
