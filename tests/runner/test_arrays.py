"""Arrays come back as they were, or it is said what is wrong."""

import io
import zipfile

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.runner.arrays import pack_arrays, unpack_arrays


def test_arrays_come_back_as_they_were():
    arrays = {
        "a": np.linspace(0.0, 1.0, 7),
        "none": np.zeros((0, 3)),
        "small": np.ones((2, 3), np.float32),
        # What packs best of all.
        "zeros": np.zeros(2_000_000),
    }
    back = unpack_arrays(pack_arrays(arrays))
    assert set(back) == set(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(back[name], array)
        assert back[name].dtype == array.dtype


def archive(header: str, data: bytes = b"") -> bytes:
    """An archive of one array with such a header."""
    text = header.encode().ljust(117) + b"\n"
    npy = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + data
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("x.npy", npy)
    return buffer.getvalue()


SHAPED = "{{'descr': '<f8', 'fortran_order': False, 'shape': ({},), }}"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "not a zip file"),
        (pack_arrays({"a": np.ones(5)})[:-30], "not a zip file"),
        (archive(SHAPED.format(10**12)), "an array of 8000000000000 bytes"),
        (archive(SHAPED.format(10**30)), "an array of 8"),
        (archive(SHAPED.format(-3)), "negative"),
        (archive(SHAPED.format(4), b"\0" * 16), "(?i)expected 32|reshape"),
        (
            archive("{'descr': '|O', 'shape': (2,), 'fortran_order': False}"),
            "Object arrays",
        ),
        (
            archive("{'descr': 'no', 'shape': (2,), 'fortran_order': 3}"),
            "fortran_order",
        ),
        (archive("nonsense"), "malformed"),
    ],
)
def test_damage_is_told_before_memory_is_asked_for(data, message):
    with pytest.raises(InputError, match=message):
        unpack_arrays(data)


def test_one_wrong_bit_is_told():
    data = bytearray(pack_arrays({"a": np.arange(50.0)}))
    data[60] ^= 4
    with pytest.raises(InputError):
        unpack_arrays(bytes(data))
