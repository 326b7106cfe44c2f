"""Formulas as MathML, which browsers draw and readers read by themselves.

Sphinx's own ways need a script from the network or a LaTeX installation.
"""

from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

logger = logging.getLogger(__name__)


def _mathml(node: nodes.Element, block: bool) -> str:
    try:
        return tex2mathml(node.astext(), as_block=block)
    except MathError as error:
        logger.warning("formula: %s", error, location=node)
        return ""


def visit_math(translator: HTML5Translator, node: nodes.math) -> None:
    """A formula in a line."""
    translator.body.append(_mathml(node, False))
    raise nodes.SkipNode


def visit_displaymath(
    translator: HTML5Translator, node: nodes.math_block
) -> None:
    """A formula by itself, with its number if it has one."""
    # What is wide scrolls, also by the keyboard.
    translator.body.append(
        '<div class="formula" tabindex="0" role="group" aria-label="formula">'
    )
    translator.body.append(_mathml(node, True))
    if node["number"]:
        identity = node["ids"][0] if node["ids"] else ""
        translator.body.append(
            f'<span class="eqno" id="{identity}">({node["number"]})</span>'
        )
    translator.body.append("</div>")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Registers the way formulas are written."""
    app.add_html_math_renderer(
        "mathml", (visit_math, None), (visit_displaymath, None)
    )
    return {"parallel_read_safe": True}
