"""Parameter files over defaults, with overlays; what does not fit is named."""

import dataclasses

import pytest

from drake_affetto.common.errors import InputError, require_range
from drake_affetto.common.yaml_config import load_config


@dataclasses.dataclass
class Inner:
    gain: float = 1.0
    names: list[str] = dataclasses.field(default_factory=lambda: ["a"])


@dataclasses.dataclass
class Outer:
    rate: float = 100.0
    inner: Inner = dataclasses.field(default_factory=Inner)
    by_name: dict[str, Inner] = dataclasses.field(default_factory=dict)

    def check(self, where: str) -> None:
        require_range(f"{where}.rate", self.rate, 1.0, 1000.0)


def write(path, text):
    path.write_text(text)
    return path


def test_a_file_changes_only_what_it_holds(tmp_path):
    base = write(
        tmp_path / "base.yaml",
        "inner: {gain: 2}\nby_name: {x: {gain: 3}, y: {}}\n",
    )
    config = load_config(Outer, base)
    assert config == Outer(
        inner=Inner(gain=2.0), by_name={"x": Inner(3.0), "y": Inner()}
    )
    over = write(
        tmp_path / "over.yaml", "rate: 50\nby_name: {x: {names: [b]}}\n"
    )
    changed = load_config(Outer, base, [over])
    assert changed.rate == 50.0
    assert changed.inner == Inner(gain=2.0)
    assert changed.by_name == {"x": Inner(3.0, ["b"]), "y": Inner()}
    # Nothing is shared with what was read before.
    assert load_config(Outer, base) == config


def test_the_whole_is_checked_overlays_included(tmp_path):
    base = write(tmp_path / "base.yaml", "rate: 2000\n")
    with pytest.raises(InputError, match=r"base\.yaml\.rate is 2000"):
        load_config(Outer, base)
    over = write(tmp_path / "over.yaml", "rate: 20\n")
    assert load_config(Outer, base, (over,)).rate == 20.0
    wrong = write(tmp_path / "wrong.yaml", "inner: {gian: 2}\n")
    with pytest.raises(InputError, match=r"wrong\.yaml.*did you mean 'gain'"):
        load_config(Outer, base, (over, wrong))
    with pytest.raises(InputError, match="no such file"):
        load_config(Outer, tmp_path / "none.yaml")


def test_values_may_take_the_place_of_the_file(tmp_path):
    over = write(tmp_path / "over.yaml", "rate: 20.0")
    given = Outer(rate=50.0, inner=Inner(gain=3.0))
    assert load_config(Outer, given) == given
    changed = load_config(Outer, given, [over])
    assert (changed.rate, changed.inner.gain) == (20.0, 3.0)
    assert given.rate == 50.0
    with pytest.raises(InputError, match=r"Outer\.rate is 0\.0"):
        load_config(Outer, Outer(rate=0.0))
