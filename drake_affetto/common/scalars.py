"""Choices that any of Drake's scalar types can make.

With a float or an AutoDiffXd a comparison is true or false. With a symbolic
Expression it is a formula, and the choice becomes a part of the expression.
"""

from collections.abc import Callable
from typing import Any

from pydrake.symbolic import Expression, Formula, if_then_else


def select(
    condition: Any, yes: Callable[[], Any], no: Callable[[], Any]
) -> Any:
    """`yes()` where `condition` holds, else `no()`."""
    if isinstance(condition, Formula):
        zero = Expression(0.0)  # makes floats expressions
        return if_then_else(condition, zero + yes(), zero + no())
    return yes() if condition else no()


def clip(x: Any, low: Any, high: Any) -> Any:
    """`x`, but at least `low` and at most `high`."""
    # 0 x keeps the type of x, and its derivatives as zeros.
    return select(
        x < low,
        lambda: 0.0 * x + low,
        lambda: select(x > high, lambda: 0.0 * x + high, lambda: x),
    )
