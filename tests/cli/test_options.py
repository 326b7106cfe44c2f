"""Options that come from a plan, and those that studies share."""

import argparse
import dataclasses
import re

import pytest

from drake_affetto.cli import options
from drake_affetto.cli.main import COMMANDS, main, make_parser
from drake_affetto.common.errors import InputError
from drake_affetto.common.fields import number, option
from drake_affetto.experiments.plans import DrumPlan, TeachPlan


@dataclasses.dataclass(frozen=True)
class Plan:
    repeats: int = number(2, 1, 10, "how often")
    after: tuple[int, ...] = number((), 1, 9, "after which")
    active: bool = option(False, "whether")
    hidden: int = number(5, 1, 9)


def parse(*words):
    parser = argparse.ArgumentParser()
    options.add_plan_arguments(parser, Plan)
    return options.make_plan(Plan, parser.parse_args(words), hidden=7)


def test_options_make_the_plan():
    assert parse() == Plan(2, (), False, 7)
    assert parse("--repeats", "3", "--after", "1", "4", "--active") == Plan(
        3, (1, 4), True, 7
    )


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("teach", ["--out", "x", "--positions", "7"]),
        ("teach", ["--out", "x", "--by-hand"]),
        ("mirror", ["--no-exhibits"]),
    ],
)
def test_options_of_version_0_1_0_are_gone(command, words, capsys):
    assert main([command, *words]) == 2
    assert "unrecognized arguments" in capsys.readouterr().err


def test_the_plans_defaults_are_the_commands():
    args = make_parser("drum").parse_args(["drum"])
    assert options.make_plan(DrumPlan, args) == DrumPlan()
    args = make_parser("teach").parse_args(["teach", "--out", "x"])
    assert options.make_plan(TeachPlan, args) == TeachPlan()


def test_worker_count_has_limits():
    assert options.worker_count(argparse.Namespace(workers=None)) == 2
    with pytest.raises(InputError, match="--workers is 257"):
        options.worker_count(argparse.Namespace(workers=257))


@pytest.mark.parametrize("text", ["1_0", "٣", "many", "1.5.2", "0x10"])
def test_numbers_are_decimal_digits(text):
    for read in (options.whole_number, options.real_number):
        with pytest.raises(argparse.ArgumentTypeError, match=re.escape(text)):
            read(text)
    assert options.whole_number("-10") == -10
    assert options.real_number("-9e-2") == -0.09


def test_every_number_of_a_command_is_read_so():
    """Whatever option of whatever command takes a number."""
    found = 0
    for command in COMMANDS:
        parser = make_parser(command)
        (commands,) = (
            a for a in parser._actions if isinstance(a.choices, dict)
        )
        for action in commands.choices[command]._actions:
            assert action.type not in (int, float), (command, action.dest)
            found += action.type in (
                options.whole_number,
                options.real_number,
            )
    assert found > 20
