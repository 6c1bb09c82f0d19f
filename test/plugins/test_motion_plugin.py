# SPDX-License-Identifier: GPL-3.0-or-later
"""A plug-in that moves the machine by the flat names, as third parties do."""

import machine_configs
import pytest
from printer_run import PrinterRun

from klippy import extras, plugins

PLUGIN = '''
import chelper, toolhead
from kinematics import cartesian


class Machine(cartesian.CartKinematics):
    def check_move(self, move):
        super().check_move(move)
        move.limit_speed(20., 1000.)


class Wiper:
    def __init__(self, config):
        self.printer, self.log = config.get_printer(), []
        self.ffi, self.lib = chelper.get_ffi()
        self.printer.register_event_handler("klippy:ready", self.ready)
        self.printer.lookup_object("gcode").register_command("WIPE", self.wipe)

    def ready(self):
        self.toolhead = self.printer.lookup_object("toolhead")
        assert isinstance(self.toolhead, toolhead.ToolHead)
        self.manual_move = self.toolhead.manual_move
        self.toolhead.manual_move = self.note_move
        self.toolhead.any_attribute = self

    def note_move(self, coord, speed):
        self.log.append((list(coord), speed))
        self.manual_move(coord, speed)

    def wipe(self, gcmd):
        start = self.toolhead.get_last_move_time()
        self.toolhead.manual_move([None, 110.], 200.)
        self.seconds = self.toolhead.get_last_move_time() - start
        tq = self.ffi.gc(self.lib.trapq_alloc(), self.lib.trapq_free)
        self.lib.trapq_append(tq, 1., 0.1, 0.5, 0.1, 1., 2., 3., 1., 0., 0., 0.,
                              10., 100.)
        moves = self.ffi.new("struct pull_move[4]")
        self.count = self.lib.trapq_extract_old(tq, moves, 4, 0., 9.)


def load_config(config):
    return Wiper(config)


def load_kinematics(toolhead, config):
    return Machine(toolhead, config)
'''
START = "SET_KINEMATIC_POSITION X=100 Y=100 Z=5\n"


def test_a_plug_in_moves_and_limits(tmp_path, monkeypatch):
    pytest.importorskip("cffi")
    folder = tmp_path / "plugins"
    folder.mkdir()
    (folder / "slow_wiper.py").write_text(PLUGIN)
    from klippy import kinematics
    for package in (extras, kinematics):
        monkeypatch.setattr(package, "__path__", list(package.__path__))
        plugins.add_folder(package, folder)
    config = machine_configs.make_axes("slow_wiper", 0.04, machine_configs.BED + (
        "\n[force_move]\nenable_force_move: True\n[slow_wiper]\n"))
    # The simulated machine knows the motors by the kind that it is made from
    run = PrinterRun(config.replace("slow_wiper\nmax", "cartesian\nmax"), tmp_path)
    run.config_path.write_text(config)
    run.run([START + "WIPE\n"])
    wiper = run.printer.lookup_object("slow_wiper")
    assert wiper.log == [([None, 110.], 200.)]
    # 10 mm at 20 mm/s, 1000 mm/s^2
    assert wiper.seconds == pytest.approx(0.5 + 20. / 1000.)
    assert wiper.count == 3 and wiper.toolhead.any_attribute is wiper
    assert wiper.toolhead.get_position()[:2] == [100., 110.]
