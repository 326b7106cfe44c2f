"""The sources of the site: what they name is there."""

import ast
import importlib
import re

import api_pages
import docstring_check
from pydrake.systems.scalar_conversion import TemplateSystem
import pydrake_system
import pytest

from support import site

ROOT = site.ROOT
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def test_every_room_has_a_page(tmp_path):
    gone = tmp_path / "gone.rst"
    gone.write_text("A room that was.")
    api_pages.write_pages(tmp_path)
    written = {path.stem: path.read_text() for path in tmp_path.iterdir()}
    assert set(written) == set(api_pages.rooms()) >= {"skill", "station"}
    for room, text in written.items():
        assert text.endswith(f".. face:: drake_affetto.{room}\n")


@pytest.mark.parametrize("room", api_pages.rooms())
def test_every_public_name_has_an_entry_with_all_texts(room):
    face = importlib.import_module(f"drake_affetto.{room}")
    for name in face.__all__:
        value = getattr(face, name)
        assert next(api_pages.entry(face.__name__, name, value))
        if isinstance(value, TemplateSystem):
            continue
        if api_pages.is_constant(value):
            assert api_pages.constant_text(face.__name__, name), name
            continue
        assert list(docstring_check.check(name, value)) == []
        if isinstance(value, type):
            home = importlib.import_module(value.__module__)
            untold = pydrake_system.untold_ports(
                value.__doc__ or "",
                lambda other, home=home: api_pages.docstring_of(other, home),
            )
            assert untold == [], name


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_python_on_a_page_imports_what_there_is(path):
    for block in re.findall(r"```python\n(.*?)```", path.read_text(), re.S):
        for node in ast.walk(ast.parse(block)):
            if not isinstance(node, ast.ImportFrom):
                continue
            module = importlib.import_module(str(node.module))
            for alias in node.names:
                assert hasattr(module, alias.name), alias.name


def test_pages_of_equations_say_where_they_come_from():
    for path in (ROOT / "docs/physics").glob("*.md"):
        text = path.read_text()
        if "$$" in text and path.stem not in ("variation", "body", "teacher"):
            assert "Source:" in text, path.stem
