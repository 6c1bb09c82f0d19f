# SPDX-License-Identifier: GPL-3.0-or-later
"""[pwm_cycle_time]: pulses and their length at the pin."""
import pytest
from outputs_bench import OutputsBench

from klippy.errors import CommandError

CONFIG = """
[pwm_cycle_time tone]
pin: %s
scale: 10
value: 2
cycle_time: 0.01
%s
"""


@pytest.mark.parametrize("pin", ["PB1", "!PB1"])
def test_duty_follows_through_changes_of_the_cycle(tmp_path, monkeypatch, pin):
    def body(it):
        it.pause(0.5)
        trace = it.watch(pin)
        it.pause(0.1)
        assert it.read_duty(trace, 1.0) == pytest.approx(0.2, abs=0.01)
        for value, cycle_time in ((5, 0.002), (3, 0.5), (7, 0.5), (0, 0.1), (6, 0.01)):
            it.send("SET_PIN PIN=tone VALUE=%s CYCLE_TIME=%s" % (value, cycle_time))
            it.pause(1.0)
            assert it.get("pwm_cycle_time tone") == {"value": value / 10}
            assert it.printer.lookup_object("pwm_cycle_time tone").pin.cycle_ticks \
                == it.printer.lookup_object("mcu").seconds_to_clock(cycle_time)
            duty = it.read_duty(trace, 2.0)
            assert duty == pytest.approx(value / 10, abs=0.01)
        it.send("SET_PIN PIN=tone VALUE=4 CYCLE_TIME=2")
        it.pause(1.0)
        shares = [it.read_duty(trace, 0.1) for _ in range(20)]
        assert sum(s > 0.99 for s in shares) >= 7
        for wrong in ("VALUE=11", "VALUE=1 CYCLE_TIME=0", "CYCLE_TIME=1",
                      "VALUE=1 CYCLE_TIME=99"):
            with pytest.raises(CommandError):
                it.send("SET_PIN PIN=tone " + wrong)
    OutputsBench(tmp_path, monkeypatch, CONFIG % (pin, "")).run_ready(body)


def test_no_pulses_after_a_shutdown(tmp_path, monkeypatch):
    def body(it):
        assert it.printer.state == "error"
        assert "shutdown_value" in it.printer.state_message
    OutputsBench(tmp_path, monkeypatch,
                 CONFIG % ("PB1", "shutdown_value: 5")).run(body)
