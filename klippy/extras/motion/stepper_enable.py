# SPDX-License-Identifier: GPL-3.0-or-later
"""Enable lines of the stepper drivers: on when a motor moves, off by M18."""

from klippy import pins

# s of rest before and after a motor is switched
SWITCH_REST = 0.100


class EnableLine:
    """The enable input of one driver or of several; without pin always on.

    is_dedicated: no other driver hangs on it.
    """

    def __init__(self, pin=None):
        self.pin = pin
        self.is_dedicated = pin is not None
        self.users = 0

    def switch(self, print_time, is_on):
        """One driver needs the line from print_time on, or no longer does."""
        before = self.users
        self.users += 1 if is_on else -1
        if self.pin is not None and bool(before) != bool(self.users):
            self.pin.set_digital(print_time, is_on)


class EnableTracking:
    """Whether one motor is on, and who wants to be told."""

    def __init__(self, stepper, line):
        self.stepper, self.line = stepper, line
        self.callbacks = []
        self.is_enabled = self.is_awaiting = False
        self._await_motion()

    def _await_motion(self):
        """Switch on by itself when the stepper is about to move."""
        if not self.is_awaiting:
            self.is_awaiting = True
            self.stepper.add_active_callback(self._handle_motion)

    def _handle_motion(self, print_time):
        self.is_awaiting = False
        self.motor_enable(print_time)

    def register_state_callback(self, callback):
        """Call callback(print_time, is_enabled) just ahead of each change."""
        self.callbacks.append(callback)

    def motor_enable(self, print_time):
        """Switch the motor on at print_time."""
        self._switch(print_time, True)

    def motor_disable(self, print_time):
        """Switch the motor off at print_time, until it moves again."""
        self._switch(print_time, False)

    def _switch(self, print_time, is_on):
        if is_on == self.is_enabled:
            return
        for callback in self.callbacks:
            callback(print_time, is_on)
        self.line.switch(print_time, is_on)
        self.is_enabled = is_on
        if not is_on:
            self._await_motion()

    def is_motor_enabled(self):
        """True from the command that switches the motor on."""
        return self.is_enabled

    def has_dedicated_enable(self):
        """True if the motor can be switched without another one."""
        return self.line.is_dedicated


class PrinterStepperEnable:
    """Object stepper_enable: all motors by the name of their section."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.lines = {}             # (chip, pin) -> EnableLine
        self.enables = {}           # stepper name -> EnableTracking
        self.printer.register_event_handler("gcode:request_restart",
                                            self._handle_restart)
        gcode = self.printer.lookup_object("gcode")
        for name in ("M18", "M84"):
            gcode.register_command(name, self.cmd_M18)

    def register_stepper(self, config, mcu_stepper):
        """Keep track of a stepper, whose section may have an enable_pin."""
        name = mcu_stepper.get_name()
        line = self._find_line(config.get("enable_pin", None))
        self.enables[name] = EnableTracking(mcu_stepper, line)
        self.printer.lookup_object("gcode").register_mux_command(
            "SET_STEPPER_ENABLE", "STEPPER", name, self.cmd_SET_STEPPER_ENABLE,
            desc=self.cmd_SET_STEPPER_ENABLE_help)
        if len(self.enables) == 1:
            self.printer.lookup_object("gcode").register_mux_command(
                "SET_STEPPER_ENABLE", "STEPPER", None, self.cmd_SET_STEPPER_ENABLE)

    def _find_line(self, pin_desc):
        if pin_desc is None:
            return EnableLine()
        params = pins.get(self.printer).lookup_pin(
            pin_desc, can_invert=True, share_type="stepper_enable")
        place = params["chip_name"], params["pin"]
        if place in self.lines:
            self.lines[place].is_dedicated = False
        else:
            pin = params["chip"].setup_pin("digital_out", params)
            pin.setup_max_duration(0.)
            self.lines[place] = EnableLine(pin)
        return self.lines[place]

    # Look-up

    def get_steppers(self):
        """Names of all steppers."""
        return list(self.enables)

    def lookup_enable(self, name):
        """The EnableTracking of a stepper.  Raises ConfigError if unknown."""
        if name not in self.enables:
            raise self.printer.config_error(
                "There is no stepper '%s', only %s"
                % (name, ", ".join(self.enables) or "none"))
        return self.enables[name]

    def get_status(self, eventtime):
        """steppers: {name: is it on}."""
        return {"steppers": {name: enable.is_motor_enabled()
                             for name, enable in self.enables.items()}}

    # Switching

    def set_motors_enable(self, stepper_names, enable):
        """Switch motors at the end of all motion; returns if any changed."""
        enables = [self.lookup_enable(name) for name in stepper_names]
        if all(e.is_motor_enabled() == enable for e in enables):
            return False
        toolhead = self.printer.lookup_object("toolhead")
        toolhead.dwell(SWITCH_REST)
        # all steps made: what is planned must not switch motors on again
        toolhead.flush_step_generation()
        print_time = toolhead.get_last_move_time()
        for tracking in enables:
            if enable:
                tracking.motor_enable(print_time)
            else:
                tracking.motor_disable(print_time)
        toolhead.dwell(SWITCH_REST)
        return True

    def motor_off(self):
        """Switch all motors off at the end of all motion."""
        self.set_motors_enable(self.get_steppers(), False)
        toolhead = self.printer.lookup_object("toolhead")
        self.printer.send_event("stepper_enable:motor_off",
                                toolhead.get_last_move_time())

    def _handle_restart(self, print_time):
        self.motor_off()

    def cmd_M18(self, gcmd):
        """Switch all motors off."""
        self.motor_off()

    cmd_SET_STEPPER_ENABLE_help = "Enable or disable one stepper"

    def cmd_SET_STEPPER_ENABLE(self, gcmd):
        """Switch motor STEPPER, or all without it, on (ENABLE=1) or off (0)."""
        name, is_on = gcmd.get("STEPPER", None), bool(gcmd.get_int("ENABLE", 1))
        if name is None and not is_on:
            self.motor_off()
            return
        self.set_motors_enable(self.get_steppers() if name is None else [name], is_on)


def load_config(config):
    return PrinterStepperEnable(config)
