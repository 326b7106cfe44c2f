"""What a browser tells Meshcat of a mouse that drags something."""

import struct


def drag_message(path="", anchor=(), target=()):
    """The message, in MessagePack; without a path nothing is dragged.

    Args:
        path: of what is dragged, in Meshcat's tree.
        anchor: (3,) where it was taken hold of, in the world, m.
        target: (3,) where the mouse is, m.
    """
    return (
        b"\x84"
        + (_text("type") + _text("mouse_drag"))
        + (_text("name") + _text(path))
        + (_text("drag_anchor") + _numbers(anchor))
        + (_text("drag_target") + _numbers(target))
    )


def _text(value):
    data = value.encode()
    return bytes([0xD9, len(data)]) + data


def _numbers(values):
    packed = b"".join(b"\xcb" + struct.pack(">d", v) for v in values)
    return bytes([0x90 | len(values)]) + packed
