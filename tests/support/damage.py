"""Files as a fault of the disk, or another program, may leave them."""

import random


def damaged(data: bytes, rng: random.Random) -> bytes:
    """A copy with flipped bits, a hole, foreign bytes, or cut off."""
    found = bytearray(data)
    place = rng.randrange(len(found))
    kind = rng.randrange(6)
    if kind == 0:
        found[place] ^= 1 << rng.randrange(8)
    elif kind == 1:
        found = found[:place]
    elif kind == 2:
        size = rng.randrange(1, 200)
        found[place : place + size] = rng.randbytes(rng.randrange(1, 200))
    elif kind == 3:
        found[place : place + 512] = bytes(len(found[place : place + 512]))
    elif kind == 4:
        size = rng.randrange(1, 100)
        other = rng.randrange(len(found))
        found[place : place + size] = found[other : other + size]
    else:
        for _ in range(20):
            found[rng.randrange(len(found))] ^= 1 << rng.randrange(8)
    return bytes(found)
