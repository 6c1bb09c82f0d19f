# SPDX-License-Identifier: GPL-3.0-or-later
"""Heater safety, commands and reports, on a bench printer."""
import pytest
from bench_printer import Printer

from klippy.errors import CommandError, ConfigError
from klippy.extras import heaters as heaters_module
from klippy.extras import thermistor

KIND = "EPCOS 100K B57560G104F"
BED = {"sensor_type": KIND, "sensor_pin": "PK6", "heater_pin": "PH5",
       "control": "watermark", "min_temp": 0, "max_temp": 130}


@pytest.fixture
def printer():
    made = Printer({"heater_bed": dict(BED)})
    made.load_object(made.make_section("heaters"), "heaters")
    made.load_object(None, "heater_bed")
    made.start()
    return made


def report(printer, temp, step=0.3):
    """One sensor reading now."""
    sensor = thermistor.Thermistor(4700.0, 0.0)
    sensor.curve = thermistor.fit(thermistor.BUILT_IN[KIND])
    printer.pins["PK6"].report(printer.now, sensor.calc_adc(temp))
    printer.now += step


def heat(printer):
    return printer.objects["heater_bed"].heater


def test_pins_are_set_up_for_safety(printer):
    pin = printer.pins["PH5"]
    assert pin.setup["setup_max_duration"] == ((5.0,), {})
    args, limits = printer.pins["PK6"].setup["setup_adc_sample"]
    assert args == (0.3, 0.001, 8)
    # 130 degC is the low end of the divider, 0 degC the high one.
    assert 0.0 < limits["minval"] < limits["maxval"] < 1.0
    assert limits["range_check_count"] == 4


def test_reading_is_smoothed_and_reported(printer):
    for _ in range(20):
        report(printer, 50.0)
    status = heat(printer).get_status(printer.now)
    assert status == {"temperature": pytest.approx(50.0, abs=0.1),
                      "target": 0.0, "power": 0.0, "pid_profile": "default"}


def test_target_outside_the_range_is_refused(printer):
    with pytest.raises(CommandError, match=r"131.0.*heater_bed.*0.0:130.0"):
        printer.run("M140", S=131)
    assert heat(printer).target_temp == 0.0


def test_power_is_renewed_before_the_mcu_times_out(printer):
    printer.run("M140", S=60)
    for _ in range(100):
        heat(printer).get_temp(printer.now)
        report(printer, 40.0)
    times = [t for t, v in printer.pins["PH5"].sent]
    assert {v for t, v in printer.pins["PH5"].sent} == {1.0}
    gaps = [b - a for a, b in zip(times, times[1:], strict=False)]
    assert gaps and max(gaps) < 5.0 and min(gaps) > 0.3


def test_power_goes_off_at_once_with_the_target(printer):
    printer.run("M140", S=60)
    heat(printer).get_temp(printer.now)
    report(printer, 40.0)
    printer.run("M140", S=0)
    report(printer, 40.0)
    assert printer.pins["PH5"].sent[-1][1] == 0.0


def test_heating_stops_when_the_main_thread_hangs(printer):
    printer.run("M140", S=60)
    heat(printer).get_temp(printer.now)
    for _ in range(30):
        report(printer, 40.0)
    assert printer.pins["PH5"].sent[-1][1] == 0.0
    first_off = next(t for t, v in printer.pins["PH5"].sent if not v)
    assert first_off - printer.pins["PH5"].sent[0][0] < 6.0


def test_shutdown_turns_the_power_off(printer):
    printer.run("M140", S=60)
    heat(printer).get_temp(printer.now)
    report(printer, 40.0)
    printer.send("klippy:shutdown")
    report(printer, 40.0)
    assert printer.pins["PH5"].sent[-1][1] == 0.0


def test_stale_readings_show_as_zero(printer):
    report(printer, 50.0)
    printer.now += 8.0
    assert heat(printer).get_temp(printer.now) == (0.0, 0.0)


def test_m105_shows_current_and_target(printer):
    for _ in range(30):
        report(printer, 21.9)
    printer.run("M140", S=60)
    printer.run("M105")
    assert printer.output[-1] == "B:21.9 /60.0"


def test_m105_before_ready():
    printer = Printer()
    printer.load_object(printer.make_section("heaters"), "heaters")
    printer.run("M105")
    assert printer.output == ["T:0"]


def test_m190_reports_once_a_second_and_ends(printer):
    temp = [30.0]

    def warm_up(now):
        temp[0] += 2.0
        for _ in range(8):
            report(printer, temp[0], 0.0)
    printer.on_pause = warm_up
    start = printer.now
    printer.run("M190", S=60)
    assert all(line.startswith("B:") and line.endswith("/60.0")
               for line in printer.output)
    assert len(printer.output) == pytest.approx(printer.now - start)
    assert heat(printer).smoothed_temp >= 58.0


@pytest.mark.parametrize("command", ["M108", "HEATER_INTERRUPT"])
def test_m108_ends_the_wait_and_keeps_the_target(printer, command):
    start = printer.now

    def interrupt(now):
        if now > start + 10.:
            printer.interrupts.note_arrival(command)
    printer.on_pause = interrupt
    printer.run("M190", S=60)
    assert printer.output[-1] == "// The wait for a temperature was ended"
    assert start + 10. < printer.now < start + 12.
    assert heat(printer).target_temp == 60.
    printer.run(command)


def test_waits_are_skipped_in_batch_mode(printer):
    printer.start_args["debugoutput"] = "out.serial"
    printer.run("M190", S=60)
    assert printer.output == []


def test_temperature_wait_needs_a_limit(printer):
    with pytest.raises(CommandError, match="MINIMUM or MAXIMUM"):
        printer.run("TEMPERATURE_WAIT", "heater_bed", SENSOR="heater_bed")


def test_temperature_wait_ends_inside_the_limits(printer):
    temp = [80.0]

    def cool_down(now):
        temp[0] -= 3.0
        for _ in range(8):
            report(printer, temp[0], 0.0)
    cool_down(0.0)
    printer.on_pause = cool_down
    printer.run("TEMPERATURE_WAIT", "heater_bed", SENSOR="heater_bed",
                MAXIMUM=50)
    assert 45.0 < heat(printer).smoothed_temp <= 50.0


def test_turn_off_heaters(printer):
    printer.run("M140", S=60)
    printer.run("TURN_OFF_HEATERS")
    assert heat(printer).target_temp == 0.0


def test_status_lists_heaters_and_sensors(printer):
    status = printer.objects["heaters"].get_status(0.0)
    assert status == {"available_heaters": ["heater_bed"],
                      "available_sensors": ["heater_bed"],
                      "available_monitors": []}


def test_unknown_sensor_names_section_value_and_remedy():
    printer = Printer({"heater_bed": {**BED, "sensor_type": "EPCOS"}})
    with pytest.raises(ConfigError) as caught:
        printer.load_object(printer.make_section("heaters"), "heater_bed")
    for part in ("'EPCOS'", "'heater_bed'", "Generic 3950", "[thermistor EPCOS]"):
        assert part in str(caught.value)


def test_custom_thermistor_may_come_after_its_heater():
    printer = Printer({
        "heater_bed": {**BED, "sensor_type": "mine"},
        "thermistor mine": {"temperature1": 25, "resistance1": 100000,
                            "beta": 3950}})
    printer.load_object(printer.make_section("heaters"), "heater_bed")
    assert "mine" in printer.objects["heaters"].sensor_factories


def test_lookup_of_an_unknown_heater_lists_the_known(printer):
    with pytest.raises(ConfigError, match=r"'chamber'.*'heater_bed'"):
        heaters_module.get(printer).lookup_heater("chamber")


def test_out_of_range_shutdown_is_explained(printer):
    report(printer, 140.0)
    reason, explain = printer.objects["error_mcu"].clarifiers[0]
    assert reason == "ADC out of range"
    hint = explain("x", {"mcu": "mcu"})
    assert "heater_bed" in hint and "140.0" in hint and "130.0" in hint
    report(printer, 100.0)
    assert explain("x", {"mcu": "mcu"}) is None
    assert explain("x", {"mcu": "other"}) is None
