"""Where the models stand: beside the package in a checkout, in it in a wheel.

Importing this module costs nothing; only `package_map` imports Drake.
"""

import os
from pathlib import Path
from typing import Any

from drake_affetto.common.errors import InputError

_PACKAGE = "package://drake_affetto/"


def models_dir() -> Path:
    """The folder that holds `package.xml` and all models.

    Raises:
        InputError: where neither an installed nor a checked-out copy is found.
    """
    here = Path(__file__).resolve().parents[1]
    for candidate in (here / "models", here.parent / "models"):
        if (candidate / "package.xml").is_file():
            return candidate
    raise InputError(
        f"the models of drake_affetto are missing: no package.xml in "
        f"{here / 'models'} or {here.parent / 'models'}"
    )


def resolve(uri: str | Path) -> Path:
    """The file that `uri` names: `package://drake_affetto/...` or a path.

    Raises:
        InputError: if no such file exists.
    """
    text = str(uri)
    if text.startswith(_PACKAGE):
        path = models_dir() / text[len(_PACKAGE) :]
    else:
        path = Path(text)
    if not path.is_file():
        raise InputError(f"no such file: {text}")
    return path


def is_file_name(text: Any) -> bool:
    """Whether `text` is a package:// URI or an absolute path."""
    return isinstance(text, str) and (
        text.startswith(_PACKAGE) or os.path.isabs(text)
    )


def anchor(name: Any, folder: Path) -> Any:
    """The file `name` as seen from `folder`.

    Args:
        name: A path, which is relative to `folder` unless it is absolute.
            Whatever has a scheme (package://), is empty or is no text stays.
        folder: A folder.
    """
    if not isinstance(name, str) or not name or "://" in name:
        return name
    return str(Path(os.path.abspath(folder)) / name)


def configure_parser(parser) -> None:
    """Makes `package://drake_affetto/...` known to a Drake Parser."""
    parser.package_map().AddPackageXml(str(models_dir() / "package.xml"))
