"""What can be wrong with valves and chambers, and what is told them all."""

import enum


class Condition(enum.IntEnum):
    """The rows of what is wrong, one column for each of 2n valves or chambers.

    `FORCED`: 1: the spool stands at `SPOOL`, in [-1, 1]; 2: the valve is shut
    on both sides. `LAG`: factor of the lag. `LEAK`: further leak, m³/(s Pa).
    """

    FORCED = 0
    SPOOL = 1
    LAG = 2
    LEAK = 3


CONDITION_ROWS = len(Condition)

NO_ACTION = 0
VENT = 1
"""All valves are told to empty their chambers, whatever the command."""
REST = 2
"""All valves are told to rest in their middle."""
