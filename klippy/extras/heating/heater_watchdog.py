# SPDX-License-Identifier: GPL-3.0-or-later
"""[heater_watchdog name]: shut down when heater and sensor contradict each other.

Each reading goes through a HeatGuard; it learns what the heater can do, or is
told by the values of `control: mpc`, asks the sensor for a sign of life by small
waves of power, and cuts the power while the block may be too hot.
"""
import logging

from klippy.extras import heat_guard
from klippy.extras.control_mpc import ControlMPC
from klippy.extras.control_pid import ControlPID
from klippy.extras.heater_surroundings import HeaterSurroundings
from klippy.extras.thermal_model import calc_filament_transfer, interpolate_transfer

# Filament and cartridge that take the largest share of power: mm, g/cm^3,
# J/g/K, W
FILAMENT, LEAST_POWER = (1.75, 1.3, 2.2), 25.0
MAX_RETRACT = 2.0
WHAT = {
    heat_guard.TOO_WARM: (
        "gets warmer, or stays warm, without the power for it",
        "the switch of the heater (MOSFET, relay) may be stuck on: cut the power"
        " supply. Or the sensor is loose or stuck, or belongs to another heater"),
    heat_guard.TOO_COLD: (
        "stays colder than its power must make it",
        "the sensor may be loose, stuck or slow, the heater or its supply broken"),
    heat_guard.NO_ANSWER: (
        "does not get warmer at full power",
        "heater or sensor may be loose, broken, or on another pin"),
    heat_guard.JUMPS: (
        "has a reading that jumps", "the wires of the sensor may be loose"),
    heat_guard.DEAD: (
        "has a reading that does not follow its power",
        "the sensor may be stuck, loose or slow")}


class HeaterWatchdog:
    """Status: state (learning, watching or off), rate, hold, is_probing, is_cut,
    n_cuts."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.heater_name = config.get_name().split()[-1]
        self.is_hotend = self.heater_name.rstrip("0123456789") == "extruder"
        self.fan_name = config.get("cooling_fan", None)
        self.surroundings = HeaterSurroundings(
            config, self.fan_name, None, MAX_RETRACT)
        self.is_enabled = config.getboolean("enable", True)
        self.can_probe = config.getboolean("probe", True)
        self.heater = self.guard = None
        self.last_time = 0.0
        self.n_expired = 0
        self.fault = heat_guard.NONE
        printer.register_event_handler("klippy:connect", self._handle_connect)
        printer.register_event_handler("motion_queuing:hold", self._handle_hold)

    def _handle_connect(self):
        is_batch = self.printer.get_start_args().get("debugoutput") is not None
        if is_batch or not self.is_enabled:
            return
        heaters = self.printer.lookup_object("heaters")
        self.heater = heater = heaters.lookup_heater(self.heater_name)
        if self.is_hotend:
            self.surroundings.watch_hotend(heater.name, self._choose_fan(heater))
        self.guard = heat_guard.make_guard(self._choose_kind(), heater.max_temp)
        self._take_known()
        heater.add_reading_callback(self._note_reading)

    def _choose_fan(self, heater):
        """Section of the fan that blows at a hotend, or None."""
        name = self.fan_name or getattr(heater.control, "fan_name", None)
        if name is not None:
            return name
        if self.printer.lookup_object("fan", None) is not None:
            return "fan"
        fans = self.printer.lookup_objects("fan_generic")
        return fans[0][0] if len(fans) == 1 else None

    def _choose_kind(self):
        if self.is_hotend:
            return "extruder"
        return "heater_bed" if self.heater.name == "heater_bed" else "other"

    def _take_known(self):
        """Values that were measured by MPC_CALIBRATE."""
        control = self.heater.control
        parameters = getattr(control, "parameters", None)
        if parameters is None or parameters.list_missing():
            return
        power = control.tuning.power * self.heater.get_max_power()
        fans = [interpolate_transfer(parameters.fan_transfers, speed)
                for speed in (0.0, 0.25, 0.5, 1.0)]
        self.guard.watch.set_known(power / parameters.capacity, [
            (parameters.transfer + fan) / power for fan in fans])

    def _handle_hold(self, duration):
        self.last_time -= duration

    # Where readings arrive

    def _note_reading(self, read_time, temp, target, duty):
        """Take a reading (print_time, degC), under the heater's lock."""
        elapsed, self.last_time = read_time - self.last_time, read_time
        if self.fault or self.printer.is_shutdown():
            return
        if self.heater.n_expired != self.n_expired:
            self.n_expired = self.heater.n_expired
            self.guard.restart()
        around, full = self.surroundings, self.heater.get_max_power()
        flow = calc_filament_transfer(around.filament_speed, *FILAMENT) / LEAST_POWER
        fault = self.guard.update(elapsed, temp, target, duty / full,
                                  around.fan_speed, flow)
        # a control that measures, or switches, is left alone
        is_free = isinstance(self.heater.control, (ControlPID, ControlMPC))
        self.heater.duty_offset = (
            full * self.guard.offset if self.can_probe and is_free else 0.0)
        self._note_cut(self.guard.is_cut, temp)
        if fault:
            self.fault = fault
            self.printer.get_reactor().register_async_callback(
                lambda eventtime: self._stop(temp, target, duty))

    def _note_cut(self, is_cut, temp):
        heater = self.heater
        if is_cut and not heater.is_cut:
            heater.n_cuts += 1
            logging.info(
                "Heater watchdog of %s: reads %.1f, but the power of before could have"
                " made it %.1f degC: off until the reading falls", self.heater_name,
                temp, self.guard.budget.hot)
        heater.is_cut = is_cut

    def _stop(self, temp, target, duty):
        what, hint = WHAT[self.fault]
        watch = self.guard.watch
        logging.error(
            "Heater watchdog of %s: %s at %.1f of %.1f degC, power %.2f; learned"
            " rate %.3f, holds %s, sums %.1f %.1f %.1f", self.heater_name, what, temp,
            target, duty, watch.rate, watch.get_holds(), watch.warm_sum, watch.cold_sum,
            watch.still_sum)
        self.printer.invoke_shutdown(
            "Heater %s %s (at %.1f degC, target %.1f, power %.0f %%)\n%s.\n"
            "'enable: False' in a section [heater_watchdog %s] turns this check off"
            % (self.heater_name, what, temp, target, 100.0 * duty,
               hint[0].upper() + hint[1:], self.heater_name))

    def get_status(self, eventtime):
        """state: off, learning (only coarse checks) or watching.

        rate: degC/s at full power without losses.  hold: power a degree above
        the room; 0 while they are not known.  is_probing: a wave of power asks the
        sensor for a sign of life just now.  is_cut: the power is off until it gives
        one.  n_cuts: how often that was.
        """
        if self.guard is None:
            return {"state": "off", "rate": 0.0, "hold": 0.0, "is_probing": False,
                    "is_cut": False, "n_cuts": 0}
        watch, probe = self.guard.watch, self.guard.probe
        hold = next((h for h in watch.get_holds() if h > 0.0), 0.0)
        return {"state": "watching" if watch.rate > 0.0 else "learning",
                "rate": round(watch.rate, 4), "hold": round(hold, 6),
                "is_probing": probe.offset != 0.0, "is_cut": self.heater.is_cut,
                "n_cuts": self.heater.n_cuts}


def load_config_prefix(config):
    return HeaterWatchdog(config)
