# SPDX-License-Identifier: GPL-3.0-or-later
"""What sensors that the host reads have in common."""

import types

from klippy.extras.polled_sensor import PolledSensor


class Slow(PolledSensor):
    report_time = 2.0

    def _report(self, eventtime):
        return self._deliver(eventtime, 21.5)


def make_sensor(start_args):
    timers = []
    reactor = types.SimpleNamespace(
        register_timer=lambda callback: timers.append(callback) or callback)
    mcu = types.SimpleNamespace(estimated_print_time=lambda eventtime: eventtime - 10.)
    printer = types.SimpleNamespace(
        get_reactor=lambda: reactor, get_start_args=lambda: start_args,
        lookup_object={"mcu": mcu}.get)
    sensor = Slow(types.SimpleNamespace(get_printer=lambda: printer,
                                        get_name=lambda: "temperature_sensor x"))
    assert timers == [sensor.timer]
    return sensor


def test_reports_go_to_the_callback():
    sensor, reports = make_sensor({}), []
    sensor.setup_callback(lambda *report: reports.append(report))
    assert sensor.timer(15.) == 17. and sensor.timer(17.) == 19.
    assert reports == [(5., 21.5), (7., 21.5)]
    assert sensor.get_report_time_delta() == 2.


def test_range_and_batch_runs():
    sensor = make_sensor({"debugoutput": "out.serial"})
    assert sensor.range[0] < -273. and sensor.range[1] > 1e9
    sensor.setup_minmax(0., 100.)
    assert sensor.range == (0., 100.)
    assert not sensor.is_live() and make_sensor({}).is_live()
