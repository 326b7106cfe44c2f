"""The file of demonstrations: what goes in comes out, or is refused."""

from concurrent.futures import ProcessPoolExecutor
import dataclasses
import multiprocessing
import os
from pathlib import Path
import random
import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest

import drake_affetto
from drake_affetto.common.errors import InputError
from drake_affetto.teaching.demonstrations import (
    ROBOT_LOG_JOINTS,
    Demonstration,
    append_demonstration,
    from_robot_csv,
    read_demonstrations,
    write_demonstrations,
)
from support import damage

ROOT = Path(__file__).parents[2]
LOG = ROOT.parent / "shared/data/affetto-logs/kinesthetic_000.csv"
JOINTS = ("waist_roll", "waist_pitch", "right_elbow_flexion")
ARRAYS = ("t", "q", "drum_xy", "theta", "task_parameter", "prototype")
PLAIN = [
    field.name
    for field in dataclasses.fields(Demonstration)
    if field.name not in ARRAYS
]


def make(seed=0, **changes) -> Demonstration:
    rng = np.random.default_rng(abs(seed))
    values = {
        "t": np.arange(301) / 100.0,
        "q": rng.normal(size=(301, 3)),
        "joint_names": JOINTS,
        "drum_xy": [0.2, -0.1],
        "seed": seed,
        "attempt": 1,
        "theta": rng.normal(size=45),
        "task_parameter": [0.3, -0.2],
        "reward": 0.1 + rng.uniform(),
        "prototype": rng.uniform(size=(20, 25)),
        "max_pull": 18.5,
        "teacher": "simulated",
        "scenario": "drumming",
    }
    return Demonstration(**{**values, **changes})


def assert_same(a: Demonstration, b: Demonstration):
    for name in PLAIN:
        assert getattr(a, name) == getattr(b, name), name
    for name in ARRAYS:
        left, right = getattr(a, name), getattr(b, name)
        assert (left is None) == (right is None), name
        if left is not None:
            np.testing.assert_array_equal(left, right)


def test_what_goes_in_comes_out(tmp_path):
    path = tmp_path / "taught.h5"
    bare = make(
        drum_xy=None,
        theta=None,
        task_parameter=None,
        reward=None,
        prototype=None,
        max_pull=None,
        scenario="größer als früher",
    )
    bare.seed = None
    given = [make(0), bare, make(2**62)]
    for i, demonstration in enumerate(given):
        assert append_demonstration(path, demonstration) == i + 1
    found = read_demonstrations(path)
    assert len(found) == 3
    for a, b in zip(given, found, strict=True):
        assert_same(a, b)
    assert found[0].version == drake_affetto.__version__
    # Nothing but the file is left.
    assert os.listdir(tmp_path) == ["taught.h5"]
    other = tmp_path / "again.h5"
    write_demonstrations(other, found)
    for a, b in zip(given, read_demonstrations(other), strict=True):
        assert_same(a, b)


def test_more_than_ten_keep_their_order(tmp_path):
    path = tmp_path / "taught.h5"
    write_demonstrations(path, [make(i) for i in range(11)])
    append_demonstration(path, make(11))
    assert [d.seed for d in read_demonstrations(path)] == list(range(12))


def test_a_file_from_before_teachers_were_told_of_can_be_read(tmp_path):
    path = tmp_path / "taught.h5"
    append_demonstration(path, make())
    with h5py.File(path, "r+") as file:
        group = file["demonstrations/000000"]
        del group.attrs["teacher"], group.attrs["max_pull"]
    (found,) = read_demonstrations(path)
    assert (found.teacher, found.max_pull) == ("", None)
    assert append_demonstration(path, make(1)) == 2


def test_the_file_tells_what_it_holds(tmp_path):
    path = tmp_path / "taught.h5"
    append_demonstration(path, make())
    with h5py.File(path) as file:
        assert file.attrs["format"] == b"drake_affetto demonstrations"
        assert file.attrs["format_version"] == 2
        assert b"Movements" in file.attrs["about"]
        group = file["demonstrations/000000"]
        units = {name: group[name].attrs["unit"].decode() for name in group}
        assert units == {
            "t": "s",
            "q": "rad",
            "drum_xy": "m",
            "theta": "1",
            "task_parameter": "1",
            "prototype": "1",
        }
        assert all(group[name].attrs["about"] for name in group)
        assert group.attrs["joint_names"].astype("U").tolist() == list(JOINTS)
        assert group.attrs["seed"] == 0
        assert group.attrs["scenario"] == b"drumming"


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"t": [0.0]}, "t"),
        ({"t": np.zeros(301)}, "t"),
        ({"t": np.full(301, np.nan)}, "t"),
        ({"q": np.zeros((300, 3))}, "q"),
        ({"q": np.zeros((301, 4))}, "q"),
        ({"q": np.full((301, 3), np.inf)}, "q"),
        ({"q": "no numbers"}, "q"),
        ({"joint_names": ("a", "b")}, "q"),
        ({"drum_xy": [0.1, 0.2, 0.3]}, "drum_xy"),
        ({"theta": np.full(45, np.nan)}, "theta"),
        ({"prototype": np.zeros(5)}, "prototype"),
        ({"reward": float("nan")}, "reward"),
        ({"seed": -1}, "seed"),
        ({"seed": 2**63}, "seed"),
        ({"attempt": -1}, "attempt"),
    ],
)
def test_demonstrations_that_make_no_sense(changes, field):
    with pytest.raises(InputError, match=rf"^{field}(\[[0-9, ]+\])? "):
        make(**changes)


def test_a_demonstration_keeps_its_own_copy():
    q = np.zeros((301, 3))
    demonstration = make(q=q)
    q[:] = 1.0
    assert not demonstration.q.any()


def test_files_of_others_are_refused_and_left_alone(tmp_path):
    text = tmp_path / "text.h5"
    text.write_text("no HDF5")
    empty = tmp_path / "empty.h5"
    empty.touch()
    foreign = tmp_path / "foreign.h5"
    with h5py.File(foreign, "w") as file:
        file["demonstrations/000000/t"] = [0.0, 1.0]
    newer = tmp_path / "newer.h5"
    append_demonstration(newer, make())
    with h5py.File(newer, "r+") as file:
        file.attrs["format_version"] = 3
    hollow = tmp_path / "hollow.h5"
    append_demonstration(hollow, make())
    with h5py.File(hollow, "r+") as file:
        del file["demonstrations/000000/q"]
    for path, message in (
        (text, "no HDF5 file"),
        (empty, "empty.h5"),
        (foreign, "not a file of demonstrations"),
        (newer, "format version 3"),
        (hollow, "demonstration 000000"),
        (tmp_path / "none.h5", "existing file"),
        (tmp_path, "existing file"),
    ):
        with pytest.raises(InputError, match=message) as caught:
            read_demonstrations(path)
        assert "\n" not in str(caught.value)
        assert path.name in str(caught.value)
    for path in (text, empty, foreign, newer):
        before = path.read_bytes()
        with pytest.raises(InputError, match=path.name):
            append_demonstration(path, make())
        assert path.read_bytes() == before
    with pytest.raises(InputError, match="nowhere"):
        append_demonstration(tmp_path / "nowhere" / "a.h5", make())
    assert not [name for name in os.listdir(tmp_path) if name[0] == "."]


def test_a_truncated_file_is_refused(tmp_path):
    path = tmp_path / "taught.h5"
    write_demonstrations(path, [make(i) for i in range(3)])
    whole = path.read_bytes()
    for share in (0.01, 0.3, 0.7, 0.999):
        path.write_bytes(whole[: int(share * len(whole))])
        for function in (
            read_demonstrations,
            lambda p: append_demonstration(p, make()),
        ):
            with pytest.raises(InputError, match=r"taught\.h5"):
                function(path)
        assert path.stat().st_size == int(share * len(whole))


def test_a_flipped_bit_is_never_read_as_a_number(tmp_path):
    path = tmp_path / "taught.h5"
    given = [make(i) for i in range(3)]
    write_demonstrations(path, given)
    whole = path.read_bytes()
    dice = random.Random(0)
    refused = 0
    for _ in range(60):
        data = bytearray(whole)
        data[dice.randrange(len(data))] ^= 1 << dice.randrange(8)
        path.write_bytes(data)
        try:
            found = read_demonstrations(path)
        except InputError:
            refused += 1
        else:
            # The bit was in unused space.
            assert len(found) == 3
            for a, b in zip(given, found, strict=True):
                assert_same(a, b)
    assert refused > 30


WRITER = """
import sys
from pathlib import Path
sys.path.insert(0, {tests!r})
from test_demonstrations import make
from drake_affetto.teaching.demonstrations import append_demonstration
path = Path(sys.argv[1])
for i in range(1000):
    n = append_demonstration(path, make(int(sys.argv[2]) + i))
    print(n, flush=True)
"""


def test_a_kill_loses_at_most_the_one_in_progress(tmp_path):
    path = tmp_path / "taught.h5"
    script = WRITER.format(tests=str(Path(__file__).parent))
    places = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
    environment = {**os.environ, "PYTHONPATH": places}
    dice = random.Random(1)
    written = 0
    for start in (0, 1000, 2000):
        with subprocess.Popen(
            [sys.executable, "-c", script, str(path), str(start)],
            stdout=subprocess.PIPE,
            env=environment,
            text=True,
        ) as writer:
            assert writer.stdout is not None
            for _ in range(3):
                line = writer.stdout.readline()
            time.sleep(dice.uniform(0.0, 0.03))
            writer.send_signal(signal.SIGKILL)
            told = int((line + writer.stdout.read()).split()[-1])
        found = read_demonstrations(path)
        assert told <= len(found) <= told + 1
        assert len(found) >= written + 3
        mine = [d.seed for d in found if d.seed >= start]
        assert mine == list(range(start, start + len(mine)))
        for demonstration in found:
            assert_same(demonstration, make(demonstration.seed))
        written = len(found)
    append_demonstration(path, make())
    # What the killed ones left lying is gone.
    assert os.listdir(tmp_path) == ["taught.h5"]


def add_three(path, start):
    for i in range(3):
        append_demonstration(path, make(start + i))


def test_two_processes_may_add_to_one_file(tmp_path):
    path = tmp_path / "taught.h5"
    # Not a fork: this process may have threads.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=context) as pool:
        jobs = [pool.submit(add_three, path, start) for start in (0, 10)]
        for job in jobs:
            job.result()
    seeds = [d.seed for d in read_demonstrations(path)]
    assert sorted(seeds) == [0, 1, 2, 10, 11, 12]


def write_log(path, rows, header="t,q0,q1,q5,ca0"):
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_percent_of_range_become_angles(tmp_path):
    log = write_log(
        tmp_path / "log.csv",
        ["5.00,0,50,25,9", "5.05,100,50,75,9", "5.10,40,0,-1,9"],
    )
    limits = {"left_elbow_flexion": (0.0, 2.0), "waist_yaw": (-0.5, 0.5)}
    demonstration = from_robot_csv(log, limits, drum_xy=[0.2, -0.1])
    assert demonstration.joint_names == tuple(limits)
    np.testing.assert_allclose(demonstration.t, [0.0, 0.05, 0.1])
    np.testing.assert_allclose(
        demonstration.q, [[0.5, -0.5], [1.5, 0.5], [-0.02, -0.1]]
    )
    np.testing.assert_array_equal(demonstration.drum_xy, [0.2, -0.1])
    assert demonstration.theta is None
    assert demonstration.scenario == "log.csv"
    path = tmp_path / "taught.h5"
    append_demonstration(path, demonstration)
    assert_same(read_demonstrations(path)[0], demonstration)


@pytest.mark.parametrize(
    ("rows", "header", "message"),
    [
        (["0,1,1,1,1", "1,1,1,1,1"], "time,q0,q1,q5,ca0", "no column t;"),
        (["0,1,1,1,1", "1,1,1,1,1"], "t,q0,q1,q2,ca0", "no column q5;"),
        (["0,1,1,1,1", "1,1,1,x,1"], None, "line 3"),
        (["0,1,1,1,1", "1,1"], None, "line 3"),
        (["0,1,1,1,1", ".03,1,1,nan,1"], None, "column q5 is nan in row 2"),
        (["0,1,1,1,1", ".03,1,1,-32768,1"], None, "column q5 is -32768 in row"),
        (["0,1,1,1,1", "0,1,1,1,1"], None, "time does not increase from row 1"),
        (["0,1,1,1,1", "33,1,1,1,1"], None, "is the time in ms"),
        (["0,1,1,1,1"], None, "two"),
        ([], None, "two"),
    ],
)
def test_logs_that_cannot_be_read(tmp_path, rows, header, message):
    log = write_log(tmp_path / "log.csv", rows, header or "t,q0,q1,q5,ca0")
    with pytest.raises(InputError, match=message) as caught:
        from_robot_csv(log, {"left_elbow_flexion": (0.0, 2.0)})
    assert "log.csv" in str(caught.value)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({}, "limits"),
        ({"tail": (0.0, 1.0)}, "tail"),
        ({"waist_yaw": (1.0, 1.0)}, "waist_yaw"),
        ({"waist_yaw": (0.0, float("inf"))}, "waist_yaw"),
    ],
)
def test_limits_that_make_no_sense(tmp_path, limits, message):
    log = write_log(tmp_path / "log.csv", ["0,1,1,1,1", "1,1,1,1,1"])
    with pytest.raises(InputError, match=message):
        from_robot_csv(log, limits)
    with pytest.raises(InputError, match="existing file"):
        from_robot_csv(tmp_path / "none.csv", {"waist_yaw": (0.0, 1.0)})


@pytest.mark.skipif(not LOG.exists(), reason=f"no robot log {LOG}")
def test_a_log_of_the_real_robot():
    limits = dict.fromkeys(ROBOT_LOG_JOINTS, (-1.0, 1.0))
    demonstration = from_robot_csv(LOG, limits)
    assert demonstration.q.shape == (301, 13)
    assert demonstration.t[0] == 0.0
    assert demonstration.t[-1] == pytest.approx(10.0)
    assert np.abs(demonstration.q).max() < 1.1
    # The left arm was led by hand, the right hung still.
    moved = dict(
        zip(demonstration.joint_names, np.ptp(demonstration.q, 0), strict=True)
    )
    assert moved["left_elbow_flexion"] > 0.4
    assert moved["right_elbow_flexion"] < 0.1


def damaged(path, change):
    """A file of three demonstrations, changed by hand."""
    write_demonstrations(path, [make(i) for i in range(3)])
    with h5py.File(path, "r+") as file:
        change(file["demonstrations"])


def replace_theta(group, **how):
    del group["000001/theta"]
    group["000001"].create_dataset("theta", **how)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda g: g.__delitem__("000001"),
            "demonstration 000001 is 'missing'",
        ),
        (lambda g: g.move("000002", "000007"), "000002 is 'missing'"),
        (
            lambda g: replace_theta(
                g, shape=(2**40,), dtype=float, chunks=(1024,)
            ),
            r"000001: theta is .*\(1099511627776,\)",
        ),
        (
            lambda g: replace_theta(g, shape=(2**40,), dtype=float),
            r"000001: theta is .*\(1099511627776,\)",
        ),
        (lambda g: replace_theta(g, data="words"), "000001: theta"),
        (
            lambda g: replace_theta(g, data=np.full(45, np.nan)),
            r"000001: theta\[0\] is nan",
        ),
        (
            lambda g: (
                g["000001"].__delitem__("theta"),
                g["000001"].create_group("theta"),
            ),
            "theta is .*expected a dataset",
        ),
        (lambda g: g["000001"].__delitem__("q"), "000001"),
        (lambda g: g["000001"].attrs.__delitem__("attempt"), "attempt"),
        (
            lambda g: g["000001"].attrs.__setitem__("content", "[1]"),
            "content is",
        ),
        (
            lambda g: g["000001"].attrs.__setitem__("content", "{"),
            "000001 is damaged",
        ),
        (
            lambda g: g["000001"].attrs.__setitem__("seed", "many"),
            "000001 is damaged",
        ),
        (
            lambda g: g["000001"].attrs.__setitem__("joint_names", 3),
            "000001 is damaged",
        ),
    ],
)
def test_what_was_changed_by_hand_is_told(tmp_path, change, message):
    path = tmp_path / "a.h5"
    damaged(path, change)
    with pytest.raises(InputError, match=message) as raised:
        read_demonstrations(path)
    assert str(path) in str(raised.value)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 300


def test_only_what_was_expected_is_added_to(tmp_path):
    path = tmp_path / "a.h5"
    assert append_demonstration(path, make(0), 0) == 1
    before = path.read_bytes()
    with pytest.raises(InputError, match="holds 1 demonstrations, expected 4"):
        append_demonstration(path, make(1), 4)
    assert path.read_bytes() == before
    assert append_demonstration(path, make(1), 1) == 2


def test_a_link_stays_and_its_target_grows(tmp_path):
    (tmp_path / "far").mkdir()
    link = tmp_path / "link.h5"
    link.symlink_to("far/a.h5")
    for count in (1, 2):
        append_demonstration(link, make(count))
        assert link.is_symlink()
        assert len(read_demonstrations(tmp_path / "far/a.h5")) == count
    write_demonstrations(link, [make(5)])
    assert link.is_symlink()
    assert len(read_demonstrations(tmp_path / "far/a.h5")) == 1
    assert [each.name for each in (tmp_path / "far").iterdir()] == ["a.h5"]


def test_a_file_of_the_first_format_is_read(tmp_path):
    """Its texts are of any length, where HDF5 keeps these."""
    path = tmp_path / "a.h5"
    written = make(scenario="Trommel-Übung", teacher="")
    append_demonstration(path, written)

    def loosen(_, item):
        for name, value in dict(item.attrs).items():
            if isinstance(value, bytes):
                item.attrs[name] = value.decode()
            elif getattr(value, "dtype", np.dtype(int)).kind == "S":
                item.attrs[name] = [each.decode() for each in value]

    with h5py.File(path, "r+") as file:
        loosen("", file)
        file.visititems(loosen)
        file.attrs["format_version"] = 1
        assert isinstance(file.attrs["format"], str)
    assert_same(read_demonstrations(path)[0], written)
    append_demonstration(path, written)
    assert len(read_demonstrations(path)) == 2


def test_no_damage_is_taken_for_a_demonstration(tmp_path):
    """Nor does reading go on for ever."""
    path = tmp_path / "a.h5"
    written = [make(i, content={"values": "1"}) for i in range(3)]
    write_demonstrations(path, written)
    whole = path.read_bytes()
    rng = random.Random(0)
    told = []
    for _ in range(200):
        path.write_bytes(damage.damaged(whole, rng))
        try:
            found = read_demonstrations(path)
        except InputError as error:
            told.append(str(error))
        else:
            for each, before in zip(found, written, strict=True):
                assert_same(each, before)
    assert len(told) > 100
    assert all(str(path) in each and "\n" not in each for each in told)
