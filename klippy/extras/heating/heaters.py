# SPDX-License-Identifier: GPL-3.0-or-later
"""Registry of heaters and sensors, M105 and the waits for temperatures."""
import importlib.util

from klippy.extras.heater import Heater
from klippy.mcu import absence

__all__ = ["Heater", "PrinterHeaters"]

# Modules that bring sensor types, loaded in turn until one has the type wanted.
SENSOR_MODULES = (
    "thermistor", "adc_temperature", "spi_temperature", "bme280", "htu21d",
    "lm75", "sht3x", "aht10", "ds18b20", "temperature_host",
    "temperature_mcu", "temperature_combined", "mpc_block_temperature",
    "mpc_ambient_temperature")
# Sections that define a sensor type of the user's own.
CUSTOM_SENSOR_SECTIONS = ("thermistor", "adc_temperature")
REPORT_INTERVAL = 1.0


def get(printer):
    """The printer's PrinterHeaters."""
    return printer.lookup_object("heaters")


class PrinterHeaters:
    """Status: available_heaters, available_sensors, available_monitors."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.sensor_factories = {}
        self.heaters = {}
        self.gcode_id_to_sensor = {}
        self.available_heaters = []
        self.available_sensors = []
        self.available_monitors = []
        self.has_started = False
        self.sensor_modules = list(SENSOR_MODULES)      # not loaded yet
        self._register()

    def _register(self):
        gcode = self.printer.lookup_object("gcode")
        gcode.register_command(
            "TURN_OFF_HEATERS", self.cmd_TURN_OFF_HEATERS,
            desc=self.cmd_TURN_OFF_HEATERS_help)
        gcode.register_command("M105", self.cmd_M105, when_not_ready=True)
        for name in ("HEATER_INTERRUPT", "M108"):
            gcode.register_command(name, self.cmd_M108, when_not_ready=True,
                                   desc=self.cmd_M108_help)
            gcode.interrupts.register(name, self._end_waits)
        register = self.printer.register_event_handler
        register("klippy:ready", self._handle_ready)
        register("gcode:request_restart", self.turn_off_all_heaters)

    def _handle_ready(self):
        self.has_started = True

    # Sensors

    def add_sensor_factory(self, sensor_type, sensor_factory):
        """Make sensor_factory(config) build sensors of sensor_type."""
        self.sensor_factories[sensor_type] = sensor_factory

    def _load_sensors(self, config, sensor_type):
        while self.sensor_modules and sensor_type not in self.sensor_factories:
            name = self.sensor_modules.pop(0)
            if importlib.util.find_spec("klippy.extras." + name) is not None:
                self.printer.load_object(config, name)

    def _load_custom_sensor(self, config, sensor_type):
        for kind in CUSTOM_SENSOR_SECTIONS:
            section = "%s %s" % (kind, sensor_type)
            if config.has_section(section):
                self.printer.load_object(config, section)

    def setup_sensor(self, config):
        """Sensor object for a section with a sensor_type option."""
        sensor_type = config.get("sensor_type")
        self._load_sensors(config, sensor_type)
        if sensor_type not in self.sensor_factories:
            self._load_custom_sensor(config, sensor_type)
        factory = self.sensor_factories.get(sensor_type)
        if factory is None:
            raise config.error(self._explain_unknown(config, sensor_type))
        return factory(config)

    def _explain_unknown(self, config, sensor_type):
        known = ", ".join("'%s'" % n for n in sorted(self.sensor_factories))
        return ("Unknown temperature sensor '%s' in section '%s'. Known are %s;"
                " your own needs a [thermistor %s] or [adc_temperature %s]"
                " section" % (sensor_type, config.get_name(), known,
                              sensor_type, sensor_type))

    def register_sensor(self, config, psensor, gcode_id=None):
        """Add an object with get_temp() to M105 and TEMPERATURE_WAIT."""
        self.available_sensors.append(config.get_name())
        if gcode_id is None:
            gcode_id = config.get("gcode_id", None)
        self.printer.lookup_object("gcode").register_mux_command(
            "TEMPERATURE_WAIT", "SENSOR", config.get_name(),
            self.cmd_TEMPERATURE_WAIT, desc=self.cmd_TEMPERATURE_WAIT_help)
        if gcode_id is None:
            return
        if gcode_id in self.gcode_id_to_sensor:
            raise self.printer.config_error(
                "G-Code sensor id '%s' of section '%s' is already used"
                % (gcode_id, config.get_name()))
        self.gcode_id_to_sensor[gcode_id] = psensor

    def register_monitor(self, config):
        """List a section among available_monitors."""
        self.available_monitors.append(config.get_name())

    # Heaters

    def setup_heater(self, config, gcode_id=None):
        """Build the heater of a section and register it."""
        name = config.get_name().split()[-1]
        if name in self.heaters:
            raise config.error("Heater '%s' of section '%s' already registered"
                               % (name, config.get_name()))
        heater = Heater(config, self.setup_sensor(config))
        self.heaters[name] = heater
        self.register_sensor(config, heater, gcode_id)
        self.available_heaters.append(config.get_name())
        return heater

    def get_all_heaters(self):
        return self.available_heaters

    def lookup_heater(self, heater_name):
        """Heater by its short name; ConfigError when there is none."""
        heater = self.heaters.get(heater_name)
        if heater is None:
            known = ", ".join("'%s'" % n for n in self.heaters) or "none"
            raise self.printer.config_error(
                "Unknown heater '%s': the heaters of this printer are %s"
                % (heater_name, known))
        return heater

    def turn_off_all_heaters(self, print_time=0.0):
        """Set every target to 0."""
        for heater in self.heaters.values():
            heater.set_temp(0.0)

    def set_temperature(self, heater, temp, wait=False):
        """Set a target in degC and, if wait and not 0, wait for it.

        Returns False if M108 ended the wait.
        """
        toolhead = self.printer.lookup_object("toolhead")
        toolhead.register_lookahead_callback(lambda print_time: None)
        heater.set_temp(temp)
        if wait and temp:
            return self.wait_while(heater.check_busy)
        return True

    def wait_while(self, is_busy):
        """Report temperatures once a second until not is_busy(eventtime).

        Returns False if M108 ended the wait.  Raises CommandInterrupted when
        the commands that wait are ended.
        """
        if self.printer.get_start_args().get("debugoutput") is not None:
            return True
        self.printer.lookup_object("toolhead").get_last_move_time()
        gcode = self.printer.lookup_object("gcode")
        eventtime = self.printer.get_reactor().monotonic()
        with gcode.interrupts.waiting() as wait:
            while not self.printer.is_shutdown() and is_busy(eventtime):
                if wait.is_ended:
                    gcode.respond_info("The wait for a temperature was ended")
                    return False
                gcode.respond_raw(self._format_temperatures(eventtime))
                eventtime = wait.pause(eventtime + REPORT_INTERVAL)
        return True

    def _end_waits(self):
        self.printer.lookup_object("gcode").interrupts.end_waits()

    def _format_temperatures(self, eventtime):
        if not self.has_started or not self.gcode_id_to_sensor:
            return "T:0"
        parts = []
        for gcode_id, sensor in sorted(self.gcode_id_to_sensor.items()):
            current, target = sensor.get_temp(eventtime)
            parts.append("%s:%.1f /%.1f" % (gcode_id, current, target))
        return " ".join(parts)

    def get_status(self, eventtime):
        return {"available_heaters": self.available_heaters,
                "available_sensors": self.available_sensors,
                "available_monitors": self.available_monitors}

    # Commands

    def cmd_M105(self, gcmd):
        message = self._format_temperatures(
            self.printer.get_reactor().monotonic())
        if not gcmd.ack(message):
            gcmd.respond_raw(message)

    cmd_TURN_OFF_HEATERS_help = "Turn off all heaters"

    def cmd_TURN_OFF_HEATERS(self, gcmd):
        self.turn_off_all_heaters()

    cmd_TEMPERATURE_WAIT_help = "Wait for a temperature on a sensor"

    def cmd_TEMPERATURE_WAIT(self, gcmd):
        name = gcmd.get("SENSOR")
        gcmd.get("ALLOW_CANCEL", None)      # any wait can be ended here
        low = gcmd.get_float("MINIMUM", float("-inf"))
        high = gcmd.get_float("MAXIMUM", float("inf"), above=low)
        if low == float("-inf") and high == float("inf"):
            raise gcmd.error(
                "TEMPERATURE_WAIT SENSOR=%s needs MINIMUM or MAXIMUM" % name)
        sensor = self.heaters.get(name)
        if sensor is None:
            sensor = self.printer.lookup_object(name)
        absence.raise_if_lacking(getattr(sensor, "part", None))

        def is_outside(eventtime):
            return not low <= sensor.get_temp(eventtime)[0] <= high

        self.wait_while(is_outside)

    cmd_M108_help = "End the wait for a temperature and go on with the print"

    def cmd_M108(self, gcmd):
        """Nothing more to do: waits end when the command arrives."""


def load_config(config):
    return PrinterHeaters(config)
