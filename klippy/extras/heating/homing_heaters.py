# SPDX-License-Identifier: GPL-3.0-or-later
"""[homing_heaters]: heaters are off while the machine homes or probes.

For probes and switches that a heater's current disturbs.
"""


class HomingHeaters:
    """Takes targets away at the start of a homing move and gives them back."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.heater_names = config.getlist("heaters", None)
        self.stepper_names = config.getlist("steppers", None)
        self.targets = []                # (heater, degC)
        register = printer.register_event_handler
        register("klippy:connect", self._handle_connect)
        register("homing:homing_move_begin", self._handle_begin)
        register("homing:homing_move_end", self._handle_end)

    def _handle_connect(self):
        heaters = self.printer.lookup_object("heaters")
        known = heaters.get_all_heaters()
        if self.heater_names is None:
            self.heater_names = list(known)
        self._check("heaters", self.heater_names, known)
        if self.stepper_names is not None:
            kin = self.printer.lookup_object("toolhead").get_kinematics()
            steppers = [stepper.get_name() for stepper in kin.get_steppers()]
            self._check("steppers", self.stepper_names, steppers)

    def _check(self, option, names, known):
        unknown = [name for name in names if name not in known]
        if unknown:
            raise self.printer.config_error(
                "Option '%s' in section 'homing_heaters': there is no %s; known are %s"
                % (option, ", ".join(unknown), ", ".join(known) or "none"))

    def _concerns(self, homing_move):
        """Whether one of the steppers of a move is listed."""
        if self.stepper_names is None:
            return True
        moving = {stepper.get_name() for endstop in homing_move.get_mcu_endstops()
                  for stepper in endstop.get_steppers()}
        return not moving.isdisjoint(self.stepper_names)

    def _handle_begin(self, homing_move):
        if self.targets or not self._concerns(homing_move):
            return
        heaters = self.printer.lookup_object("heaters")
        now = self.printer.get_reactor().monotonic()
        for name in self.heater_names:
            heater = heaters.lookup_heater(name.split()[-1])
            target = heater.get_temp(now)[1]
            if target:
                self.targets.append((heater, target))
                heater.set_temp(0.0)

    def _handle_end(self, homing_move):
        targets, self.targets = self.targets, []
        for heater, target in targets:
            heater.set_temp(target)


def load_config(config):
    return HomingHeaters(config)
