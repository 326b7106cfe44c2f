"""The gaze's turn, added to the movement of the arm."""

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import Adder, ConstantVectorSource, MatrixGain


def add_gaze_turn(
    builder: DiagramBuilder,
    movement: OutputPort,
    yaw_command: OutputPort,
    yaw_index: int,
    start_yaw: float,
) -> OutputPort:
    """Adds the gaze's turn to a movement.

    The gaze turns the yaw away from the movement's yaw. It returns when it is
    done, so that only the movement is left.

    Args:
        builder: Builder that has both systems.
        movement: [q; q̇] (2n) of the movement, rad and rad/s.
        yaw_command: Where the gaze wants the yaw joint (1), rad.
        yaw_index: Which of the n joints that is.
        start_yaw: Its angle where the gaze is at rest, rad.

    Returns:
        [q; q̇] (2n) desired of both.
    """
    turn = np.zeros((movement.size(), 1))
    turn[yaw_index] = 1.0
    spread = builder.AddNamedSystem("gaze_turn", MatrixGain(D=turn))
    straight = builder.AddNamedSystem(
        "gaze_straight", ConstantVectorSource(-turn[:, 0] * start_yaw)
    )
    total = builder.AddNamedSystem("desired_state", Adder(3, movement.size()))
    builder.Connect(yaw_command, spread.get_input_port())
    builder.Connect(movement, total.get_input_port(0))
    builder.Connect(spread.get_output_port(), total.get_input_port(1))
    builder.Connect(straight.get_output_port(), total.get_input_port(2))
    return total.get_output_port()
