"""Public names that are imported when they are first used."""

import sys
import textwrap

import pytest


@pytest.fixture
def package(tmp_path, monkeypatch):
    folder = tmp_path / "lazy_sample"
    folder.mkdir()
    (folder / "__init__.py").write_text(
        textwrap.dedent(
            """
            from drake_affetto.common.lazy import attach

            __getattr__, __dir__, __all__ = attach(
                __name__, {"LIGHT": "light", "half": "inner.maths"}
            )
            """
        )
    )
    (folder / "light.py").write_text("LIGHT = object()\n")
    (folder / "inner").mkdir()
    (folder / "inner" / "maths.py").write_text("def half(x): return x / 2\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield __import__("lazy_sample")
    for name in list(sys.modules):
        if name.split(".")[0] == "lazy_sample":
            del sys.modules[name]


def test_a_name_is_imported_when_it_is_used(package):
    assert "lazy_sample.light" not in sys.modules
    first = package.LIGHT
    assert "lazy_sample.light" in sys.modules
    assert package.LIGHT is first
    assert package.half(3) == 1.5


def test_the_names_are_listed(package):
    assert package.__all__ == ["LIGHT", "half"]
    assert dir(package) == ["LIGHT", "half"]


def test_other_names_are_refused(package):
    with pytest.raises(AttributeError, match="'DARK'"):
        package.DARK  # noqa: B018
