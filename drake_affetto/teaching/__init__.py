"""The teacher's hand, and demonstrations in a file."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.teaching.demonstrations import (
        Demonstration,
        append_demonstration,
        read_demonstrations,
        write_demonstrations,
    )
    from drake_affetto.teaching.kinesthetic_teacher import KinestheticTeacher
    from drake_affetto.teaching.mouse_teacher import MouseTeacher
    from drake_affetto.teaching.stroke import Stroke, TeacherConfig, draw_stroke

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "Demonstration": "demonstrations",
        "KinestheticTeacher": "kinesthetic_teacher",
        "MouseTeacher": "mouse_teacher",
        "Stroke": "stroke",
        "TeacherConfig": "stroke",
        "append_demonstration": "demonstrations",
        "draw_stroke": "stroke",
        "read_demonstrations": "demonstrations",
        "write_demonstrations": "demonstrations",
    },
)
