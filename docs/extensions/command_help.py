"""The directive `command-help`: what `affetto COMMAND --help` says.

    .. command-help:: drum

The text is that of the command's own parser, when the site is built.
"""

import os
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from drake_affetto.cli.main import COMMANDS, make_parser


def help_of(command: str) -> str:
    """The help of a sub-command, 80 columns wide.

    Raises:
        ValueError: If there is no such command.
    """
    if command not in COMMANDS:
        raise ValueError(f"{command!r} is none of {', '.join(COMMANDS)}")
    before = {name: os.environ.get(name) for name in ("COLUMNS", "NO_COLOR")}
    os.environ.update(COLUMNS="80", NO_COLOR="1")
    try:
        (commands,) = make_parser(command)._subparsers._group_actions
        return str(commands.choices[command].format_help())
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


class CommandHelp(SphinxDirective):
    """Shows the help of one sub-command."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """The help as it is printed."""
        try:
            text = help_of(self.arguments[0])
        except ValueError as error:
            raise self.error(str(error)) from error
        return [nodes.literal_block(text=text, language="text")]


def setup(app: Sphinx) -> dict[str, Any]:
    """Registers the directive."""
    app.add_directive("command-help", CommandHelp)
    return {"parallel_read_safe": True}
