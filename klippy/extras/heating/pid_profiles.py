# SPDX-License-Identifier: GPL-3.0-or-later
"""SET_HEATER_PID and PID_PROFILE: controls of heaters changed while they work.

The profile "default" is what the heater's own section says.
"""

from klippy.extras.control_mpc import ControlMPC
from klippy.extras.control_pid import OPTIONS, ControlPID
from klippy.extras.control_watermark import DEFAULT_DELTA, ControlBangBang
from klippy.extras.mpc_profile import MpcProfile
from klippy.extras.pid_profile import KINDS, PID_VERSION, SECTION_KINDS, Profile
from klippy.gcode_command import REQUIRED
from klippy.record import replace

DEFAULT = "default"
VERBOSITY = ("none", "low", "high")
# Have to be given then
NO_GAINS = (REQUIRED,) * 3


class HeaterProfiles:
    """Profiles of one heater, and which of them it works by."""

    def __init__(self, heater):
        self.heater = heater
        self.own_control = heater.control
        self.loaded = DEFAULT
        self.origin = self._read_control() or Profile()
        self.known = {DEFAULT: self._read_control()}

    def _read_control(self):
        control = self.heater.control
        if isinstance(control, ControlPID):
            return Profile("pid", control.get_gains())
        if isinstance(control, ControlBangBang):
            return Profile("watermark", max_delta=control.delta)
        if isinstance(control, ControlMPC):
            return MpcProfile.from_control(control)
        return None             # only the heater's section can make it

    def get_current(self):
        """The Profile that would bring back what works now; None if none can."""
        profile = self._read_control()
        if profile is None or profile.control != "pid":
            return profile
        origin = self.origin
        return Profile("pid", profile.gains, origin.smooth_time, origin.target,
                       origin.tolerance)

    def load(self, name, keep_target, is_clean):
        """Work by a profile.

        is_clean: as after a start; else a pid goes on without a bump.
        """
        profile, control = self.known[name], self.heater.control
        if profile is None:
            control = self.own_control
        elif profile.control == "mpc":
            control = self._load_model(profile, is_clean)
        elif is_clean or profile.control != "pid" \
                or not isinstance(control, ControlPID):
            control = profile.make_control(self.heater)
            control.begin(self.heater.last_temp_time, self.heater.last_temp)
        else:
            self.set_gains(profile.gains, profile.smooth_time)
        self.heater.set_control(control, keep_target)
        self.loaded, self.origin = name, profile or Profile()

    def _load_model(self, profile, is_clean):
        """The heater's own ControlMPC, by the values of a profile."""
        control, heater = self.own_control, self.heater
        with heater.lock:
            profile.apply(control)
            if is_clean or heater.control is not control:
                control.begin(heater.last_temp_time, heater.last_temp)
        return control

    def set_gains(self, gains, smooth_time):
        """Other gains for the pid that works now."""
        with self.heater.lock:
            self.heater.control.set_gains(gains, smooth_time)


class PidProfiles:
    """Status: profiles, the names of each heater's."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.heaters = {}
        self.sections = {}          # heater: {name: Profile} of the config file
        self.printer.register_event_handler("klippy:connect", self._handle_connect)

    def add_heater(self, heater):
        """Called by a heater once it has its control."""
        name = heater.short_name
        self.heaters[name] = HeaterProfiles(heater)
        gcode = self.printer.lookup_object("gcode")
        for command, handler in (("SET_HEATER_PID", self.cmd_SET_HEATER_PID),
                                 ("PID_PROFILE", self.cmd_PID_PROFILE)):
            gcode.register_mux_command(
                command, "HEATER", name, handler,
                desc=getattr(self, "cmd_%s_help" % command))

    def add_profile(self, heater_name, name, profile, config):
        """Called by a section [pid_profile <heater> <name>]."""
        if name == DEFAULT:
            raise config.error(
                "Section '%s': the profile '%s' is what the heater's own section"
                " says: choose another name" % (config.get_name(), DEFAULT))
        self.sections.setdefault(heater_name, {})[name] = profile

    def _handle_connect(self):
        for heater_name, profiles in self.sections.items():
            if heater_name not in self.heaters:
                raise self.printer.config_error(
                    "Section 'pid_profile %s %s' is for a heater '%s', but the heaters"
                    " of this printer are %s" % (
                        heater_name, next(iter(profiles)), heater_name,
                        ", ".join(self.heaters) or "none"))
            self._check_fit(heater_name, profiles)
            self.heaters[heater_name].known.update(profiles)

    def _check_fit(self, heater_name, profiles):
        heater = self.heaters[heater_name].heater
        for name, profile in profiles.items():
            reason = (profile.explain_unfit(heater) if profile.control == "mpc"
                      else None)
            if reason is not None:
                raise self.printer.config_error("Section 'pid_profile %s %s': %s" % (
                    heater_name, name, reason))

    def note_measured(self, heater, parameters):
        """MPC_CALIBRATE put its MpcParameters into the heater's own section."""
        profiles = self.heaters[heater.short_name]
        own = profiles.known[DEFAULT]
        if own.control != "mpc":            # the section was made a pid's meanwhile
            own = MpcProfile.from_control(profiles.own_control)
        profiles.known[DEFAULT] = replace(own, parameters=parameters)

    def get_loaded(self, heater_name):
        """Name of the profile that a heater works by."""
        return self.heaters[heater_name].loaded

    def get_status(self, eventtime):
        return {"profiles": {name: list(profiles.known)
                             for name, profiles in self.heaters.items()}}

    def _find(self, gcmd):
        return self.heaters[gcmd.get("HEATER")]

    cmd_SET_HEATER_PID_help = "Change the PID gains of a heater while it works"

    def cmd_SET_HEATER_PID(self, gcmd):
        profiles = self._find(gcmd)
        control = profiles.heater.control
        if not isinstance(control, ControlPID):
            raise gcmd.error(
                "Heater '%s' has no gains now: SET_HEATER_PID needs 'control: pid'"
                % profiles.heater.short_name)
        gains = read_gains(gcmd, control.get_gains())
        profiles.set_gains(gains, profiles.origin.smooth_time)
        gcmd.respond_info(
            "Heater '%s' has %s now; PID_PROFILE SAVE=%s HEATER=%s keeps them"
            % (profiles.heater.short_name, describe_gains(gains), profiles.loaded,
               profiles.heater.short_name))

    cmd_PID_PROFILE_help = "Load, save, make, show or remove a heater's profiles"

    def cmd_PID_PROFILE(self, gcmd):
        actions = {"LOAD": self._load, "SAVE": self._save, "REMOVE": self._remove,
                   "GET_VALUES": self._show, "SET_VALUES": self._set_values}
        given = [name for name in actions if gcmd.get(name, None) is not None]
        if len(given) != 1:
            raise gcmd.error("PID_PROFILE needs one of %s, not %s" % (
                ", ".join(name + "=" for name in actions),
                " and ".join(given) or "none"))
        action = given[0]
        name = gcmd.get(action)
        if action != "GET_VALUES" and len(name.split()) != 1:
            raise gcmd.error("PID_PROFILE %s='%s': the name of a profile is one word"
                             % (action, name))
        actions[action](gcmd, self._find(gcmd), name)

    def _load(self, gcmd, profiles, name):
        instead = gcmd.get("DEFAULT", None)
        if name not in profiles.known and instead in profiles.known:
            gcmd.respond_info("There is no profile '%s': loading '%s'"
                              % (name, instead))
            name = instead
        self._check_known(gcmd, profiles, name)
        self._start(gcmd, profiles, name)

    def _start(self, gcmd, profiles, name):
        verbose = gcmd.get("VERBOSE", "low").lower()
        if verbose not in VERBOSITY:
            raise gcmd.error("VERBOSE=%s must be one of %s"
                             % (verbose, ", ".join(VERBOSITY)))
        is_kept = bool(gcmd.get_int("KEEP_TARGET", 0, 0, 1))
        self._check_measured(gcmd, profiles, name, is_kept)
        self._wait_for_moves()
        profiles.load(name, is_kept, bool(gcmd.get_int("LOAD_CLEAN", 0, 0, 1)))
        if verbose != "none":
            gcmd.respond_info("Heater '%s' works by the profile '%s'"
                              % (profiles.heater.short_name, name))
        if verbose == "high":
            self._show(gcmd, profiles, name)

    def _check_measured(self, gcmd, profiles, name, is_kept):
        """No target may be left to a model that cannot hold it."""
        profile = profiles.known[name]
        if not is_kept or profile is None or profile.control != "mpc":
            return
        missing = profile.parameters.list_missing()
        if missing:
            raise gcmd.error(
                "The profile '%s' of heater '%s' has no %s: load it without"
                " KEEP_TARGET=1, run MPC_CALIBRATE, and PID_PROFILE SAVE=%s"
                % (name, profiles.heater.short_name, " and ".join(missing), name))

    def _wait_for_moves(self):
        """The moves before were meant for the profile before."""
        toolhead = self.printer.lookup_object("toolhead", None)
        if toolhead is not None:
            toolhead.wait_moves()

    def _check_known(self, gcmd, profiles, name):
        if name not in profiles.known:
            raise gcmd.error("Heater '%s' has no profile '%s', it has %s" % (
                profiles.heater.short_name, name,
                ", ".join("'%s'" % known for known in profiles.known)))

    def _save(self, gcmd, profiles, name):
        profile = profiles.get_current()
        if profile is None:
            raise gcmd.error(
                "The control of heater '%s' cannot be saved as a profile, only %s can"
                % (profiles.heater.short_name, " and ".join(SECTION_KINDS)))
        self.store(profiles.heater, name, profile)
        profiles.loaded, profiles.origin = name, profile
        gcmd.respond_info(
            "Profile '%s' of heater '%s' is there until the next restart; the"
            " SAVE_CONFIG command writes it to the config file"
            % (name, profiles.heater.short_name))

    def store(self, heater, name, profile):
        """Have a profile from now on, and in the config file by SAVE_CONFIG."""
        known = self.heaters[heater.short_name].known
        before, known[name] = known.get(name), profile
        section, options = heater.get_name(), profile.list_options()
        if name != DEFAULT:
            section = "pid_profile %s %s" % (heater.short_name, name)
            options = [("pid_version", "%d" % PID_VERSION), *options]
        elif profile.control == "mpc":
            # the section has the rest, and some of it is the extruder's as well
            same = before.list_options() if before is not None else ()
            options = [pair for pair in options
                       if pair[0] == "control" or pair not in same]
        else:
            options = [pair for pair in options if pair[0] in
                       ("control", "max_delta", *OPTIONS)]
        configfile = self.printer.lookup_object("configfile")
        for option, value in options:
            configfile.set(section, option, value)

    def _remove(self, gcmd, profiles, name):
        self._check_known(gcmd, profiles, name)
        if name in (DEFAULT, profiles.loaded):
            raise gcmd.error("The profile '%s' stays: %s" % (
                name, "it is the heater's own section" if name == DEFAULT else
                "heater '%s' works by it" % profiles.heater.short_name))
        del profiles.known[name]
        self.printer.lookup_object("configfile").remove_section(
            "pid_profile %s %s" % (profiles.heater.short_name, name))
        gcmd.respond_info(
            "Profile '%s' of heater '%s' is removed; the SAVE_CONFIG command removes"
            " it from the config file, if it was saved there"
            % (name, profiles.heater.short_name))

    def _show(self, gcmd, profiles, name):
        profile = profiles.get_current()
        values = [("control", "of the heater's section")] if profile is None else \
            profile.list_options()
        gcmd.respond_info("Heater '%s', profile '%s':\n%s" % (
            profiles.heater.short_name, profiles.loaded,
            "\n".join("%s: %s" % pair for pair in values)))

    def _set_values(self, gcmd, profiles, name):
        if name == DEFAULT:
            raise gcmd.error("SET_VALUES=%s: choose another name, and change the"
                             " heater's own values with SET_HEATER_PID" % DEFAULT)
        profiles.known[name] = read_profile(gcmd, profiles.get_current())
        self._start(gcmd, profiles, name)


def read_gains(gcmd, gains):
    """Gains of KP, KI and KD; those that are not given stay."""
    return tuple(gcmd.get_float(name, gain, minval=0.0)
                 for name, gain in zip(("KP", "KI", "KD"), gains, strict=True))


def describe_gains(gains):
    return "pid_Kp=%.3f pid_Ki=%.3f pid_Kd=%.3f" % gains


def read_profile(gcmd, current):
    """Profile of the parameters of SET_VALUES; what is not given stays."""
    if current is None or current.control == "mpc":
        current = Profile(gains=NO_GAINS)
    control = gcmd.get("CONTROL", current.control).lower()
    if control not in KINDS:
        raise gcmd.error("CONTROL=%s must be one of %s"
                         % (control, ", ".join(KINDS)))
    if control == "watermark":
        return Profile(control, max_delta=gcmd.get_float(
            "MAX_DELTA", current.max_delta or DEFAULT_DELTA, above=0.0))
    gains = current.gains if current.control == "pid" else NO_GAINS
    return Profile(
        control, read_gains(gcmd, gains),
        gcmd.get_float("SMOOTH_TIME", current.smooth_time, above=0.0),
        gcmd.get_float("TARGET", current.target),
        gcmd.get_float("TOLERANCE", current.tolerance, minval=0.0))


def load_config(config):
    return PidProfiles(config)
