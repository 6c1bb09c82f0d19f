# SPDX-License-Identifier: GPL-3.0-or-later
"""A chip with our firmware on USB, behind the kernel's own drivers: gs_usb as a CAN
adapter that is a board, or cdc_acm as a serial port."""

import os
import sys
import time

import relay

from klippy import canlink
from klippy.flash import devices, touch
from klippy.reactor import Reactor
from klippy.serialhdl import SerialReader
from klippy_ext.hostclock import RealClock

TIMEOUT = 120.                  # s of a slow machine
PERIOD = .1
PING = bytes(range(48))


def wait_for(path):
    end = time.monotonic() + TIMEOUT
    while not os.path.exists(path):
        assert time.monotonic() < end, "there is no " + path
        time.sleep(PERIOD)


def talk(connect):
    """Connect, read the dictionary, and ask; connect(serial) opens the link."""
    reactor = Reactor(RealClock())
    serial = SerialReader(reactor, "chip")
    failures = []

    def ask(eventtime):
        try:
            connect(serial)
            relay.ok("identified as " + serial.msgparser.get_constant("MCU"))
            ping = serial.msgparser.create_command(
                "debug_ping data=" + PING.hex())
            for _ in range(20):
                assert serial.query([ping], "pong")["data"] == PING
            relay.ok("answers")
        except Exception as err:        # noqa: BLE001 - for whoever waits
            failures.append(err)
        finally:
            serial.disconnect()
            reactor.end()
        return reactor.NEVER
    reactor.register_timer(ask, reactor.NOW)
    reactor.run()
    reactor.finalize()
    if failures:
        raise failures[0]


def check_can():
    wait_for("/sys/class/net/can0")
    relay.run("ip", "link", "set", "can0", "type", "can", "bitrate", "1000000")
    relay.run("ip", "link", "set", "can0", "up")
    listed = relay.run(sys.executable, "-m", "klippy", "canbus", "query", "can0")
    uuid = listed.split()[1]
    assert len(canlink.parse_uuid(uuid)) == 6
    relay.ok("listed " + uuid)
    talk(lambda serial: serial.connect_canbus(uuid, 9, "can0"))


def check_serial():
    wait_for("/dev/ttyACM0")
    port, = devices.list_serial()
    assert port.path == "/dev/ttyACM0", port
    talk(lambda serial: serial.connect_uart(port.path, 250000))
    # who closes the port at 1200 baud wants the boot loader
    touch.touch(port.path)
    end = time.monotonic() + TIMEOUT
    while os.path.exists(port.path):
        assert time.monotonic() < end, "it has not left"
        time.sleep(PERIOD)
    relay.ok("left")


{"can": check_can, "serial": check_serial}[sys.argv[1]]()
