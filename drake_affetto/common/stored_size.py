"""How large an array can be whose packed size is known.

A file that declares more is damaged: reading it would fill the memory.
"""

# By how much zlib can shrink what it packs, and a little for small arrays.
_GREATEST_RATIO = 1100
_SMALL = 4096


def greatest_size(stored: int) -> int:
    """The most bytes that an array of so many packed bytes can have."""
    return _GREATEST_RATIO * stored + _SMALL
