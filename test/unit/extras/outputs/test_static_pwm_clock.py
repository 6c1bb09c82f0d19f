# SPDX-License-Identifier: GPL-3.0-or-later
"""The square wave of [static_pwm_clock]."""
import pytest
from bench_printer import Printer
from outputs_bench import OutputsBench

from klippy.errors import ConfigError


def make(**options):
    printer = Printer({"static_pwm_clock ref": {"pin": "PB1", **options}})
    printer.load_object(None, "static_pwm_clock ref")
    return printer.pins["PB1"].setup


def test_period_and_duty():
    setup = make(frequency=12000000)
    (cycle_time, is_hard), _ = setup["setup_cycle_time"]
    assert is_hard and 1.0 / cycle_time == pytest.approx(12e6)
    assert setup["setup_start_value"] == ((0.5, 0.5), {})
    assert setup["setup_max_duration"] == ((0.0,), {})
    assert make()["setup_cycle_time"][0][0] == pytest.approx(0.01)


@pytest.mark.parametrize("frequency", [3.0, 0, -5, 530000000])
def test_bad_frequency(frequency):
    with pytest.raises(ConfigError, match="frequency"):
        make(frequency=frequency)


def test_half_the_time_on_also_after_a_shutdown(tmp_path, monkeypatch):
    bench = OutputsBench(tmp_path, monkeypatch, """
[static_pwm_clock ref]
pin: PB1
frequency: 1000
""")
    trace = bench.watch("PB1")

    def body(it):
        assert it.read_duty(trace, 1.0) == pytest.approx(0.5, abs=0.01)
        it.printer.invoke_shutdown("test")
        assert it.read_duty(trace, 1.0) == pytest.approx(0.5, abs=0.01)
    bench.run(body)
