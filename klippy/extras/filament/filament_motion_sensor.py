# SPDX-License-Identifier: GPL-3.0-or-later
"""[filament_motion_sensor name]: an encoder that filament turns as it moves.

If the extruder pushes detection_length mm and the encoder shows nothing, filament has
run out, is stuck or slips.
"""
from klippy.extras.filament_runout import RunoutHelper

# The printer goes on without it
MAY_LACK_FIRMWARE = True

CHECK_PERIOD = 0.25         # s


class EncoderSensor:
    """Status as RunoutHelper, and detection_length in mm."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        part = printer.load_object(config, "buttons").register_buttons(
            [config.get("switch_pin")], self._handle_edge)
        self.section = config.get_name()
        self.extruder_name = config.get("extruder")
        self.detection_length = config.getfloat("detection_length", 7.0, above=0.0)
        self.extruder = self.mcu = None
        self.timer = self.reactor.register_timer(self._check)
        # Filament position by which an edge must have come
        self.runout_position = 0.0
        self.helper = RunoutHelper(config, has_distance=False)
        self.helper.on_reset = self._note_motion
        self.runout_helper = self.helper
        self.helper.part = part
        self.helper.on_set = self._set_options
        register = printer.register_event_handler
        register("klippy:connect", self._handle_connect)
        register("klippy:ready", self._handle_ready)
        register("idle_timeout:printing", self._handle_printing)
        for event in ("ready", "idle"):
            register("idle_timeout:" + event, self._handle_rest)

    def _handle_connect(self):
        self.extruder = self.printer.lookup_object(self.extruder_name, None)
        if not hasattr(self.extruder, "find_past_position"):
            raise self.printer.config_error(
                "Option 'extruder' in section '%s': there is no extruder '%s'"
                % (self.section, self.extruder_name))
        self.mcu = self.printer.lookup_object("mcu")

    def _handle_ready(self):
        self._note_motion(self.reactor.monotonic())

    def _handle_printing(self, print_time):
        self._set_limit(self.reactor.monotonic())
        self.reactor.update_timer(self.timer, self.reactor.NOW)

    def _handle_rest(self, print_time):
        self.reactor.update_timer(self.timer, self.reactor.NEVER)

    def _find_position(self, eventtime):
        return self.extruder.find_past_position(
            self.mcu.estimated_print_time(eventtime))

    def _set_limit(self, eventtime):
        self.runout_position = self._find_position(eventtime) + self.detection_length

    def _note_motion(self, eventtime):
        self._set_limit(eventtime)
        self.helper.note_filament_present(eventtime, True)

    def _handle_edge(self, eventtime, state):
        if self.extruder is not None:
            self._note_motion(eventtime)

    def _check(self, eventtime):
        is_moving = self._find_position(eventtime) < self.runout_position
        self.helper.note_filament_present(eventtime, is_moving)
        return eventtime + CHECK_PERIOD

    def _set_options(self, gcmd):
        self.detection_length = gcmd.get_float(
            "DETECTION_LENGTH", self.detection_length, above=0.0)
        self._set_limit(self.reactor.monotonic())

    def get_status(self, eventtime):
        return {**self.helper.get_status(eventtime),
                "detection_length": self.detection_length}


def load_config_prefix(config):
    return EncoderSensor(config)
