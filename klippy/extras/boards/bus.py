# SPDX-License-Identifier: GPL-3.0-or-later
"""Devices on SPI and I2C buses of the mcus, for whoever drives a chip.

Options of a section: spi_speed, spi_bus, spi_software_{sclk,mosi,miso}_pin with
a chip select; i2c_mcu, i2c_speed, i2c_address, i2c_bus, i2c_software_{scl,sda}_pin.
Make these objects while the config is read; talk to the device from klippy:connect
on.  What waits for an answer must not be called in a callback of the response thread.
"""
import logging

from klippy import mcu as mcu_module
from klippy import pins
from klippy.errors import CommandError
from klippy.extras import older_bus
from klippy.mcu import absence
from klippy.msgproto import MissingError

SPI_TRANSFER = "spi_transfer oid=%c data=%*s"
SPI_RESPONSE = "spi_transfer_response oid=%c response=%*s"
I2C_TRANSFER = "i2c_transfer oid=%c write=%*s read_len=%u"
I2C_RESPONSE = "i2c_response oid=%c i2c_bus_status=%c response=%*s"
I2C_OK = ("SUCCESS", 0)
I2C_ERRORS = {
    "NACK": "does not take what it is sent", "START_NACK": "does not answer",
    "START_READ_NACK": "does not answer to a read", "BUS_TIMEOUT": "holds the bus"}


def resolve_bus_name(mcu, param, bus):
    """Name of a bus of the mcu, its pins reserved; None stands for the first.

    param: name of the enumeration, spi_bus or i2c_bus.  Raises ConfigError, or
    MissingError if the firmware has no such buses.
    """
    buses = mcu.get_enumerations().get(param)
    if buses is None:
        raise MissingError("there are no names of a %s" % (param,), "enumeration",
                           param)
    numbers = {value: name for name, value in buses.items()}
    if bus is None:
        if 0 not in numbers:
            raise pins.error("Option '%s' is needed: mcu '%s' has %s" % (
                param, mcu.get_name(), ", ".join(buses) or "no such bus"))
        bus = numbers[0]
    if bus not in buses:
        import difflib
        near = difflib.get_close_matches(bus, buses, 3, 0.4) or list(buses)
        raise pins.error("Unknown %s '%s' of mcu '%s': it has %s" % (
            param, bus, mcu.get_name(), ", ".join(near) or "none"))
    resolver = pins.get(mcu.get_printer()).get_pin_resolver(mcu.get_name())
    for pin in str(mcu.get_constants().get("BUS_PINS_" + bus, "")).split(","):
        if pin:
            resolver.reserve_pin(pin, bus)
    return bus


class MCU_SPI:
    """A device with or without a chip select on a bus, or on three pins."""

    def __init__(self, mcu, bus, pin, mode, speed, sw_pins=None,
                 cs_active_high=False):
        """pin: name of the chip select or None; sw_pins: (miso, mosi, sclk)."""
        self.mcu, self.bus, self.sw_pins = mcu, bus, sw_pins
        self.mode, self.speed = mode, speed
        self.oid = mcu.create_oid()
        self.part = absence.find_part(mcu)
        if pin is None:
            mcu.add_config_cmd("config_spi_without_cs oid=%d" % (self.oid,))
        else:
            mcu.add_config_cmd("config_spi oid=%d pin=%s cs_active_high=%d"
                               % (self.oid, pin, cs_active_high))
        self.cmd_queue = mcu.alloc_command_queue()
        self.send_cmd = self.transfer_cmd = None
        self.part.register_config_callback(self._build_config)

    def _build_config(self):
        mcu = self.mcu
        if self.sw_pins is not None:
            self._add_sw_bus()
        else:
            bus = resolve_bus_name(mcu, "spi_bus", self.bus)
            mcu.add_config_cmd("spi_set_bus oid=%d spi_bus=%s mode=%d rate=%d"
                               % (self.oid, bus, self.mode, self.speed))
        self.send_cmd = mcu.lookup_command("spi_send oid=%c data=%*s",
                                           cq=self.cmd_queue)
        self.transfer_cmd = mcu.lookup_query_command(
            SPI_TRANSFER, SPI_RESPONSE, oid=self.oid, cq=self.cmd_queue)

    def _add_sw_bus(self):
        mcu = self.mcu
        if older_bus.add_spi_sw(mcu, self.oid, self.sw_pins, self.mode, self.speed):
            return
        # half a clock period
        pulse_ticks = mcu.seconds_to_clock(0.5 / self.speed)
        mcu.add_config_cmd(
            "spi_set_sw_bus oid=%d miso_pin=%s mosi_pin=%s sclk_pin=%s mode=%d"
            " pulse_ticks=%d" % (self.oid, *self.sw_pins, self.mode, pulse_ticks))

    def setup_shutdown_msg(self, shutdown_seq):
        """Bytes that the mcu sends to the device when it shuts down."""
        self.mcu.add_config_cmd(
            "config_spi_shutdown oid=%d spi_oid=%d shutdown_msg=%s"
            % (self.mcu.create_oid(), self.oid, bytes(shutdown_seq).hex()))

    def get_oid(self):
        return self.oid

    def get_mcu(self):
        return self.mcu

    def get_command_queue(self):
        return self.cmd_queue

    def spi_send(self, data, minclock=0, reqclock=0):
        """Send bytes; does not wait.  An mcu that is absent gets none."""
        if absence.is_absent(self.part):
            return
        if self.send_cmd is None:
            # before the mcu is configured: part of its start
            self.mcu.add_config_cmd("spi_send oid=%d data=%s"
                                    % (self.oid, bytes(data).hex()), is_init=True)
            return
        self.send_cmd.send([self.oid, bytes(data)], minclock=minclock,
                           reqclock=reqclock)

    def spi_transfer(self, data, minclock=0, reqclock=0):
        """Exchange bytes and wait; {"response": bytes}."""
        absence.raise_if_absent(self.part)
        if self.mcu.is_fileoutput():
            self.spi_send(data, minclock, reqclock)
            return {"response": bytes(len(data))}
        return self.transfer_cmd.send([self.oid, bytes(data)], minclock=minclock,
                                      reqclock=reqclock)

    def spi_transfer_with_preface(self, preface_data, data, minclock=0, reqclock=0):
        """Send preface_data directly ahead of an exchange."""
        absence.raise_if_absent(self.part)
        if self.mcu.is_fileoutput():
            self.spi_send(preface_data, minclock, reqclock)
            return self.spi_transfer(data, minclock, reqclock)
        return self.transfer_cmd.send_with_preface(
            self.send_cmd, [self.oid, bytes(preface_data)], [self.oid, bytes(data)],
            minclock=minclock, reqclock=reqclock)


def MCU_SPI_from_config(config, mode, pin_option="cs_pin", default_speed=100000,
                        share_type=None, cs_active_high=False):
    """The MCU_SPI of a section.  A chip select named None is none."""
    ppins = config.get_printer().lookup_object("pins")
    cs_params = ppins.lookup_pin(config.get(pin_option), share_type=share_type)
    cs_pin = cs_params["pin"]
    if cs_pin == "None":
        ppins.reset_pin_sharing(cs_params)
        cs_pin = None
    mcu = cs_params["chip"]
    speed = config.getint("spi_speed", default_speed, minval=100000)
    bus = sw_pins = None
    if config.get("spi_software_sclk_pin", None) is not None:
        names = ["spi_software_%s_pin" % (n,) for n in ("miso", "mosi", "sclk")]
        sw_pins = _lookup_same_mcu(config, names, mcu)
    else:
        bus = config.get("spi_bus", None)
    return MCU_SPI(mcu, bus, cs_pin, mode, speed, sw_pins, cs_active_high)


def _lookup_same_mcu(config, options, mcu):
    """Names of pins that devices of one bus share, all of one mcu."""
    ppins = config.get_printer().lookup_object("pins")
    found = [ppins.lookup_pin(config.get(option), share_type=option)
             for option in options]
    for option, params in zip(options, found, strict=True):
        if params["chip"] is not mcu:
            raise config.error(
                "Option '%s' in section '%s': the pin must be of mcu '%s' like the"
                " rest of the bus, not of '%s'" % (
                    option, config.get_name(), mcu.get_name(), params["chip_name"]))
    return tuple(params["pin"] for params in found)


class MCU_I2C:
    """A device at an address of a bus, or of two pins."""

    def __init__(self, mcu, bus, addr, speed, sw_pins=None):
        """addr: 7 bits; sw_pins: (scl, sda)."""
        self.mcu, self.bus, self.sw_pins = mcu, bus, sw_pins
        self.i2c_address, self.speed = addr, speed
        self.oid = mcu.create_oid()
        self.part = absence.find_part(mcu)
        mcu.add_config_cmd("config_i2c oid=%d" % (self.oid,))
        self.cmd_queue = mcu.alloc_command_queue()
        self.transfer_cmd = self.query_cmd = None
        self.is_failing = False
        self.part.register_config_callback(self._build_config)

    def _build_config(self):
        mcu = self.mcu
        if self.sw_pins is not None:
            self._add_sw_bus()
        else:
            bus = resolve_bus_name(mcu, "i2c_bus", self.bus)
            mcu.add_config_cmd("i2c_set_bus oid=%d i2c_bus=%s rate=%d address=%d"
                               % (self.oid, bus, self.speed, self.i2c_address))
        if older_bus.has(mcu, older_bus.I2C_WRITE):
            self.transfer_cmd = older_bus.OlderTransfer(mcu, self.oid, self.cmd_queue)
            self.query_cmd = self.transfer_cmd.query
            return
        self.transfer_cmd = mcu.lookup_command(I2C_TRANSFER, cq=self.cmd_queue)
        self.query_cmd = mcu.lookup_query_command(
            I2C_TRANSFER, I2C_RESPONSE, oid=self.oid, cq=self.cmd_queue)
        mcu.register_serial_response(self._note_result, I2C_RESPONSE, self.oid)

    def _add_sw_bus(self):
        mcu, pins_used = self.mcu, self.sw_pins
        if older_bus.add_i2c_sw(mcu, self.oid, pins_used, self.speed, self.i2c_address):
            return
        pulse_ticks = mcu.seconds_to_clock(0.5 / self.speed)
        mcu.add_config_cmd(
            "i2c_set_sw_bus oid=%d scl_pin=%s sda_pin=%s pulse_ticks=%d address=%d"
            % (self.oid, *pins_used, pulse_ticks, self.i2c_address))

    def _note_result(self, params):
        """An answer nobody waits for; tells the log when errors begin."""
        was_failing, self.is_failing = self.is_failing, self._is_bad(params)
        if self.is_failing and not was_failing:
            logging.warning("%s", self._explain(params))

    @staticmethod
    def _is_bad(params):
        return params["i2c_bus_status"] not in I2C_OK

    def _explain(self, params):
        status = params["i2c_bus_status"]
        return "I2C device 0x%02x of mcu '%s' %s (%s): check its wiring and address" % (
            self.i2c_address, self.mcu.get_name(),
            I2C_ERRORS.get(status, "failed"), status)

    def get_oid(self):
        return self.oid

    def get_mcu(self):
        return self.mcu

    def get_i2c_address(self):
        return self.i2c_address

    def get_command_queue(self):
        return self.cmd_queue

    def i2c_write_noack(self, data, minclock=0, reqclock=0):
        """Write bytes; does not wait.  The log tells if nobody takes them."""
        if absence.is_absent(self.part):
            return
        self.transfer_cmd.send([self.oid, bytes(data), 0], minclock=minclock,
                               reqclock=reqclock)

    def i2c_write(self, data, minclock=0, reqclock=0):
        """Write bytes and wait.  Raises CommandError if the device does not answer."""
        self._transfer(data, 0, minclock, reqclock, retry=True)

    i2c_write_wait_ack = i2c_write

    def i2c_read(self, write, read_len, retry=True):
        """Write, then read; {"response": bytes}.  Raises as i2c_write()."""
        return self._transfer(write, read_len, 0, 0, retry)

    def _transfer(self, data, read_len, minclock, reqclock, retry):
        absence.raise_if_absent(self.part)
        if self.mcu.is_fileoutput():
            self.i2c_write_noack(data, minclock, reqclock)
            return {"response": bytes(read_len)}
        params = self.query_cmd.send(
            [self.oid, bytes(data), read_len], minclock=minclock, reqclock=reqclock,
            retry=retry)
        if self._is_bad(params):
            raise CommandError(self._explain(params))
        return params


def MCU_I2C_from_config(config, default_addr=None, default_speed=100000):
    """The MCU_I2C of a section."""
    printer = config.get_printer()
    mcu = mcu_module.get_printer_mcu(printer, config.get("i2c_mcu", "mcu"))
    speed = config.getint("i2c_speed", default_speed, minval=100000)
    if default_addr is None:
        addr = config.getint("i2c_address", minval=0, maxval=127)
    else:
        addr = config.getint("i2c_address", default_addr, minval=0, maxval=127)
    bus = sw_pins = None
    if config.get("i2c_software_scl_pin", None) is not None:
        names = ["i2c_software_%s_pin" % (n,) for n in ("scl", "sda")]
        sw_pins = _lookup_same_mcu(config, names, mcu)
    else:
        bus = config.get("i2c_bus", None)
    return MCU_I2C(mcu, bus, addr, speed, sw_pins)
