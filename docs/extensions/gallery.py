"""Stages the tutorials for the gallery, which runs them.

The scripts in analysis/tutorials stay as a reader of the repository finds them:
a docstring and cells that begin with `# %% Heading`. Here copies get the
headings that the gallery asks for. Figures that a script saves are shown too.
"""

import ast
import hashlib
from pathlib import Path
import re
import shutil
from typing import Any

ROOT = Path(__file__).parents[2]
TUTORIALS = ROOT / "analysis/tutorials"

# Words for a script's command line. What takes minutes is made small here, and
# REMARKS says so on its page.
ARGUMENTS = {
    "learn_by_reward.py": ["--episodes", "30", "--tests", "6"],
}
REMARKS = {
    "pneumatic_gripper.py": (
        "It reads its scenario from :download:`pneumatic_gripper.yaml`; a "
        "notebook finds that file beside itself."
    ),
    "learn_by_reward.py": (
        "For this page it ran in a small setting, 30 episodes and tests at 6 "
        "places, which is too few to learn much: its own default is 200 "
        "episodes and 30 places and takes about three minutes. With it the "
        "learner comes from 50 % (any action) to 97 % after 100 episodes."
    ),
}

_HEADINGS = {
    "": "Tutorials",
    "parts": "Parts by themselves",
}
_TEXTS = {
    "": (
        "Each of these scripts was run when this site was built; what it "
        "printed and drew stands below its code. They are in "
        "``analysis/tutorials``, and each can be loaded as a notebook that "
        "runs in a plain Jupyter where the package is installed."
    ),
    "parts": "One system each, outside the station.",
}

# A notebook has no command line, and no file of its own.
FIRST_CELL = """\
# The settings of a script's command line.
import sys

sys.argv[1:] = {arguments}
%matplotlib inline"""


def title_of(docstring: str) -> str:
    """The heading of a tutorial: its first line without "Tutorial:"."""
    line = docstring.strip().splitlines()[0].rstrip(".")
    line = line.removeprefix("Tutorial: ")
    return line[0].upper() + line[1:]


def to_rst(text: str) -> str:
    """A docstring's paragraphs, with indented ones as they stand."""
    return re.sub(r"(^|\n\n)(?=    \S)", r"\1::\n\n", text)


def stage(name: str, text: str) -> str:
    """A script as the gallery takes it.

    Args:
        name: Name of the script, without its suffix.
        text: The script.
    """
    remark = REMARKS.get(f"{name}.py", "")
    tree = ast.parse(text)
    docstring = ast.get_docstring(tree, clean=True)
    first = tree.body[0]
    assert docstring is not None
    assert first.end_lineno is not None
    title = title_of(docstring)
    rest = docstring.partition("\n")[2].strip("\n")
    about = [title, "=" * len(title), "", to_rst(rest)]
    if remark:
        about += ["", ".. note::", "", f"   {remark}"]
    lines = text.splitlines()[first.end_lineno :]
    body: list[str] = []
    for line in lines:
        heading = re.match(r"# %% (.+)", line)
        if heading:
            words = heading[1]
            body += ["# %%", f"# {words}", "# " + "-" * len(words), "#"]
        else:
            body.append(line)
    # Where there is no file of a script there is a folder to work in.
    script = "\n".join(body).replace('__file__[:-2] + "yaml"', f'"{name}.yaml"')
    docs = "\n".join(about).rstrip().replace("\\", "\\\\")
    return f'"""\n{docs}\n"""\n' + script + "\n"


def prepare(folder: Path) -> None:
    """Writes the scripts that the gallery runs into a folder.

    Args:
        folder: Where to; what was there goes.
    """
    shutil.rmtree(folder, ignore_errors=True)
    wanted = sorted(TUTORIALS.rglob("*.py"))
    for path in wanted:
        place = folder / path.relative_to(TUTORIALS)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(stage(path.stem, path.read_text()))
        beside = path.with_suffix(".yaml")
        if beside.is_file():
            shutil.copy(beside, place.with_suffix(".yaml"))
    for name in {path.parent.name for path in wanted} | {"tutorials"}:
        key = "" if name == "tutorials" else name
        head = _HEADINGS[key]
        (folder / key / "GALLERY_HEADER.rst").write_text(
            f"{head}\n{'=' * len(head)}\n\n{_TEXTS[key]}\n"
        )


def pattern(only: str | None) -> str:
    """What the paths of the scripts that are run match.

    Args:
        only: Their names, joined by commas; None: all.
    """
    if only is None:
        return r"\.py$"
    names = "|".join(re.escape(name) for name in only.split(",") if name)
    return rf"/({names})$" if names else "(?!)"


def reset_argv(_: dict[str, Any], script: dict[str, Any]) -> list[str]:
    """The words of a script's command line."""
    return ARGUMENTS.get(Path(script["src_file"]).name, [])


class SavedFigures:
    """Shows the pictures that a script has written into the folder `out`."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._shown: set[tuple[str, int]] = set()

    def __repr__(self) -> str:
        """The same in each build: the gallery compares its settings."""
        return "SavedFigures()"

    def __call__(
        self, block: Any, variables: dict[str, Any], settings: dict[str, Any]
    ) -> str:
        """Copies what is new; returns the text that shows it."""
        from sphinx_gallery.scrapers import figure_rst

        found = []
        for path in sorted(self._folder.rglob("*.png")):
            mark = (str(path), path.stat().st_mtime_ns)
            if mark not in self._shown:
                self._shown.add(mark)
                place = next(variables["image_path_iterator"])
                shutil.copy(path, place)
                found.append(place)
        return figure_rst(found, settings["src_dir"])


def content_of_package() -> str:
    """A digest of all that the tutorials run on."""
    digest = hashlib.sha256()
    for folder, kinds in (
        ("drake_affetto", ("py",)),
        ("models", ("yaml", "sdf")),
    ):
        for kind in kinds:
            for path in sorted((ROOT / folder).rglob(f"*.{kind}")):
                digest.update(path.relative_to(ROOT).as_posix().encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()
