"""Finished trials are kept, found again, and never counted twice."""

import multiprocessing
import os
import random
import signal
import sqlite3
import time

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.runner.arrays import pack_arrays
from drake_affetto.runner.store import TrialStore, trial_key
from drake_affetto.skill.elm import ElmRegressor
from support import damage


def spec(i=0, **more):
    return {"kind": "k", "i": i, "seed": 3, **more}


def test_a_result_comes_back_as_it_was(tmp_path):
    arrays = {"theta": np.linspace(0, 1, 7), "empty": np.zeros((0, 3))}
    with TrialStore(tmp_path / "a.sqlite") as store:
        assert store.get(spec()) is None
        store.put(spec(), {"reward": 0.1 + 0.2, "success": True}, arrays)
    with TrialStore(tmp_path / "a.sqlite") as store:
        result, back = store.get(spec())
    assert result == {"reward": 0.1 + 0.2, "success": True}
    assert set(back) == set(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(back[name], array)


def test_the_key_holds_everything_that_determines_a_trial():
    X, y = np.random.default_rng(0).normal(size=(2, 6, 2))
    fitted = ElmRegressor(n_hidden=5, random_state=0).fit(X, y)
    again = ElmRegressor(n_hidden=5, random_state=0).fit(X, y)
    other = ElmRegressor(n_hidden=5, random_state=0).fit(X, y + 1e-9)
    keys = {
        trial_key(each)
        for each in (
            spec(),
            spec(1),
            spec(xy=[0.1, 0.2]),
            spec(xy=[0.1, 0.2 + 1e-12]),
            spec(prototypes=[np.zeros(3)]),
            spec(prototypes=[np.ones(3)]),
            spec(regressor=fitted),
            spec(regressor=other),
        )
    }
    assert len(keys) == 8
    assert trial_key(spec(regressor=again)) in keys
    assert trial_key(dict(reversed(spec().items()))) in keys


def test_a_trial_is_counted_once(tmp_path):
    with TrialStore(tmp_path / "a.sqlite") as store:
        store.put(spec(), {"reward": 1.0}, {})
        store.put(spec(), {"reward": 2.0}, {})
        assert len(store) == 1
        assert store.get(spec())[0] == {"reward": 1.0}


def test_nan_is_refused(tmp_path):
    with (
        TrialStore(tmp_path / "a.sqlite") as store,
        pytest.raises(ValueError, match="JSON"),
    ):
        store.put(spec(), {"reward": float("nan")}, {})


def test_a_foreign_file_is_refused(tmp_path):
    path = tmp_path / "a.sqlite"
    path.write_bytes(b"this is no database, but long enough for one" * 40)
    with pytest.raises(InputError, match=r"a\.sqlite"):
        TrialStore(path)


def _write_for_ever(path):
    with TrialStore(path) as store:
        for i in range(1_000_000):
            store.put(spec(i), {"reward": i}, {"x": np.full(100, float(i))})


def test_a_kill_loses_no_finished_trial(tmp_path):
    path = tmp_path / "a.sqlite"
    process = multiprocessing.get_context("spawn").Process(
        target=_write_for_ever, args=(path,)
    )
    process.start()
    deadline = time.monotonic() + 60
    seen = 0
    while seen < 20 and time.monotonic() < deadline:
        time.sleep(0.05)
        if path.exists():
            with TrialStore(path) as store:
                seen = len(store)
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    with TrialStore(path) as store:
        assert len(store) >= seen >= 20
        for i in range(len(store)):
            result, arrays = store.get(spec(i))
            assert result == {"reward": i}
            assert np.all(arrays["x"] == i)


def test_the_key_of_a_stored_trial_stays():
    spec = {
        "kind": "x",
        "a": np.float64(1.5),
        "b": np.arange(3.0),
        "c": (1, None, True),
        "d": {1: np.int64(2)},
    }
    assert trial_key(spec) == (
        "f700a687dc0e16f86d4a174c26a69ac54d701540ede2fc8d6672322fa4c69835"
    )


def test_a_spec_comes_back_with_its_arrays(tmp_path):
    array = np.linspace(0.0, 1.0, 5)
    many = [spec(theta=array), spec(1, theta=array, more=[np.ones((2, 3))])]
    with TrialStore(tmp_path / "a.sqlite") as store:
        for each in many:
            store.put(each, {"reward": 1.0}, {})
        keys = [row.key for row in store.rows()]
        assert keys == [trial_key(each) for each in many]
        np.testing.assert_array_equal(
            store.spec(keys[1][:9])[1]["more"][0], np.ones((2, 3))
        )
    with TrialStore(tmp_path / "b.sqlite") as other:
        # Another study that takes trials over can run them again, too.
        assert other.merge(tmp_path / "a.sqlite") == 2
        np.testing.assert_array_equal(other.spec(keys[0])[1]["theta"], array)
        with pytest.raises(InputError, match="key is ''"):
            other.spec("")


def test_a_spec_that_was_changed_is_refused(tmp_path):
    with TrialStore(tmp_path / "a.sqlite") as store:
        store.put(spec(theta=np.ones(2)), {}, {})
        key = trial_key(spec(theta=np.ones(2)))
        store._db.execute(
            "UPDATE trials SET spec = replace(spec, ?, ?)",
            ('"seed": 3', '"seed": 4'),
        )
        with pytest.raises(InputError, match="its spec is damaged"):
            store.spec(key)
        store._db.execute("UPDATE trials SET spec = '{'")
        with pytest.raises(InputError, match="is damaged"):
            store.spec(key)
        store._db.execute("UPDATE trials SET spec = '[]'")
        with pytest.raises(InputError, match="an object"):
            list(store.rows())


# --- What was stored is not trusted -------------------------------------------


def filled(path):
    """A store of three trials, closed."""
    with TrialStore(path) as store:
        for i in range(3):
            store.put(spec(i), {"reward": 0.5}, {"x": np.arange(5.0)})
        store.plan("Phase", [spec(i) for i in range(3)])
        store._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")


def read_all(path, **how):
    with TrialStore(path, **how) as store:
        store.verify()
        for i in range(3):
            store.get(spec(i))


def refused(path):
    """The error of whoever opens the file and reads all of it."""
    with pytest.raises(InputError) as raised:
        read_all(path)
    text = str(raised.value)
    assert str(path) in text
    assert "\n" not in text
    assert len(text) < 300
    return text


CUT = pack_arrays({"x": np.arange(4.0)})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("UPDATE trials SET result = '{' WHERE rowid = 2", "its result is dam"),
        ("UPDATE trials SET result = '[1]' WHERE rowid = 2", "an object"),
        ("UPDATE trials SET result = x'80'", "its result"),
        ("UPDATE trials SET result = '{\"a\": 1}'", "not the one that was"),
        ("UPDATE trials SET arrays = NULL", "its arrays are missing"),
        ("UPDATE trials SET arrays = 'text'", "its arrays are missing"),
        (f"UPDATE trials SET arrays = x'{CUT.hex()}'", "not the one that was"),
        ("ALTER TABLE trials DROP COLUMN arrays", "no column arrays"),
        ("ALTER TABLE plans DROP COLUMN key", "no column"),
        ("PRAGMA user_version = 7", "by a later version"),
        ("PRAGMA application_id = 77", "another program's file"),
        ("ALTER TABLE trials RENAME TO results", "another program's file"),
    ],
)
def test_what_was_changed_is_told(tmp_path, change, message):
    path = tmp_path / "a.sqlite"
    filled(path)
    with sqlite3.connect(path) as database:
        if "DROP COLUMN key" in change:
            # Of a primary key no column can be dropped.
            database.execute("DROP TABLE plans")
            change = "CREATE TABLE plans (label TEXT, position INTEGER)"
        database.execute(change)
    database.close()
    assert message in refused(path)


def test_arrays_without_digest_are_read_with_care(tmp_path):
    """As version 0.1.0 has written them."""
    path = tmp_path / "a.sqlite"
    filled(path)
    database = sqlite3.connect(path)
    database.execute("ALTER TABLE trials DROP COLUMN digest")
    database.execute("PRAGMA application_id = 0")
    database.execute("PRAGMA user_version = 0")
    database.commit()
    database.close()
    with TrialStore(path, read_only=True) as store:
        assert store.get(spec(1))[0] == {"reward": 0.5}
    with TrialStore(tmp_path / "b.sqlite") as other:
        assert other.merge(path) == 3
        other.verify()
    with TrialStore(path) as store:
        store.verify()
        store.put(spec(3), {}, {})
        store._db.execute("UPDATE trials SET arrays = x'50' WHERE rowid < 3")
        store._db.commit()
    assert "its arrays are damaged: File is not a zip file" in refused(path)


def test_another_programs_file_is_left_as_it_is(tmp_path):
    path = tmp_path / "a.sqlite"
    database = sqlite3.connect(path)
    database.execute("CREATE TABLE bookmarks (url TEXT)")
    database.commit()
    database.close()
    before = path.read_bytes()
    assert "another program's file" in refused(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
    with (
        TrialStore(tmp_path / "b.sqlite") as store,
        pytest.raises(InputError, match="another program's"),
    ):
        store.merge(path)


@pytest.mark.parametrize("read_only", [False, True])
def test_a_damaged_page_is_told(tmp_path, read_only):
    path = tmp_path / "a.sqlite"
    filled(path)
    data = bytearray(path.read_bytes())
    # Every page but the first is overwritten.
    data[4096:] = b"\xa5" * (len(data) - 4096)
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"a\.sqlite") as raised:
        read_all(path, read_only=read_only)
    assert "\n" not in str(raised.value)


def test_damage_is_told_by_every_way_of_reading(tmp_path):
    path = tmp_path / "a.sqlite"
    filled(path)
    with TrialStore(path) as store:
        store._db.execute("UPDATE trials SET finished_at = 'yesterday'")
        with pytest.raises(InputError, match="finished_at is 'yesterday'"):
            store.finished_at()
        store._db.execute("DROP TABLE trials")
        for read in (
            store.phases,
            store.finished_at,
            store.verify,
            lambda: list(store.rows()),
            lambda: store.get(spec(0)),
            lambda: store.spec("a"),
            lambda: len(store),
            lambda: store.outdated("Phase", []),
            lambda: store.put(spec(7), {}, {}),
        ):
            with pytest.raises(InputError, match=r"a\.sqlite: no such table"):
                read()


@pytest.mark.parametrize("value", [None, b"x"])
def test_a_key_that_is_no_text_is_told(tmp_path, value):
    path = tmp_path / "a.sqlite"
    filled(path)
    with TrialStore(path) as store:
        store._db.execute("UPDATE trials SET key = ? WHERE rowid = 1", (value,))
        for read in (store.verify, lambda: list(store.rows())):
            with pytest.raises(InputError, match=r"key is .*, expected a text"):
                read()


def test_entries_with_an_at_sign_are_kept_but_determine_nothing(tmp_path):
    here = spec(scenario={"@name": "here.yaml", "values": "1"})
    there = spec(scenario={"@name": "there.yaml", "values": "1"})
    other = spec(scenario={"@name": "here.yaml", "values": "2"})
    assert trial_key(here) == trial_key(there) != trial_key(other)
    with TrialStore(tmp_path / "a.sqlite") as store:
        store.put(here, {}, {})
        assert store.get(there) is not None
        assert store.spec(trial_key(there))[1] == here


def test_trials_that_a_new_plan_does_not_use_are_counted(tmp_path):
    path = tmp_path / "a.sqlite"
    filled(path)
    with TrialStore(path) as store:
        assert store.outdated("Phase", [spec(i) for i in range(5)]) == (0, {})
        assert store.outdated("Phase", [spec(2)]) == (2, spec(0))
        assert store.outdated("Other", [spec(7)]) == (0, {})


@pytest.mark.parametrize("read_only", [False, True])
def test_no_damage_is_taken_for_a_result(tmp_path, read_only):
    path = tmp_path / "a.sqlite"
    filled(path)
    with TrialStore(path) as store:
        store._db.execute("PRAGMA journal_mode=DELETE")
    whole = path.read_bytes()
    rng = random.Random(1)
    told = []
    for _ in range(200):
        for old in tmp_path.iterdir():
            old.unlink()
        path.write_bytes(damage.damaged(whole, rng))
        try:
            with TrialStore(path, read_only=read_only) as store:
                store.verify()
                for i in range(3):
                    found = store.get(spec(i))
                    if found is not None:
                        assert found[0] == {"reward": 0.5}
                        np.testing.assert_array_equal(found[1]["x"], range(5))
                for row in store.rows():
                    store.spec(row.key)
                store.phases()
                store.finished_at()
        except InputError as error:
            told.append(str(error))
    assert len(told) > 50
    assert all(str(path) in each and "\n" not in each for each in told)
