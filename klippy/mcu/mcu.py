# SPDX-License-Identifier: GPL-3.0-or-later
"""One micro-controller: its life from connect to shutdown, and what others use.

Order of events: identify (link, dictionary, clock), connect (configuration),
ready.  Everybody else creates objects before and sends commands after that.
See docs/internals/mcu.md.
"""

import logging

from klippy import clocksync, dangers, msgproto, pins, serialhdl
from klippy.errors import ConfigError, McuError
from klippy.mcu import absence
from klippy.mcu.adc import MCU_adc
from klippy.mcu.configphase import ConfigPhase
from klippy.mcu.connection import Connection
from klippy.mcu.digital_out import MCU_digital_out
from klippy.mcu.endstop import MCU_endstop
from klippy.mcu.faults import FaultWatch
from klippy.mcu.lookup import FirmwareLookup
from klippy.mcu.part import LackError, Parts, find_user
from klippy.mcu.pwm import MCU_pwm
from klippy.mcu.restart import METHODS, McuRestart, list_behind
from klippy.mcu.stats import McuStats

# Start argument: names of mcus that a firmware restart did not reach
NOT_RESTARTED = "not_restarted"
# ... and how often each was restarted once more for being shut down still
RESTART_TRIES = "restart_tries"
MAX_TRIES = 1
# Leaves the compression of steps a window of 6 us
MAX_STEP_LATENCY = 0.000044
MAX_STEPPER_ERROR = 0.000025
MIN_SCHEDULE_TIME = 0.100
# What is less ahead may not reach the mcu in time
LATE_MARGIN = 0.040
# Two changes of one output lie so far apart at least
OUTPUT_GAP = 0.020
MAX_NOMINAL_DURATION = 3.
MAX_TICKS = 0x7fffffff
FILE_MOVE_COUNT = 500
RESTART_WAIT = 2.
QUERY_SLOT_TIME = 0.010
PIN_CLASSES = {"endstop": MCU_endstop, "digital_out": MCU_digital_out,
               "pwm": MCU_pwm, "adc": MCU_adc}


class MCU(FirmwareLookup):
    """A micro-controller of the printer."""

    error = McuError
    config_error = ConfigError

    def __init__(self, config, clock_sync):
        self._printer = printer = config.get_printer()
        self._reactor = printer.get_reactor()
        self._name = config.get_name().split()[-1]
        self._connection = Connection(config, self._name)
        method = None
        if self._connection.baud:
            method = config.getchoice("restart_method", METHODS, None)
        elif self._connection.canbus_uuid is not None:
            method = "command"
        self.is_non_critical = config.getboolean("is_non_critical", False)
        self.non_critical_disconnected = False
        self._max_stepper_error = config.getfloat(
            "max_stepper_error", MAX_STEPPER_ERROR, minval=0.)
        self._clocksync = clock_sync
        self._dangers = dangers.get(printer)
        self._serial = serialhdl.SerialReader(self._reactor, self._name)
        self._serial.log_warnings = self._dangers.log_serial_reader_warnings
        self._restart = McuRestart(self, method, self._connection)
        self._faults = FaultWatch(self)
        self._stats = McuStats(self)
        self._config = ConfigPhase(self._name, printer)
        self._parts = Parts(self)
        self._absence = absence.Absence(self, config) if self.is_non_critical else None
        self._post_init_callbacks = []
        self._movequeue_callbacks = []
        self.late_outputs = 0
        self._mcu_freq = 0.
        self._is_configured = self._has_restarted = False
        self._emergency_stop_cmd = self._clear_shutdown_cmd = None
        self._get_status_info = {}
        pins.get(printer).register_chip(self._name, self)
        for event, handler in (
                ("klippy:mcu_identify", self._handle_identify),
                ("klippy:connect", self._handle_connect),
                ("klippy:ready", self._handle_ready),
                ("klippy:shutdown", self._handle_shutdown),
                ("klippy:analyze_shutdown", self._handle_analyze),
                ("klippy:disconnect", self.disconnect),
                ("klippy:firmware_restart", self._handle_firmware_restart)):
            printer.register_event_handler(event, handler)

    # Who it is

    def get_printer(self):
        """The printer this mcu belongs to."""
        return self._printer

    def get_name(self):
        """Name of the mcu, 'mcu' for the main one."""
        return self._name

    def get_serial(self):
        """The SerialReader of the mcu."""
        return self._serial

    def get_clocksync(self):
        """The ClockSync of the mcu."""
        return self._clocksync

    def is_fileoutput(self):
        """True if commands go to a file and nobody answers."""
        return self._connection.is_fileoutput()

    def is_on_canbus(self):
        """True if it is a node of a CAN bus."""
        return self._connection.canbus_uuid is not None

    def is_bridge(self):
        """True if it is a CAN adapter for others."""
        return bool(self.get_constants().get("CANBUS_BRIDGE"))

    def is_shutdown(self):
        """True once the mcu has reported a shutdown."""
        return self._faults.is_shutdown

    def get_shutdown_clock(self):
        """Clock of the reported shutdown, 0 if there was none."""
        return self._faults.shutdown_clock

    def is_link_active(self):
        """True while there is a link and the mcu answers on it."""
        return (self._serial.get_serialqueue() is not None
                and self._clocksync.is_active())

    # Identify

    def _handle_identify(self):
        """Connect, read the dictionary, start the clock."""
        if self._absence is not None and not self.is_fileoutput():
            self._absence.start()
            return
        self.identify()

    def identify(self):
        """Connect, read the dictionary, start the clock.  Raises McuError."""
        try:
            self._connection.open(
                self._serial, rts=self._restart.method != "cheetah")
            if self._absence is not None:
                self._absence.note_open()
            if self.is_fileoutput():
                self._clocksync.connect_file(self._serial)
            else:
                self._clocksync.connect(self._serial)
            self._note_identified()
        except msgproto.error as err:
            self._note_error("protocol", err)
            raise
        except McuError as err:
            self._note_error("connect", err)
            raise

    def _note_identified(self):
        parser = self._serial.get_msgparser()
        machine = self._connection.get_machine()
        if machine is not None:
            parser.fill_enumerations({"pin": machine.get_pin_map(self._name)})
        version, build_versions = parser.get_version_info()
        self._faults.reset()
        if self._dangers.log_startup_info:
            constants = sorted(self.get_constants().items())
            logging.info(
                "mcu '%s' firmware %s (%s), constants: %s", self._name, version,
                build_versions, " ".join("%s=%s" % item for item in constants))
        self._get_status_info = {
            "mcu_version": version, "mcu_build_versions": build_versions,
            "mcu_constants": self.get_constants()}
        if not self._mcu_freq:
            self._mcu_freq = self.get_constant_float("CLOCK_FREQ")
            self._reserve_pins()
        self._restart.lookup_commands()
        self._emergency_stop_cmd = self.lookup_command("emergency_stop")
        self._clear_shutdown_cmd = self.try_lookup_command("clear_shutdown")
        self._stats.register(self._serial)
        self._faults.register(self._serial)
        self._clocksync.set_lost_callback(self._faults.note_lost)

    def _reserve_pins(self):
        """Keep the pins that the firmware itself uses."""
        resolver = pins.get(self._printer).get_pin_resolver(self._name)
        for name, value in self.get_constants().items():
            if name.startswith("RESERVE_PINS_"):
                for pin in value.split(","):
                    resolver.reserve_pin(pin, name[len("RESERVE_PINS_"):])

    # Connect: the configuration

    def _handle_connect(self):
        if self._absence is not None and not self.is_fileoutput():
            self._absence.configure()
            return
        self.configure()

    def configure(self):
        """Configure the mcu, restarting it first if it must be.  Raises McuError."""
        config_params = self._query_config()
        try:
            if not config_params["is_config"]:
                if self._restart.uses_usb_power and not self.is_non_critical:
                    self._demand_restart("full reset before config")
                self._send_config(False)
                config_params = self._query_config()
                if not config_params["is_config"] and not self.is_fileoutput():
                    raise McuError("Unable to configure MCU '%s'%s"
                                   % (self._name, self._faults.get_hint()))
            else:
                if self._was_restarted():
                    raise McuError("Failed automated reset of MCU '%s'"
                                   % (self._name,))
                self._send_config(True, config_params["crc"])
        except (msgproto.error, LackError) as err:
            self._note_error("lack" if isinstance(err, LackError) else "protocol", err)
            raise
        self._is_configured = True
        self._printer.get_start_args().get(RESTART_TRIES, {}).pop(self._name, None)
        machine = self._connection.get_machine()
        if machine is not None:
            machine.note_configured(self._name, self._config.config_cmds)
        self._start_move_queue(config_params["move_count"])
        for callback, part in self._post_init_callbacks:
            if part is None or part.lack is None:
                callback()

    def _query_config(self):
        if self.is_fileoutput():
            return {"is_config": 0, "move_count": FILE_MOVE_COUNT, "crc": 0}
        query = self.lookup_query_command(
            "get_config",
            "config is_config=%c crc=%u is_shutdown=%c move_count=%hu")
        params = query.send()
        if self._faults.is_shutdown:
            raise McuError("MCU '%s' error during config: %s"
                           % (self._name, self._faults.shutdown_msg))
        if params["is_shutdown"]:
            self._demand_restart("it is shut down from before", MAX_TRIES)
            raise McuError("Can not update MCU '%s' config as it is shutdown"
                           % (self._name,))
        return params

    def _send_config(self, is_configured, crc=None):
        """Send the configuration, or only its start if the mcu has it."""
        resolver = pins.get(self._printer).get_pin_resolver(self._name)
        parser = self._serial.get_msgparser()
        self._parts.reset()
        self._config.build(parser, resolver)
        self._parts.tell()
        if is_configured and crc != self._config.crc:
            self._demand_restart("its configuration differs")
            raise McuError("MCU '%s' CRC does not match config" % (self._name,))
        logging.info("mcu '%s': %s configuration (crc %d)", self._name,
                     "keeping" if is_configured else "sending", self._config.crc)
        for cmd in self._config.encode(parser, is_configured):
            self._serial.raw_send(cmd)

    def _was_restarted(self):
        """True if the mcu was reset for the start of this printer."""
        if self.is_non_critical:
            return False
        args = self._printer.get_start_args()
        return (args.get("start_reason") == "firmware_restart"
                and self._name not in args.get(NOT_RESTARTED, ()))

    def _demand_restart(self, reason, max_tries=0):
        """Have the host restart all firmware, unless that was just done.

        max_tries: so often once more, though it was said to be done.  An mcu that may
        be absent is restarted alone, and connected anew.
        """
        if self._absence is not None:
            self._absence.restart(self._restart, reason)
        tries = self._printer.get_start_args().setdefault(RESTART_TRIES, {})
        if self._was_restarted():
            if tries.get(self._name, 0) >= max_tries:
                return
            tries[self._name] = tries.get(self._name, 0) + 1
        self._printer.get_start_args().get(NOT_RESTARTED, set()).discard(self._name)
        logging.info("mcu '%s': attempting a restart: %s", self._name, reason)
        self._printer.request_exit("firmware_restart")
        self._reactor.pause(self._reactor.monotonic() + RESTART_WAIT)
        raise McuError("Attempt to restart MCU '%s' failed" % (self._name,))

    def _start_move_queue(self, move_count):
        reserved = self._config.move_slots
        free = move_count - reserved
        if free < 1:
            raise McuError(
                "Too few moves available on MCU '%s': it has room for %d, and %d are"
                " reserved for outputs" % (self._name, move_count, reserved))
        logging.info("mcu '%s': configured, %d moves", self._name, move_count)
        for callback in self._movequeue_callbacks:
            callback(self._serial.get_serialqueue(), free)

    def _handle_ready(self):
        """Tell of what the firmware lacks, and if it is of another build."""
        self._parts.say()
        version = self._get_status_info.get("mcu_version", "")
        host = str(self._printer.get_start_args().get("software_version", ""))
        if version and host and host != "?" and version.split("-")[0] != host.split(
                "-")[0]:
            logging.info("mcu '%s' runs firmware %s, the host is %s", self._name,
                         version, host)

    # Set-up by others

    def setup_pin(self, pin_type, pin_params):
        """Make the object for a pin (see PrinterPins.setup_pin)."""
        if pin_type not in PIN_CLASSES:
            raise pins.error("Pin '%s' of mcu '%s' cannot be a '%s'" % (
                pin_params["pin"], self._name, pin_type))
        return PIN_CLASSES[pin_type](self, pin_params)

    def create_oid(self):
        """Number for a new object of the mcu."""
        return self._config.create_oid()

    def get_part(self):
        """The Part of the section that is being loaded."""
        return self._parts.get()

    def make_part(self, what=None, may_lack=False):
        """A new Part for the section that is being loaded: see klippy/mcu/part.py."""
        return self._parts.make(what, may_lack)

    def _find_part(self):
        """As get_part(); None while no section is being loaded."""
        return None if find_user(self._printer) is None else self._parts.get()

    def register_config_callback(self, callback, part=None):
        """Call callback() when commands are known and config may be added.

        If the firmware lacks what it needs, the Part is left out, or nothing starts.
        """
        self._config.add_callback(callback, part or self._find_part())

    def register_post_init_callback(self, callback):
        """Call callback() when the mcu is configured."""
        self._post_init_callbacks.append((callback, self._find_part()))

    def register_movequeue_callback(self, callback):
        """Call callback(serialqueue, move_count) when the mcu is configured.

        Raises ConfigError if the mcu may be absent: motion cannot wait for it.
        """
        absence.check_present(self, "steppers, nor tools that follow the moves")
        self._movequeue_callbacks.append(callback)

    def add_config_cmd(self, cmd, is_init=False, on_restart=False):
        """Add a command (text) to the configuration."""
        self._config.add(cmd, is_init, on_restart, self._find_part())

    def request_move_queue_slot(self):
        """Keep one entry of the mcu's move queue free for an output."""
        self._config.reserve_move_slot(self._find_part())

    def get_query_slot(self, oid):
        """Clock at which a periodic query of this object should start."""
        eventtime = self._reactor.monotonic()
        second = int(self.estimated_print_time(eventtime) + 1.5)
        return (self.print_time_to_clock(second)
                + self.seconds_to_clock(oid * QUERY_SLOT_TIME))

    def register_serial_response(self, callback, msgformat, oid=None):
        """Call callback(params) for responses; None ends it."""
        name = self._lookup(msgformat).name
        self._serial.register_response(callback, name, oid)

    def register_response(self, callback, name, oid=None):
        """As register_serial_response(), by the name of the response."""
        self._serial.register_response(callback, name, oid)

    # Commands: see also FirmwareLookup

    def alloc_command_queue(self):
        """A command queue of the mcu's link."""
        return self._serial.alloc_command_queue()

    # Time

    def print_time_to_clock(self, print_time):
        """Clock (int ticks) of a print_time (s)."""
        return self._clocksync.print_time_to_clock(print_time)

    def output_clock(self, print_time, last_clock):
        """Clock of a change of an output after that at last_clock.

        Late ones come as soon as possible.

        An output that changes a moment after it should costs nothing; an event in
        the past would shut the mcu down.  stats() counts what was late.
        """
        if not self.is_fileoutput():
            now = self.estimated_print_time(self._reactor.monotonic())
            if print_time < now + LATE_MARGIN:
                self.late_outputs += 1
                print_time = now + MIN_SCHEDULE_TIME
            # it leaves when the last one has happened
            last_clock += self.seconds_to_clock(OUTPUT_GAP)
        return max(self.print_time_to_clock(print_time), last_clock)

    def clock_to_print_time(self, clock):
        """print_time (s) of a clock (ticks)."""
        return self._clocksync.clock_to_print_time(clock)

    def estimated_print_time(self, eventtime):
        """print_time at an eventtime."""
        return self._clocksync.estimated_print_time(eventtime)

    def get_hold(self):
        """s for which print_time stood still so far."""
        return self._clocksync.get_hold()

    def add_hold(self, duration):
        """Have print_time stand still for so many s, for all mcus."""
        self._clocksync.add_hold(duration)

    def clock32_to_clock64(self, clock32):
        """The 64 bit clock for the 32 bits of a message."""
        return self._clocksync.clock32_to_clock64(clock32)

    def seconds_to_clock(self, time):
        """Ticks (int) in a time."""
        return int(time * self._mcu_freq)

    def calibrate_clock(self, print_time, eventtime):
        """Steer the clock; returns (offset in s, ticks a s) from print_time on."""
        return self._clocksync.calibrate_clock(print_time, eventtime)

    def min_schedule_time(self):
        """Time in s by which commands should be ahead."""
        return MIN_SCHEDULE_TIME

    def max_nominal_duration(self):
        """Longest time in s that one command may reach into the future."""
        return MAX_NOMINAL_DURATION

    def get_max_stepper_error(self):
        """Greatest error of step times in s."""
        return self._max_stepper_error

    def get_step_latency(self):
        """How late in s a step may come at the pin: what the firmware tells."""
        ticks = self.get_constants().get("STEP_LATENCY_TICKS", 0)
        return min(ticks / self._mcu_freq, MAX_STEP_LATENCY)

    def check_duration(self, duration, pin):
        """Ticks of a maximum duration.  Raises ConfigError if too long."""
        ticks = self.seconds_to_clock(duration)
        if ticks > MAX_TICKS:
            raise ConfigError(
                "Maximum duration %.3f s of pin '%s' on mcu '%s' is too long: at most"
                " %.3f s" % (duration, pin, self._name, MAX_TICKS / self._mcu_freq))
        return ticks

    # Mcus that may be absent

    def get_non_critical_disconnect_event_name(self):
        """Name of the event that tells of the mcu's loss."""
        return "danger:non_critical_mcu_%s:disconnected" % (self._name,)

    def get_non_critical_reconnect_event_name(self):
        """Name of the event that tells of its return."""
        return "danger:non_critical_mcu_%s:reconnected" % (self._name,)

    def note_absent(self, reason):
        """The mcu is gone; it is allowed to be."""
        self._absence.note_gone(reason)

    def set_absent(self, is_absent):
        """What others see of it, and how it is listened to."""
        self.non_critical_disconnected = is_absent
        self._clocksync.is_absent = is_absent
        self._faults.is_muted = is_absent

    # Restart, shutdown, end

    def send_emergency_stop(self):
        """Tell the mcu to shut down."""
        if self._emergency_stop_cmd is not None:
            self._emergency_stop_cmd.send()

    def _handle_shutdown(self, *args):
        if self._faults.is_shutdown or self.is_fileoutput():
            return
        self.send_emergency_stop()

    def _handle_firmware_restart(self, force=False):
        if self.is_fileoutput() or self._has_restarted:
            return
        self._has_restarted = True
        for mcu in list_behind(self, [m for _, m in
                                      self._printer.lookup_objects("mcu")]):
            mcu._handle_firmware_restart()
        try:
            self.microcontroller_restart()
        except McuError as err:
            # a lost board may be there again when the printer connects anew
            logging.warning("%s; connecting to it anew", err)
            self._printer.get_start_args().setdefault(
                NOT_RESTARTED, set()).add(self._name)

    def microcontroller_restart(self):
        """Restart this mcu.  Raises McuError if that cannot be done."""
        self._restart.run()

    def disconnect(self):
        """Close the link."""
        if self._absence is not None:
            self._absence.end()
        self.close_link()

    def close_link(self):
        """Close the link, perhaps to open it again."""
        self._clocksync.disconnect()
        self._serial.disconnect()

    def _note_error(self, event_type, err):
        # the printer announces the error when its state is set
        err.details = {"mcu": self._name, "reason": str(err), "error": str(err),
                       "event_type": event_type}

    # Reports

    def get_status(self, eventtime=None):
        """mcu_version, mcu_build_versions, mcu_constants, last_stats,
        non_critical_disconnected."""
        return dict(self._get_status_info, last_stats=self._stats.last_stats,
                    non_critical_disconnected=self.non_critical_disconnected)

    def stats(self, eventtime):
        """(is_active, text) for the log."""
        if self._serial.get_serialqueue() is None:
            return False, ""
        text = self._stats.collect(eventtime, self._serial, self._clocksync)
        return False, "%s: %s" % (self._name, text)

    def _handle_analyze(self, message, details):
        """Log what led to a shutdown."""
        if not self._dangers.log_shutdown_info:
            return
        logging.info("mcu '%s': %s", self._name, self._clocksync.dump_debug())
        logging.info("%s", "\n".join(self._serial.dump_debug()))


def get_printer_mcu(printer, name):
    """The mcu of that name.  Raises ConfigError if there is none."""
    if name == "mcu":
        return printer.lookup_object("mcu")
    return printer.lookup_object("mcu " + name)


def get(printer, name="mcu"):
    """The main mcu of a printer, or another one."""
    return get_printer_mcu(printer, name)


def add_printer_objects(config):
    """Create the mcus of all [mcu] sections, the main one first."""
    printer = config.get_printer()
    reactor = printer.get_reactor()
    main_sync = clocksync.ClockSync(reactor)
    printer.add_object("mcu", MCU(config.getsection("mcu"), main_sync))
    for section in config.get_prefix_sections("mcu "):
        sync = clocksync.SecondarySync(reactor, main_sync)
        printer.add_object(section.get_name(), MCU(section, sync))
    printer.load_object(config, "error_mcu")
