# SPDX-License-Identifier: GPL-3.0-or-later
"""States on disk, with the power cut at every byte of every write."""

import os

import pytest

from klippy.extras.recovery_journal import Journal, JournalThread


class PowerCut(Exception):
    """The machine has no power any more."""


@pytest.fixture
def path(tmp_path):
    return tmp_path / "state"


def test_empty_folder_has_no_state(path):
    assert Journal(path).read() is None


def test_last_state_is_read_by_a_new_journal(path):
    for number in range(5):
        journal = Journal(path)
        assert journal.read() == ({"n": number - 1} if number else None)
        journal.write({"n": number})
    assert Journal(path).read() == {"n": 4}
    assert len(list(path.parent.iterdir())) == 2


@pytest.mark.parametrize("sizes", [(10, 200), (200, 10), (50, 50)])
def test_power_cut_at_each_byte_leaves_the_last_or_the_state_before(
        path, monkeypatch, sizes):
    """The disk takes n bytes of a write, or all of them but not the new length."""
    def states():
        for number in range(4):
            yield {"number": number, "text": "x" * sizes[number % 2]}
    real_write, real_cut = os.pwrite, os.ftruncate
    budget = [0]

    def write(fd, data, position):
        taken = min(len(data), budget[0])
        real_write(fd, data[:taken], position)
        budget[0] -= taken
        if taken < len(data):
            raise PowerCut
        return taken

    def truncate(fd, length):
        if budget[0] < 1:
            raise PowerCut
        budget[0] -= 1
        real_cut(fd, length)

    for cut in range(2000):
        for old in path.parent.iterdir():
            old.unlink()
        budget[0], written = cut, []
        monkeypatch.setattr(os, "pwrite", write)
        monkeypatch.setattr(os, "ftruncate", truncate)
        journal = Journal(path)
        try:
            for state in states():
                journal.write(state)
                written.append(state)
            break
        except PowerCut:
            monkeypatch.undo()
            allowed = [written[-1] if written else None, state]
            assert Journal(path).read() in allowed
    assert len(written) == 4 and cut > 300


@pytest.mark.parametrize("data", [
    b"", b"\xff" * 100, b"klippy-recovery-1 5 2 00000000\n{}",
    b"klippy-recovery-1 9999 100 00000000\n{}", b"klippy-recovery-1 a b c\n",
    b"klippy-recovery-1 7 -1 00000000\n{}"])
def test_damaged_file_does_not_hide_the_other(path, data):
    journal = Journal(path)
    journal.write({"n": 1})
    journal.write({"n": 2})
    with open("%s.0" % (path,), "wb") as file:
        file.write(data)
    assert Journal(path).read() == {"n": 1}


def test_thread_writes_the_last_state_and_ends(path, monkeypatch):
    thread = JournalThread(Journal(path))
    for number in range(100):
        thread.write({"n": number})
    thread.close()
    assert Journal(path).read() == {"n": 99}


def test_full_disk_is_told_once(path, caplog):
    thread = JournalThread(Journal(path.parent / "missing" / "state"))
    for number in range(3):
        thread.write({"n": number})
    thread.close()
    assert len([r for r in caplog.records if "not saved" in r.message]) == 1
