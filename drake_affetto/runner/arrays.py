"""Arrays as bytes, and back without trust in what the bytes say."""

from collections.abc import Mapping
import io
import math
from typing import Any
import zipfile
import zlib

import numpy as np

from drake_affetto.common.errors import InputError, one_line, require
from drake_affetto.common.stored_size import greatest_size

# What reading an archive of arrays may raise where it is damaged.
_DAMAGE = (
    ValueError,
    KeyError,
    TypeError,
    OSError,
    EOFError,
    MemoryError,
    OverflowError,
    NotImplementedError,
    SyntaxError,
    zipfile.BadZipFile,
    zlib.error,
)


def pack_arrays(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Arrays as the bytes of an npz archive."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def unpack_arrays(data: bytes) -> dict[str, np.ndarray]:
    """The inverse of `pack_arrays`.

    Raises:
        InputError: If the archive is damaged, or declares more numbers than
            it can hold.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for member in archive.infolist():
                room = greatest_size(member.compress_size)
                with archive.open(member) as file:
                    size = _declared_size(file)
                require(
                    max(size, member.file_size) <= room,
                    member.filename,
                    f"an array of {size} bytes",
                    f"at most {room}, by its packed size",
                )
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    except InputError:
        raise
    except _DAMAGE as error:
        message = one_line(error) or type(error).__name__
        raise InputError(message) from error


def _declared_size(file: Any) -> int:
    """The bytes of the array whose .npy header is read from `file`."""
    version = np.lib.format.read_magic(file)
    read = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }[version]
    shape, _, dtype = read(file)
    return math.prod(shape) * dtype.itemsize
