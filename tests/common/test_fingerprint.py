"""Digests: what counts, and that stored ones keep their value."""

import dataclasses

from pydrake.systems.sensors import CameraConfig

from drake_affetto.common.fingerprint import (
    config_values,
    files_digest,
    text_digest,
)


@dataclasses.dataclass
class Inner:
    x: tuple[float, ...] = (1.0, 2.0)


@dataclasses.dataclass
class Outer:
    name: str = "outer"
    inner: dict[str, Inner] = dataclasses.field(
        default_factory=lambda: {"i": Inner()}
    )


def test_digests_keep_their_value():
    assert text_digest("affetto") == "57dec1248f89e66c"
    assert len(text_digest("affetto", length=None)) == 64


def test_names_contents_and_order_of_files_count(tmp_path):
    def write(folder, name, text):
        (tmp_path / folder).mkdir(exist_ok=True)
        path = tmp_path / folder / name
        path.write_text(text)
        return path

    a, b = write("one", "a.yaml", "x: 1"), write("one", "b.yaml", "y: 2")
    found = files_digest([a, b])
    assert found == "dd1fd9e4e56f29c0"
    # The folder does not count.
    assert files_digest([write("two", "a.yaml", "x: 1"), b]) == found
    others = [
        files_digest([b, a]),
        files_digest([a]),
        files_digest([write("two", "a.yaml", "x: 2"), b]),
        files_digest([write("two", "c.yaml", "x: 1"), b]),
        files_digest([a, b], text="before"),
    ]
    assert len({found, *others}) == 6


def test_values_of_dataclasses_and_of_drakes_structs():
    assert config_values(Outer()) == {
        "name": "outer",
        "inner": {"i": {"x": [1.0, 2.0]}},
    }
    values = config_values({"camera": CameraConfig(width=320)})
    assert values["camera"]["width"] == 320
    assert values["camera"]["focal"]["y"] == CameraConfig().focal.y
