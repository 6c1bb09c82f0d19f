# SPDX-License-Identifier: GPL-3.0-or-later
"""What befalls a job of a soak: users, clients, links, boards, sensors, disks.

Each deed is a generator function deed(soak, job) that has started the job and
yields the request that restarts the printer, where one is needed; it goes on after
that.  It ends with the outcome of the job: one of the names below.
"""
import errno
import json
import os
from dataclasses import dataclass

import pytest
from daemon_run import ApiError
from test_disk_full import FullDisk
from test_hostile_clients import ATTACKS, Foe

from klippy.extras import save_variables

COMPLETE, CANCELLED, KILLED = "complete", "cancelled", "killed"
RESTART, FIRMWARE_RESTART = "gcode/restart", "gcode/firmware_restart"
# A command that a shutdown ends says so
SHUTDOWN = ("shuts down", "due to printer shutdown", "shutdown")
SHUTDOWN_LIMIT = 60.        # s from a fault to the shutdown


@dataclass(frozen=True)
class Deed:
    """run: the generator.  patterns: what it explains in the log."""

    run: object
    weight: float
    patterns: tuple = ()

    @property
    def name(self):
        return self.run.__name__


DEEDS = []


def deed(weight, *patterns):
    """Register a deed; weight: how often it is done."""
    def register(func):
        DEEDS.append(Deed(func, weight, patterns))
        return func
    return register


def finish(soak, job):
    """Wait for the end of the job and see that it is the right one."""
    soak.wait_for_job()
    soak.check_end(job)
    return COMPLETE


@deed(10)
def print_quietly(soak, job):
    yield from ()
    return finish(soak, job)


@deed(3)
def pause_and_resume(soak, job):
    for _ in range(soak.draw.randrange(1, 4)):
        soak.pause(soak.draw.uniform(1., 120.))
        if soak.job_state() != "printing":
            break
        soak.script("PAUSE")
        soak.pause(soak.draw.uniform(0., 60.))
        soak.script("RESUME")
    yield from ()
    return finish(soak, job)


@deed(2)
def cancel(soak, job):
    soak.pause(soak.draw.uniform(1., 200.))
    soak.script("CANCEL_PRINT")
    soak.script("TURN_OFF_HEATERS")
    yield from ()
    return CANCELLED


@deed(1)
def end_the_wait(soak, job):
    """M108 while it heats."""
    soak.pause(soak.draw.uniform(5., 40.))
    soak.script("M108")
    yield from ()
    return finish(soak, job)


@deed(2)
def change_live(soak, job):
    """Gains, profiles, fan curve, macros, variables, and SAVE_CONFIG at work."""
    soak.pause(soak.draw.uniform(5., 150.))
    for command in (
            "SET_HEATER_PID HEATER=extruder KP=%.1f" % soak.draw.uniform(18., 26.),
            "PID_PROFILE SAVE=tuned HEATER=extruder",
            "PID_PROFILE LOAD=default HEATER=extruder KEEP_TARGET=1",
            "SET_TEMPERATURE_FAN_CURVE TEMPERATURE_FAN=box POINTS='30:%.2f'"
            % soak.draw.uniform(0., 0.4),
            "SAVE_VARIABLE VARIABLE=n VALUE=%d" % soak.draw.randrange(100),
            "RELOAD_GCODE_MACROS", "SAVE_CONFIG RESTART=0", "NOTE N=1"):
        soak.script(command)
        soak.pause(soak.draw.uniform(0., 5.))
    yield from ()
    return finish(soak, job)


@deed(1)
def save_and_restart(soak, job):
    outcome = finish(soak, job)
    soak.script("PID_PROFILE SAVE=soak%d HEATER=extruder" % soak.draw.randrange(3))
    yield "SAVE_CONFIG"
    return outcome


@deed(2)
def restart_at_rest(soak, job):
    outcome = finish(soak, job)
    yield soak.draw.choice((RESTART, FIRMWARE_RESTART))
    return outcome


@deed(2)
def restart_at_work(soak, job):
    soak.pause(soak.draw.uniform(0., 250.))
    yield soak.draw.choice((RESTART, FIRMWARE_RESTART))
    return KILLED


@deed(2, "M112", "emergency", *SHUTDOWN)
def stop_at_once(soak, job):
    soak.pause(soak.draw.uniform(0., 250.))
    soak.client.send("emergency_stop")
    soak.wait_for_state("shutdown", SHUTDOWN_LIMIT)
    yield FIRMWARE_RESTART
    return KILLED


@deed(2, "Lost communication", "the link is down", "imeout|answer", *SHUTDOWN)
def cut_the_cable(soak, job):
    soak.pause(soak.draw.uniform(0., 250.))
    mcu = soak.draw.choice(list(soak.machine.mcus.values()))
    mcu.link.cut()
    try:
        soak.wait_for_state("shutdown", SHUTDOWN_LIMIT)
        soak.pause(soak.draw.uniform(0., 60.))
    finally:
        mcu.link.restore()
    yield FIRMWARE_RESTART
    return KILLED


@deed(2)
def cut_the_cable_briefly(soak, job):
    """Too short to be lost: nothing may be seen on the part."""
    soak.pause(soak.draw.uniform(10., 200.))
    mcu = soak.draw.choice(list(soak.machine.mcus.values()))
    mcu.link.cut()
    soak.pause(soak.draw.uniform(0.01, 0.4))
    mcu.link.restore()
    yield from ()
    return finish(soak, job)


@deed(2)
def disturb_the_link(soak, job):
    mcu = soak.draw.choice(list(soak.machine.mcus.values()))
    kind = soak.draw.choice(("flip", "drop", "insert", "double"))
    mcu.link.set_faults(**{kind: 10 ** soak.draw.uniform(-6., -4.)})
    try:
        outcome = finish(soak, job)
    finally:
        mcu.link.set_faults()
    yield from ()
    return outcome


@deed(1, "'mcu'|'tool'|Lost communication|config", *SHUTDOWN)
def reset_a_board(soak, job):
    soak.pause(soak.draw.uniform(0., 200.))
    soak.draw.choice(list(soak.machine.mcus.values())).reset()
    soak.wait_for_state("shutdown", SHUTDOWN_LIMIT)
    yield FIRMWARE_RESTART
    return KILLED


@deed(2, "ADC out of range|min_temp|max_temp|extruder|heater_bed", *SHUTDOWN)
def break_a_sensor(soak, job):
    soak.pause(soak.draw.uniform(0., 200.))
    sensors = soak.machine.thermal.inputs
    sensor = soak.draw.choice([s for s in sensors if s.heater is not None])
    sensors.remove(sensor)
    sensor.mcu.set_adc(sensor.pin, soak.draw.choice((0.0, 0.9999)))
    try:
        soak.wait_for_state("shutdown", SHUTDOWN_LIMIT)
    finally:
        sensors.append(sensor)
    soak.pause(5.)
    yield FIRMWARE_RESTART
    return KILLED


@deed(1, "not heating at expected rate|fell too far", "Heater", *SHUTDOWN)
def loosen_a_sensor(soak, job):
    """It hangs in the air: the heater is at work and nothing gets warmer."""
    soak.pause(soak.draw.uniform(0., 100.))
    soak.script("CANCEL_PRINT")
    sensor = next(s for s in soak.machine.thermal.inputs if s.heater is not None
                  and s.heater is soak.find_heater("extruder").model)
    real, sensor.heater = sensor.heater, None
    try:
        soak.script("M104 S250")
        soak.wait_for_state("shutdown", 200.)
    finally:
        sensor.heater = real
    yield FIRMWARE_RESTART
    return KILLED


@deed(2)
def fill_the_disk_of_the_log(soak, job):
    """Lines are lost, nothing else; how many is told later."""
    soak.pause(soak.draw.uniform(0., 100.))

    def refuse(text):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    soak.bglogger.output._write = refuse
    try:
        outcome = finish(soak, job)
    finally:
        soak.flush_log()
        del soak.bglogger.output._write
    assert soak.bglogger.output.n_lost > 0
    yield from ()
    return outcome


@deed(1, "No space left")
def fill_the_disk_of_variables(soak, job):
    soak.pause(soak.draw.uniform(0., 60.))
    patch = pytest.MonkeyPatch()
    kind = soak.draw.choice(("open", "write", "fsync", "replace"))
    FullDisk(kind, 1).install(patch, save_variables)
    try:
        soak.script("SAVE_VARIABLE VARIABLE=lost VALUE=1")
        raise AssertionError("a full disk was not told")
    except ApiError:
        soak.n_refused += 1
    finally:
        patch.undo()
    yield from ()
    return finish(soak, job)


@deed(3, "webhooks|client|request|message|JSON|NO_SUCH|method|object|param|script",
      "Unknown command")
def be_hostile(soak, job):
    """All bad clients at once while it prints."""
    foes = [Foe(soak, attack) for attack in soak.draw.sample(list(ATTACKS), 3)]
    for _ in range(200):
        for foe in foes:
            foe.act()
        soak.pause(0.05)
    for foe in foes:
        foe.sock.close()
    yield from ()
    return finish(soak, job)


@deed(2)
def come_and_go(soak, job):
    """Clients that subscribe to everything, read some of it and vanish."""
    names = soak.client.ask("objects/list")["objects"]
    for _ in range(10):
        foe = Foe(soak, lambda foe: iter(()))
        foe.send(json.dumps({"id": 1, "method": "objects/subscribe", "params": {
            "objects": {name: None for name in names}}}).encode() + b"\x03")
        soak.pause(soak.draw.uniform(0., 2.))
        foe.hears_end()
        foe.sock.close()
    yield from ()
    return finish(soak, job)


@deed(2, "Move out of range", "no filament", "paused|skipped|G-code command",
      "Unknown command", "finite number", "has no profile", "output_pin|PIN")
def say_nonsense(soak, job):
    """Bad commands from the terminal while it prints: told, and it goes on."""
    for text in ("G1 X9999", "NO_SUCH_COMMAND", "G1 Xabc", "SET_PIN PIN=none",
                 "REFUSE", "PID_PROFILE HEATER=extruder LOAD=none"):
        soak.pause(soak.draw.uniform(0., 20.))
        try:
            soak.script(text)
        except ApiError:
            soak.n_refused += 1
    soak.script("G90")
    yield from ()
    return finish(soak, job)


@deed(1, "Option|option|section|cannot start")
def break_the_config(soak, job):
    outcome = finish(soak, job)
    text = soak.config_path.read_text()
    soak.config_path.write_text("[fan]\npin: \n[nonsense]\na: 1\n" + text)
    soak.expected_state = "error"
    yield RESTART
    soak.config_path.write_text(text)
    soak.expected_state = "ready"
    yield RESTART
    return outcome
