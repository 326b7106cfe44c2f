"""Public names of a package that are imported when they are first used.

So `import drake_affetto.perception` needs no Drake, and the command's help no
scikit-learn.
"""

from collections.abc import Callable, Mapping
import importlib
import sys
from typing import Any


def attach(
    package: str, exports: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Makes names of modules available as names of their package (PEP 562).

    In a package's `__init__`:

        __getattr__, __dir__, __all__ = attach(__name__, {"Dmp": "dmp"})

    Args:
        package: `__name__` of the package.
        exports: Module inside the package, by public name.

    Returns:
        `__getattr__`, `__dir__` and `__all__` of the package.
    """

    def load(name: str) -> Any:
        if name not in exports:
            raise AttributeError(
                f"module {package!r} has no attribute {name!r}"
            )
        module = importlib.import_module(f"{package}.{exports[name]}")
        value = getattr(module, name)
        # The next use finds it at once.
        setattr(sys.modules[package], name, value)
        return value

    return load, lambda: sorted(exports), sorted(exports)
