# SPDX-License-Identifier: GPL-3.0-or-later
"""The mcu objects against the real firmware, over the real link, in virtual time."""

import itertools

import bench
import pytest

from klippy.errors import ConfigError, McuError


def setup_pin(config, kind, pin):
    return config.get_printer().lookup_object("pins").setup_pin(kind, pin)


@pytest.fixture
def make_bench(tmp_path, monkeypatch):
    def make(config=bench.MAIN_CONFIG, **options):
        return bench.Bench(tmp_path, monkeypatch, config, **options)
    return make


def test_connect_configure_and_status(make_bench):
    def body(it):
        assert it.state == "ready", it.message
        status = it.mcu.get_status()
        assert status["mcu_constants"]["MCU"] == "simulator"
        assert status["mcu_version"]
        it.pause(7.)
        it.mcu.stats(it.printer.get_reactor().monotonic())
        stats = it.mcu.get_status()["last_stats"]
        # the code of a simulated mcu takes no time of its world
        assert stats["mcu_awake"] == 0. and stats["mcu_task_avg"] == 0.
        assert stats["freq"] == pytest.approx(
            status["mcu_constants"]["CLOCK_FREQ"], rel=1e-5)
        assert stats["bytes_write"] > 100 and stats["bytes_retransmit"] == 0

    it = make_bench()
    assert it.run(body) == "exit"
    assert it.machine.configured == ["mcu"]


def test_digital_out_changes_on_time(make_bench):
    def make(config, objects):
        objects.out = setup_pin(config, "digital_out", "!gpio5")
        objects.out.setup_max_duration(0.)
        objects.out.setup_start_value(0, 0)

    def body(it):
        trace = it.machine.mcus["mcu"].watch_output(5, invert=True)
        it.objects.out.set_digital(it.print_time(0.2), 1)
        it.pause(0.19)
        assert trace.level == 0
        it.pause(0.02)
        assert trace.level == 1
        assert it.state == "ready"

    make_bench().run(body, make)


@pytest.mark.parametrize("is_hard", [False, True])
@pytest.mark.parametrize("invert", ["", "!"])
def test_pwm_duty(make_bench, is_hard, invert):
    def make(config, objects):
        objects.out = setup_pin(config, "pwm", invert + "gpio6")
        objects.out.setup_max_duration(0.)
        objects.out.setup_cycle_time(0.010, is_hard)
        objects.out.setup_start_value(0., 0.)

    def body(it):
        trace = it.machine.mcus["mcu"].watch_output(6, invert=bool(invert))
        for duty in (0.25, 1., 0.):
            it.objects.out.set_pwm(it.print_time(0.2), duty)
            it.pause(0.3)
            trace.read_duty()
            it.pause(0.5)
            assert trace.read_duty() == pytest.approx(duty, abs=0.01)

    make_bench().run(body, make)


def test_max_duration_shuts_down_the_mcu(make_bench):
    def make(config, objects):
        objects.out = setup_pin(config, "digital_out", "gpio5")
        objects.out.setup_max_duration(1.)
        objects.out.setup_start_value(0, 0)

    def body(it):
        it.objects.out.set_digital(it.print_time(0.2), 1)
        it.pause(3.)
        assert it.state == "shutdown"
        assert "Missed scheduling of next digital out event" in it.message
        assert "The board got a pin update too late" in it.message

    make_bench().run(body, make)


def test_adc_reports_and_range_check(make_bench):
    samples = []

    def make(config, objects):
        objects.adc = setup_pin(config, "adc", "gpio7")
        objects.adc.setup_adc_sample(0.300, 0.001, 8, minval=0.1, maxval=0.9,
                                     range_check_count=4)
        objects.adc.setup_adc_callback(samples.extend)

    def body(it):
        mcu = it.machine.mcus["mcu"]
        it.pause(4.)
        assert len(samples) > 5
        assert all(value == pytest.approx(0.25, abs=0.001) for _, value in samples)
        steps = [b[0] - a[0] for a, b in itertools.pairwise(samples)]
        assert steps == pytest.approx([0.3] * len(steps), abs=1e-4)
        assert samples[-1][0] == pytest.approx(it.print_time(), abs=0.35)
        assert it.objects.adc.get_last_value() == (samples[-1][1], samples[-1][0])
        mcu.set_adc(7, 0.95)
        it.pause(3.)
        assert it.state == "shutdown"
        assert "MCU 'mcu' shutdown: ADC out of range" in it.message
        assert "min_temp or above max_temp" in it.message

    it = make_bench()
    it.machine.mcus["mcu"].set_adc(7, 0.25)
    it.run(body, make)


def make_endstop(config, objects):
    objects.endstop = setup_pin(config, "endstop", "^gpio8")


def test_endstop_query_and_trigger_time(make_bench):
    def body(it):
        mcu = it.machine.mcus["mcu"]
        endstop = it.objects.endstop
        assert endstop.query_endstop(it.print_time()) == 0
        start = it.print_time(0.2)
        done = endstop.home_start(start, 0.000015, 4, 0.001)
        it.pause(0.7)
        assert not done.test()
        pressed = it.print_time()
        mcu.set_input(8, 1)
        it.pause(0.1)
        assert done.test()
        trigger = endstop.home_wait(start + 5.)
        assert pressed - 0.0001 < trigger < pressed + 0.0011
        assert endstop.query_endstop(it.print_time()) == 1

    it = make_bench()
    it.machine.mcus["mcu"].set_input(8, 0)
    it.run(body, make_endstop)


def test_endstop_without_trigger(make_bench):
    def body(it):
        start = it.print_time(0.2)
        it.objects.endstop.home_start(start, 0.000015, 4, 0.001)
        assert it.objects.endstop.home_wait(start + 1.) == 0.
        assert it.print_time() >= start + 1.
        assert it.state == "ready"

    it = make_bench()
    it.machine.mcus["mcu"].set_input(8, 0)
    it.run(body, make_endstop)


def test_restart_keeps_the_configuration(make_bench):
    def body(it):
        assert it.state == "ready", it.message
        assert it.objects.endstop.query_endstop(it.print_time()) == 0

    it = make_bench()
    it.machine.mcus["mcu"].set_input(8, 0)
    it.run(body, make_endstop)
    it.start_args["start_reason"] = "restart"
    it.run(body, make_endstop)


def test_other_configuration_asks_for_firmware_restart(make_bench):
    def ready(it):
        assert it.state == "ready", it.message

    def never(it):
        raise AssertionError("the printer started: " + it.message)

    it = make_bench()
    it.run(ready)
    it.start_args["start_reason"] = "restart"
    assert it.run(never, make_endstop) == "firmware_restart"
    it.run(ready, make_endstop)


def test_emergency_stop_and_firmware_restart(make_bench):
    def stop(it):
        it.printer.invoke_shutdown("Test of the stop")
        it.pause(1.)
        assert it.mcu.is_shutdown()
        it.printer.request_exit("firmware_restart")

    def ready(it):
        assert it.state == "ready", it.message

    it = make_bench()
    assert it.run(stop) == "firmware_restart"
    it.run(ready)


def test_shut_down_mcu_is_restarted_at_connect(make_bench):
    def stop(it):
        it.printer.invoke_shutdown("Test of the stop")
        it.pause(1.)

    def never(it):
        raise AssertionError("the printer started: " + it.message)

    it = make_bench()
    it.run(stop)
    it.start_args["start_reason"] = "restart"
    assert it.run(never) == "firmware_restart"


def test_cable_cut_is_noticed_and_ends_waits(make_bench):
    def body(it):
        it.machine.mcus["mcu"].link.cut()
        start = it.printer.get_reactor().monotonic()
        with pytest.raises(McuError, match="get_config|config|link"):
            it.mcu.lookup_query_command(
                "get_config",
                "config is_config=%c crc=%u is_shutdown=%c move_count=%hu").send()
        assert it.printer.get_reactor().monotonic() - start < 10.
        it.pause(1.)
        assert it.state == "shutdown"
        assert "Lost communication with MCU 'mcu'" in it.message
        assert "cable" in it.message

    make_bench().run(body)


def test_mcu_reset_is_noticed(make_bench):
    def body(it):
        it.machine.mcus["mcu"].reset()
        it.pause(3.)
        assert it.state == "shutdown"
        assert "MCU 'mcu' spontaneous restart" in it.message

    make_bench().run(body)


def test_absent_mcu_is_an_error_that_names_it(make_bench):
    def body(it):
        assert it.state == "error"
        assert "mcu 'mcu'" in it.message and "Check the cable" in it.message

    it = make_bench()
    it.machine.mcus["mcu"].link.cut()
    it.run(body)


def test_corrupted_bytes_do_not_matter(make_bench):
    def body(it):
        assert it.state == "ready", it.message
        for _ in range(500):
            assert it.objects.endstop.query_endstop(it.print_time()) == 0
        assert it.mcu._serial.stats()["bytes_retransmit"] > 0
        assert it.state == "ready", it.message

    it = make_bench()
    mcu = it.machine.mcus["mcu"]
    mcu.set_input(8, 0)
    mcu.link.set_faults(flip=0.001, drop=0.0005, insert=0.0005)
    it.run(body, make_endstop)


def test_missing_command_names_command_and_mcu(make_bench):
    def make(config, objects):
        mcu = config.get_printer().lookup_object("mcu")
        mcu.register_config_callback(
            lambda: mcu.lookup_command("config_teapot oid=%c pin=%u"))

    def body(it):
        assert it.state == "error"
        assert "the firmware of mcu 'mcu' lacks the command" in it.message
        assert "'config_teapot'" in it.message
        assert "flash" in it.message

    make_bench().run(body, make)


def test_unknown_pin_is_a_config_error(make_bench):
    def body(it):
        assert it.state == "error"
        assert "Pin 'PX99' is not a valid pin name on mcu 'mcu'" in it.message
        assert isinstance(it.printer.load_errors[0], ConfigError)

    make_bench().run(
        body, lambda config, objects: setup_pin(config, "endstop", "PX99"))


def test_two_mcus_agree_on_time(make_bench):
    config = bench.MAIN_CONFIG + "[mcu other]\nserial: /dev/none2\n"

    def body(it):
        assert it.state == "ready", it.message
        other = it.printer.lookup_object("mcu other")
        worst = 0.
        for second in range(90):
            now = it.pause(1.)
            print_time = it.print_time(0.5)
            other.calibrate_clock(print_time, now)
            times = [it.machine.mcus[mcu.get_name()].time_at(
                         mcu.print_time_to_clock(print_time))
                     for mcu in (it.mcu, other)]
            if second > 30:
                worst = max(worst, abs(times[0] - times[1]))
        assert worst < 20e-6

    it = make_bench(config, machine=bench.Machine({"mcu": 200., "other": -200.}))
    it.run(body)
    assert it.machine.configured == ["mcu", "other"]


def test_same_seed_same_bytes(tmp_path, monkeypatch):
    def body(it):
        it.pause(5.)

    def record():
        it = bench.Bench(tmp_path, monkeypatch)
        link = it.machine.mcus["mcu"].link
        link.record(True)
        it.run(body, make_endstop)
        return link.take()

    first = record()
    assert len(first) > 50 and first == record()
