"""Faults that keep people from reading a page, found by axe-core.

It comes with a package of the development extra, or from a `node_modules` in
the checkout; it is no part of the project.
"""

import functools
import importlib.util
import json
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]


@functools.cache
def _axe() -> str | None:
    places = [ROOT / "node_modules/axe-core/axe.min.js"]
    package = importlib.util.find_spec("axe_core_python")
    if package is not None and package.origin is not None:
        places.append(Path(package.origin).parent / "axe.min.js")
    found = [path for path in places if path.is_file()]
    return found[0].read_text(encoding="utf-8") if found else None


def serious_faults(browser: Any) -> list[str]:
    """What axe finds on the open page that is serious or critical.

    The test is skipped where axe is not installed.

    Args:
        browser: A `headless_browser.Browser`.
    """
    axe = _axe()
    if axe is None:
        pytest.skip("axe-core is not installed")
    browser.evaluate(axe + "; 0")
    said = browser.evaluate(
        "axe.run(document, {resultTypes: ['violations']})"
        ".then(found => JSON.stringify(found.violations.map(each =>"
        " [each.impact, each.id, each.nodes.map(n => n.html.slice(0, 120))])))"
    )
    return [
        f"{impact}: {rule}: {places[:3]}"
        for impact, rule, places in json.loads(said)
        if impact in ("serious", "critical")
    ]
