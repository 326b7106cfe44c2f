"""What the site is made with: blocks, tables, checks of docstrings."""

import dataclasses
import re
import subprocess
import sys
import textwrap

import command_help
import docstring_check
import field_tables
import gallery
import parameter_tables
import pydrake_system
import pytest

from drake_affetto.cli.main import COMMANDS
from support import site

# --- Blocks of systems -------------------------------------------------------

SYSTEM = """Adds.

.. pydrake_system::

    name: Adder
    input_ports:
    - u
    - bias (optional)
    output_ports:
    - y

- `u` (n): first summand.
- bias, y (n): the other
  and the sum.
"""


def test_a_block_has_inputs_left_and_outputs_right():
    block = pydrake_system.read_block(
        "name: Adder\ninput_ports:\n- u\n- bias (optional)\noutput_ports: [y]"
    )
    drawn = pydrake_system.to_html(block)
    assert drawn.index("bias") < drawn.index("Adder</p>") < drawn.index(">y<")
    assert "<small>(optional)</small>" in drawn
    assert "no output ports" in pydrake_system.to_html(
        pydrake_system.Block("Sink", ("u",))
    )


@pytest.mark.parametrize(
    "text", ["name: [", "input_ports: [u]", "name: A\nports: [u]", "- a"]
)
def test_a_block_that_is_none_is_refused(text):
    with pytest.raises(ValueError, match=r"YAML|expected|unknown"):
        pydrake_system.read_block(text)


def test_every_port_has_to_be_told():
    assert pydrake_system.untold_ports(SYSTEM) == []
    shorter = SYSTEM.replace("- bias, y (n)", "- y (n)")
    assert pydrake_system.untold_ports(shorter) == ["bias"]
    # Prose that mentions it is not enough.
    assert pydrake_system.untold_ports(shorter + "\nbias is fine.") == ["bias"]


def test_ports_may_be_told_by_another_system():
    other = SYSTEM.partition("\n- `u`")[0] + (
        "\n\nPorts and units are those of `Adder`."
    )
    assert pydrake_system.untold_ports(other) == ["u", "bias", "y"]
    known = {"Adder": SYSTEM}
    assert pydrake_system.untold_ports(other, known.get) == []


# --- Docstrings --------------------------------------------------------------


def told(a, b, *, rng, context):
    """Takes `a`.

    Args:
        b: The other,
            in two lines.
    """


def untold(a, where, _private=0):
    """Takes a."""


@dataclasses.dataclass
class Fields:
    """Has fields.

    Attributes:
        x: First.
    """

    x: int
    y: int
    z: int
    """Third."""

    def undocumented(self):
        return self.x


def test_parameters_without_a_text_are_found():
    assert list(docstring_check.check("told", told)) == []
    assert list(docstring_check.check("untold", untold)) == [
        "untold: parameter 'a' has no text"
    ]
    assert list(docstring_check.check("Fields", Fields)) == [
        "Fields: parameter 'y' has no text",
        "Fields.undocumented has no docstring",
    ]


def test_entries_are_read_by_their_depth():
    entries = docstring_check.entries(
        "A.\n\nArgs:\n    a, b: Both.\n        more: of it\n    c:\n"
        "        Below.\n\nReturns:\n    d: None.\n"
    )
    assert entries == {"a": "Both.", "b": "Both.", "c": "Below."}


FACE = '''
"""A room."""

__all__ = ["System", "act"]


class System:
    """Acts.

    .. pydrake_system::

        name: System
        input_ports:
        - u
        output_ports:
        - y

    - `u` (1): what it takes.
    """


def act(force):
    """Acts."""
'''


def test_a_build_fails_for_what_has_no_text(tmp_path):
    (tmp_path / "room.py").write_text(FACE)
    (tmp_path / "index.rst").write_text("A\n=\n\n.. face:: room\n")
    (tmp_path / "conf.py").write_text(
        "import sys\n"
        f"sys.path[:0] = [{str(site.EXTENSIONS)!r}, {str(tmp_path)!r}]\n"
        "extensions = ['sphinx.ext.autodoc', 'sphinx.ext.napoleon',\n"
        "    'api_pages', 'pydrake_system']\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q"]
        + [str(tmp_path), str(tmp_path / "out")],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert "room.System: port 'y' has no text" in done.stderr
    assert "room.act: parameter 'force' has no text" in done.stderr
    page = (tmp_path / "out/index.html").read_text()
    assert '<div class="system-block"' in page


# --- Tables ------------------------------------------------------------------

YAML = """\
# About it. lag [step] 11 ms, gain [fit]; slack [est] by eye.
# Without a mark: [choice].

supply: 6.5e5  # [step] the highest
# Of a room.
temperature: 293.15
classes:
  a: {lag: 1, gain: 2}
  b: {lag: 3, gain: 4}
  c: {lag: 5, gain: 6}
corners:
- [0, 1]
- [2, 3]
"""


def test_values_come_with_comments_and_evidence():
    found = parameter_tables.values(YAML)
    rows = parameter_tables.as_list(
        [value for value in found if value.path[0] != "classes"]
    )
    assert rows == [
        ["parameter", "value", "evidence", "remark"],
        ["supply", "6.5e5", "measured", "the highest"],
        ["temperature", "293.15", "chosen", "Of a room."],
        ["corners", "- [0, 1] - [2, 3]", "chosen", ""],
    ]
    grid = parameter_tables.as_grid(parameter_tables.select(found, "classes"))
    assert grid == [
        ["", "a", "b", "c"],
        ["lag", "1 [step]", "3 [step]", "5 [step]"],
        ["gain", "2 [fit]", "4 [fit]", "6 [fit]"],
    ]
    with pytest.raises(ValueError, match="no section 'class'"):
        parameter_tables.select(found, "class")


def test_tables_hold_what_the_models_hold():
    models = parameter_tables.MODELS
    rows = parameter_tables.joints(models / "sdf/affetto.sdf")
    assert len(rows) == 1 + 22
    for path in models.rglob("*.yaml"):
        assert parameter_tables.values(path.read_text())


def test_fields_of_results_all_have_a_text():
    from drake_affetto.experiments import results

    for name in ("DrumResults", "MirrorResults", "ToyResults", "DemoResults"):
        cls = getattr(results, name)
        for each in (cls, *field_tables.inner(cls, {cls})):
            for row in field_tables.rows_of(each)[1:]:
                assert row[-1], f"{each.__name__}.{row[0]}"
                assert "drake_affetto" not in row[1]


def test_help_is_that_of_the_command():
    assert command_help.help_of("toy").startswith("usage: affetto toy")
    with pytest.raises(ValueError, match="none of demo"):
        command_help.help_of("dance")


# --- Tutorials ---------------------------------------------------------------

SCRIPT = '''"""Tutorial: turn left.

    python turn.py

Then right.
"""

# %% What is needed
import math

# %% 1. Turn
# It turns.
print(__file__[:-2] + "yaml", math.pi)
'''


def test_a_script_is_staged_with_headings():
    staged = gallery.stage("turn", SCRIPT)
    assert staged == textwrap.dedent(
        '''\
        """
        Turn left
        =========

        ::

            python turn.py

        Then right.
        """

        # %%
        # What is needed
        # --------------
        #
        import math

        # %%
        # 1. Turn
        # -------
        #
        # It turns.
        print("turn.yaml", math.pi)
        '''
    )


def test_what_is_made_small_is_told():
    assert set(gallery.ARGUMENTS) <= set(gallery.REMARKS)
    for name, remark in gallery.REMARKS.items():
        (path,) = gallery.TUTORIALS.rglob(name)
        assert remark in gallery.stage(path.stem, path.read_text())


@pytest.mark.parametrize(
    ("only", "path", "found"),
    [
        (None, "/a/b.py", True),
        ("b.py,parts/c.py", "/a/b.py", True),
        ("b.py,parts/c.py", "/a/parts/c.py", True),
        ("b.py", "/a/bb.py", False),
        ("", "/a/b.py", False),
    ],
)
def test_tutorials_are_run_by_their_names(only, path, found):
    assert bool(re.search(gallery.pattern(only), path)) == found


# --- What the pages cover ----------------------------------------------------


def test_every_command_has_a_how_to():
    told = set()
    for path in (site.ROOT / "docs/howto").glob("*.md"):
        for line in path.read_text().splitlines():
            if line.startswith("```{command-help}"):
                told.add(line.split()[-1])
    assert set(COMMANDS) <= told
