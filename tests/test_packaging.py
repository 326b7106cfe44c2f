"""The wheel carries its models, and serves where there is no checkout."""

import os
from pathlib import Path
import re
import subprocess
import sys
import tomllib
import zipfile

import pytest

ROOT = Path(__file__).parents[1]

# The editable install puts the checkout on the path; who has but the wheel
# does not have it there.
PREAMBLE = """
import pathlib, sys
root, site = (pathlib.Path(path).resolve() for path in sys.argv[1:3])
sys.path[:] = [str(site)] + [
    path for path in sys.path if pathlib.Path(path).resolve() != root
]
assert not pathlib.Path.cwd().is_relative_to(root)
"""

LOAD_MODELS = """
from drake_affetto.common import resources
import drake_affetto
assert pathlib.Path(drake_affetto.__file__).is_relative_to(site)
models = resources.models_dir()
assert models == site / "drake_affetto/models", models
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
for path in sorted(models.rglob("*.sdf")) + sorted(models.rglob("*.dmd.yaml")):
    plant = MultibodyPlant(0.001)
    parser = Parser(plant)
    parser.SetStrictParsing()
    resources.configure_parser(parser)
    assert parser.AddModels(
        url=f"package://drake_affetto/{path.relative_to(models)}"
    )
    plant.Finalize()
    print(path.name)
"""


def run(*command, cwd: Path) -> str:
    environment = {
        key: value
        for key, value in os.environ.items()
        if key not in ("PYTHONPATH", "PYTHONHOME")
    }
    done = subprocess.run(
        [sys.executable, *map(str, command)],
        cwd=cwd,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Built from the source archive, which thus is complete too."""
    folder = tmp_path_factory.mktemp("dist")
    run("-m", "build", "--no-isolation", "--outdir", folder, ROOT, cwd=folder)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def site(wheel, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    pip = ("-m", "pip", "install", "--quiet", "--no-deps", "--no-index")
    run(*pip, "--target", folder, wheel, cwd=folder)
    return folder


@pytest.mark.slow
def test_wheel_holds_the_package_and_every_model(wheel):
    with zipfile.ZipFile(wheel) as archive:
        held = set(archive.namelist())
    assert {name.split("/")[0].split("-")[0] for name in held} == {
        "drake_affetto"
    }
    assert not [name for name in held if "__pycache__" in name]
    expected = {
        path.relative_to(ROOT).as_posix()
        for kind in ("py", "j2", "css", "js", "jpg")
        for path in (ROOT / "drake_affetto").rglob(f"*.{kind}")
    } | {
        f"drake_affetto/{path.relative_to(ROOT).as_posix()}"
        for path in (ROOT / "models").rglob("*")
        if path.is_file() and path.suffix != ".tmp"
    }
    assert expected - held == set()
    assert "drake_affetto/models/package.xml" in held
    assert "drake_affetto/py.typed" in held
    assert "drake_affetto/report/templates/page.html.j2" in held


@pytest.mark.slow
def test_models_load_outside_the_checkout(site, tmp_path):
    code = PREAMBLE + LOAD_MODELS
    loaded = run("-c", code, ROOT, site, cwd=tmp_path).split()
    for path in (ROOT / "models").rglob("*.sdf"):
        assert path.name in loaded


@pytest.mark.slow
def test_command_starts_outside_the_checkout(site, tmp_path):
    code = PREAMBLE + (
        "from drake_affetto.cli.main import main;raise SystemExit(main(['-h']))"
    )
    assert "usage: affetto" in run("-c", code, ROOT, site, cwd=tmp_path)
    assert (site / "bin/affetto").is_file()


def test_pins_hold_everything_that_the_project_asks_for():
    from packaging.requirements import Requirement
    from packaging.utils import canonicalize_name

    pins: dict[str, list[Requirement]] = {}
    for line in (ROOT / "constraints.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            pin = Requirement(line)
            (specifier,) = pin.specifier
            assert specifier.operator == "==", line
            pins.setdefault(canonicalize_name(pin.name), []).append(pin)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    asked = [*project["dependencies"]]
    for extra in project["optional-dependencies"].values():
        asked += extra
    for text in asked:
        wanted = Requirement(text)
        for version in ("3.11", "3.12", "3.13"):
            fit = [
                pin
                for pin in pins.get(canonicalize_name(wanted.name), [])
                if pin.marker is None
                or pin.marker.evaluate({"python_version": version})
            ]
            assert len(fit) == 1, f"{text} on Python {version}: {fit}"
            (specifier,) = fit[0].specifier
            assert wanted.specifier.contains(specifier.version), text


def test_version_is_the_same_everywhere():
    import drake_affetto

    version = drake_affetto.__version__
    citation = (ROOT / "CITATION.cff").read_text()
    assert f"\nversion: {version}\n" in citation
    changes = re.findall(
        r"^## \[([^]]+)\] - (\S+)$", (ROOT / "CHANGELOG.md").read_text(), re.M
    )
    released = dict(changes)
    assert changes[0][0] == version
    assert f"\ndate-released: {released[version]}\n" in citation


def test_development_has_what_the_extras_have():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    for name in ("dask", "data", "docs", "gym"):
        assert set(extras[name]) <= set(extras["dev"]), name
