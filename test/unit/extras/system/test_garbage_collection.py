# SPDX-License-Identifier: GPL-3.0-or-later
"""[garbage_collection]: when Python's collector runs on a printer that prints."""
import gc

import pytest
from motion_bench import MotionBench
from motion_machine import PRINTER

CONFIG = PRINTER + "[garbage_collection]\n[idle_timeout]\n"


@pytest.fixture(autouse=True)
def collector():
    yield
    gc.enable()


def test_collector_rests_while_it_prints(tmp_path, monkeypatch):
    def body(it):
        assert gc.isenabled()
        it.send("G28\nG1 X100 F3000")
        it.pause(1.0)
        assert not gc.isenabled()
        it.toolhead.wait_moves()
        it.pause(5.0)
        assert it.get("idle_timeout")["state"] == "Ready" and gc.isenabled()
        collection = it.printer.lookup_object("garbage_collection")
        assert collection.n_collections == 1
        assert "gc: collections=1 longest=" in collection.stats(0.0)[1]
    MotionBench(tmp_path, monkeypatch, CONFIG).run_ready(body)
    assert gc.isenabled()


def test_many_new_objects_are_looked_at(tmp_path, monkeypatch):
    def body(it):
        it.send("G28\nG1 X100 F600")
        it.pause(1.0)
        kept = [[i] for i in range(30000)]
        assert gc.get_count()[0] > 20000
        it.pause(1.5)
        assert gc.get_count()[0] < 20000 and len(kept) == 30000
        assert it.printer.lookup_object("garbage_collection").n_collections == 1
    MotionBench(tmp_path, monkeypatch, CONFIG).run_ready(body)


def test_shutdown_gives_it_back(tmp_path, monkeypatch):
    def body(it):
        it.send("G28\nG1 X100 F600")
        it.pause(1.0)
        it.send("M112")
        it.pause(1.0)
        assert gc.isenabled()
    MotionBench(tmp_path, monkeypatch, CONFIG).run_ready(body)
