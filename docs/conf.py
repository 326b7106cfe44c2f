"""How Sphinx builds the site: `make docs`.

AFFETTO_DOCS_TUTORIALS  names of the tutorials that are run, by commas (all);
                        the others are shown without what they print
"""

import os
from pathlib import Path
import shutil
import sys

os.environ.setdefault("MPLBACKEND", "Agg")
HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "extensions"))

import api_pages
import gallery

from drake_affetto import __version__
from drake_affetto.cli.main import COMMANDS

project = "drake_affetto"
author = "The drake_affetto developers"
copyright = "The drake_affetto developers; BSD 3-Clause"
version = release = __version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "myst_parser",
    "api_pages",
    "command_help",
    "field_tables",
    "mathml",
    "parameter_tables",
    "pydrake_system",
]
exclude_patterns = ["extensions", "static", "templates", "rooms.dot"]
# A how-to of a command stays out where the package does not have it.
exclude_patterns += [
    f"howto/{name}.md" for name in ("faults",) if name not in COMMANDS
]
exclude_patterns += ["**/GALLERY_HEADER.rst", "sg_execution_times.rst"]
default_role = "py:obj"

# --- The pages' look ---------------------------------------------------------

html_theme = "furo"
html_title = f"drake_affetto {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
templates_path = ["templates"]
html_copy_source = False
html_show_sphinx = False
html_math_renderer = "mathml"
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"
html_theme_options = {
    "navigation_with_keys": True,
    "light_css_variables": {"color-brand-content": "#0b5ea8"},
}

# --- Texts -------------------------------------------------------------------

myst_enable_extensions = ["dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
math_number_all = False

# --- API ---------------------------------------------------------------------

api_pages.write_pages(HERE / "api/rooms")

napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
autoclass_content = "both"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
toc_object_entries_show_parents = "hide"

# --- Tutorials, which are run ------------------------------------------------

_out = HERE.parent / "out/docs-work"
_scripts = _out / "tutorials"
_only = os.environ.get("AFFETTO_DOCS_TUTORIALS")
gallery.prepare(_scripts)

# A tutorial is run again if it, or the package, has changed. The gallery keeps
# what has been run, so that a build that was interrupted goes on from there.
_stamp = _out / "content"
_content = gallery.content_of_package()
if not _stamp.is_file() or _stamp.read_text() != _content:
    shutil.rmtree(HERE / "tutorials", ignore_errors=True)
    _stamp.write_text(_content)

sphinx_gallery_conf = {
    "examples_dirs": str(_scripts),
    "gallery_dirs": "tutorials",
    "filename_pattern": gallery.pattern(_only),
    "ignore_pattern": r"__init__\.py",
    "abort_on_example_error": True,
    "reset_argv": "gallery.reset_argv",
    "default_thumb_file": str(HERE / "affetto.png"),
    "copyfile_regex": r".*\.yaml$",
    "image_scrapers": ("matplotlib", gallery.SavedFigures(_out / "tutorials")),
    "first_notebook_cell": gallery.FIRST_CELL.format(arguments="[]"),
    "capture_repr": (),
    "remove_config_comments": True,
    "download_all_examples": False,
    "show_signature": False,
    "write_computation_times": False,
    "show_memory": False,
    "min_reported_time": 1,
    "nested_sections": True,
}
suppress_warnings = ["config.cache"]
