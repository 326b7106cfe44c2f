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


def test_every_room_has_a_page():
    pages = {path.stem for path in (ROOT / "docs/api").glob("*.rst")}
    assert set(api_pages.rooms()) == pages - {"index", "common", "report"}
    listed = (ROOT / "docs/api/index.rst").read_text().split()
    assert pages - {"index"} <= set(listed)
    for room in api_pages.rooms():
        text = (ROOT / f"docs/api/{room}.rst").read_text()
        assert f".. face:: drake_affetto.{room}\n" in text


@pytest.mark.parametrize("room", api_pages.rooms())
def test_every_public_name_has_an_entry_with_all_texts(room):
    face = importlib.import_module(f"drake_affetto.{room}")
    for name in face.__all__:
        value = getattr(face, name)
        assert next(api_pages.entry(face.__name__, name, value))
        if isinstance(value, TemplateSystem):
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
