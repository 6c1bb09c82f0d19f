# SPDX-License-Identifier: GPL-3.0-or-later
"""The log file: rotation, full disks, many threads."""

import logging
import os
import threading

import pytest

from klippy import queuelogger
from klippy.queuelogger import QueueListener, RotatingFile

DAY = 86400.
NOON = 1700000000.


@pytest.fixture
def log_path(tmp_path):
    return tmp_path / "klippy.log"


def make_file(path, **options):
    return RotatingFile(path, lambda: ["HEADER"], **options)


def test_lines_are_appended(log_path):
    log_path.write_text("before\n")
    file = make_file(log_path)
    file.write(NOON, "one\ntwo \udcff \N{DEGREE SIGN}")
    file.close()
    assert log_path.read_text(encoding="utf-8") == (
        "before\none\ntwo \\udcff \N{DEGREE SIGN}\n")


def test_new_day_starts_a_new_file_with_the_header(log_path):
    file = make_file(log_path)
    file.write(NOON, "first day")
    file.write(NOON + DAY, "second day")
    file.close()
    assert log_path.read_text() == "HEADER\nsecond day\n"
    (old,) = [p for p in log_path.parent.iterdir() if p != log_path]
    assert old.read_text() == "first day\n"


def test_size_starts_a_new_file_and_old_ones_are_removed(log_path):
    file = make_file(log_path, max_bytes=100, n_backups=3)
    for number in range(50):
        file.write(NOON, "line %d with some text in it" % (number,))
    file.close()
    files = sorted(log_path.parent.iterdir())
    assert len(files) == 4
    assert all(path.stat().st_size <= 150 for path in files)
    assert "line 49" in log_path.read_text()


def test_lost_lines_are_counted_and_told_once(log_path, monkeypatch):
    file = make_file(log_path)
    file.write(NOON, "good")
    real, state = file._write, {"is_full": True}

    def write(text):
        if state["is_full"]:
            raise OSError(28, "No space left on device")
        real(text)
    monkeypatch.setattr(file, "_write", write)
    for _ in range(3):
        file.write(NOON, "lost")
    state["is_full"] = False
    file.write(NOON, "good again")
    file.write(NOON, "and on")
    file.close()
    text = log_path.read_text()
    assert "lost\n" not in text.replace("were lost", "")
    assert text.count("3 log lines were lost") == 1
    assert text.endswith("good again\nand on\n")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
def test_full_device_raises_nothing():
    file = make_file("/dev/full")
    file.write(NOON, "lost")
    file.write(NOON, "lost")
    assert file.n_lost == 2
    file.close()


def test_records_of_many_threads_all_arrive(log_path):
    listener = QueueListener(log_path)
    logger = logging.Logger("test")
    logger.addHandler(listener.handler)

    def work(number):
        for index in range(200):
            logger.info("thread %d line %d", number, index)
    threads = [threading.Thread(target=work, args=(n,)) for n in range(5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    listener.stop()
    lines = log_path.read_text().splitlines()
    assert len(lines) == 1000 and len(set(lines)) == 1000


def test_full_queue_drops_and_does_not_wait(log_path, monkeypatch):
    monkeypatch.setattr(queuelogger, "MAX_QUEUED", 10)
    monkeypatch.setattr(QueueListener, "_run", lambda self: None)
    listener = QueueListener(log_path)
    logger = logging.Logger("test")
    logger.addHandler(listener.handler)
    for number in range(25):
        logger.info("line %d", number)
    assert listener.handler.n_dropped == 15
    listener.output.close()


def test_rollover_info(log_path):
    listener = QueueListener(log_path)
    listener.set_rollover_info("a", "info A")
    listener.set_rollover_info("b", "info B")
    listener.set_rollover_info("a", None)
    assert listener._get_header() == ["info B"]
    listener.clear_rollover_info()
    assert listener._get_header() == [""]
    listener.stop()


def test_unwritable_path_is_an_error(tmp_path):
    with pytest.raises(OSError):
        queuelogger.setup_bg_logging(tmp_path / "no" / "such" / "folder.log")


def test_new_file_on_demand(log_path):
    listener = QueueListener(log_path)
    listener.set_rollover_info("versions", "INFO")
    listener.roll_over()            # nothing to keep
    for number in range(2):
        listener.lines.put((NOON, "line %d" % (number,)))
        listener.roll_over()
    listener.stop()
    assert log_path.read_text() == "INFO\n"
    olds = sorted(path.read_text() for path in log_path.parent.iterdir()
                  if path != log_path)
    assert olds == ["INFO\nline 1\n", "line 0\n"]
