"""Fields that carry their range and help."""

import dataclasses

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.fields import check_ranges, number, option


@dataclasses.dataclass
class Plan:
    count: int = number(3, 1, 10, "how many")
    share: float = number(0.5, 0.0, 1.0)
    after: tuple[int, ...] = number((), 1, 5, "after which")
    name: str = option("x", "a name")
    weight: float | None = number(None, 0.0, 2.0)


def test_what_is_in_range_passes():
    check_ranges(Plan())
    check_ranges(Plan(10, 1.0, (1, 5), weight=2.0))


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        (Plan(count=0), "--count is 0, expected a number from 1 to 10"),
        (Plan(share=1.5), "share is 1.5, expected a number from 0 to 1"),
        (Plan(after=(2, 6)), "--after is 6, expected a number from 1 to 5"),
        (Plan(count="3"), "--count is '3'"),
        (Plan(count=None), "--count is None"),
        (Plan(share=[0.5]), r"share is \[0.5\]"),
    ],
)
def test_errors_name_the_option_or_the_field(plan, message):
    with pytest.raises(InputError, match=message):
        check_ranges(plan)
