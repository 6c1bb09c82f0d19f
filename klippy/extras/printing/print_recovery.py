# SPDX-License-Identifier: GPL-3.0-or-later
"""[print_recovery]: goes on with a print after a power cut, crash or reset.

While a file is printed its state is noted between two lines, and saved once the
machine has come to that place.  See docs/print_recovery.md.
"""

import logging
import os

from klippy.extras import recovery_state
from klippy.extras.recovery_journal import Journal, JournalThread, try_write

# How kinematics find their position with a part on the bed: z is taken from the
# saved state and only x and y are homed, or all axes home away from the bed.
LIFTING = ("cartesian", "corexy", "corexz", "hybrid_corexy", "hybrid_corexz",
           "limited_cartesian", "limited_corexy", "limited_corexz")
AWAY_FROM_BED = ("delta", "rotary_delta")
ENDED = {"is_ended": True}
MAX_PENDING = 100


class PrintRecovery:
    """Saves the state of prints, and resumes the one that was interrupted."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.gcode = printer.lookup_object("gcode")
        self.sdcard = printer.load_object(config, "virtual_sdcard")
        self.interval = config.getfloat("interval", 1., minval=.1, maxval=60.)
        self.lift = config.getfloat("lift", 5., minval=0.)
        self.lift_speed = config.getfloat("lift_speed", 5., above=0.)
        self.travel_speed = config.getfloat("travel_speed", 50., above=0.)
        path = config.get("path", None)
        self.journal = Journal(os.path.expanduser(path) if path else os.path.join(
            self.sdcard.sdcard_dirname, ".print_recovery"))
        macros = printer.load_object(config, "gcode_macro")
        self.homing_gcode = macros.load_template(config, "homing_gcode", "")
        self.resume_gcode = macros.load_template(config, "resume_gcode", "")
        self.kinematics = config.getsection("printer").get("kinematics",
                                                           note_valid=False)
        self.writer = self.interrupted = None
        self.motion_report = printer.load_object(config, "motion_report")
        self.pending = []               # [print_time or None, state]
        self.state = None               # what the disk has, or gets, of a print
        self.is_resuming = False
        self.timer = self.reactor.register_timer(self._tick)
        self._register()

    def _register(self):
        register = self.printer.register_event_handler
        register("klippy:ready", self._handle_ready)
        register("klippy:disconnect", self._handle_disconnect)
        register("virtual_sdcard:reset_file", self._handle_reset_file)
        for name in ("RESUME_INTERRUPTED", "DISCARD_INTERRUPTED"):
            self.gcode.register_command(name, getattr(self, "cmd_" + name),
                                        desc=getattr(self, "cmd_%s_help" % name))
        self.sdcard.boundary_callbacks.append(self._note_boundary)

    # State

    def _handle_ready(self):
        start_args = self.printer.get_start_args()
        if start_args.get("debugoutput") is not None:
            return
        state = self.journal.read()
        if state is not None and not state.get("is_ended"):
            self.interrupted = state
            self.reactor.register_callback(self._offer)
        if start_args.get("machine") is None:
            self.writer = JournalThread(self.journal)
        self.reactor.update_timer(self.timer, self.reactor.NOW)

    def _handle_disconnect(self):
        if self.writer is not None:
            self.writer.close()
            self.writer = None

    def _offer(self, eventtime):
        if self.interrupted is None:
            return
        self.gcode.respond_info(
            "The print of '%s' was interrupted at %.1f %%, z %.3f."
            " RESUME_INTERRUPTED goes on with it, DISCARD_INTERRUPTED forgets it"
            % (os.path.basename(self.interrupted["file"]),
               100. * self._get_progress(), self.interrupted["machine"][2]))

    def _get_progress(self):
        return self.interrupted["byte"] / max(1, self.interrupted["size"])

    def get_status(self, eventtime):
        """file_path, file_position, progress (0..1) and z (mm) of the print that
        was interrupted; is_available: there is one.  height (mm): where the nozzle
        was when that was noted last, None if it was on its way."""
        state = self.interrupted
        if state is None:
            return {"is_available": False, "file_path": None, "file_position": 0,
                    "progress": 0., "z": None, "height": None}
        return {"is_available": True, "file_path": state["file"],
                "file_position": state["byte"], "progress": self._get_progress(),
                "z": state["machine"][2], "height": state["height"]}

    # While printing

    def _tick(self, eventtime):
        if not self.printer.is_shutdown() and not self.is_resuming:
            self._save_reached(eventtime)
            if self.sdcard.is_active():
                self.sdcard.ask_boundary()
            elif self.state is not None:
                self._check_end()
        return eventtime + self.interval

    def _check_end(self):
        state = self.sdcard.print_stats.state
        if state in ("complete", "cancelled", "error", "standby"):
            self._note_end()

    def _note_boundary(self):
        """Between two lines of the file: note the state at the planned end."""
        if self.printer.get_start_args().get("debugoutput") is not None:
            return
        if self.sdcard.file_path is None or self.printer.is_shutdown():
            return
        try:
            state = recovery_state.capture(self.printer, self.sdcard)
        except OSError as err:
            logging.warning("print_recovery: %s", err)
            return
        entry = [None, state]
        self.pending = [*self.pending, entry][-MAX_PENDING:]
        self.printer.lookup_object("toolhead").register_lookahead_callback(
            lambda print_time: entry.__setitem__(0, print_time))

    def _save_reached(self, eventtime):
        """Save the last of the states that the machine has come to, and its height
        now, which is another one in a pause."""
        toolhead = self.printer.lookup_object("toolhead")
        reached_time = toolhead.mcu.estimated_print_time(eventtime)
        reached = [entry for entry in self.pending
                   if entry[0] is not None and entry[0] <= reached_time]
        if reached:
            last = self.pending.index(reached[-1])
            self.pending = self.pending[last + 1:]
            self.interrupted = None
        elif self.state is None:
            return
        state = reached[-1][1] if reached else self.state
        self._save(state, self._get_height(eventtime))

    def _get_height(self, eventtime):
        """Where the nozzle is now: z in mm."""
        return self.motion_report.get_status(eventtime)["live_position"][2]

    def _save(self, state, height):
        """height: z of the machine in mm, None while it is not known."""
        if self.state is not state or height != state.get("height"):
            state["height"] = height
            self.state = state
            self._write(dict(state))

    def _write(self, state):
        if self.writer is not None:
            self.writer.write(state)
        else:
            try_write(self.journal, state, False)

    def _handle_reset_file(self):
        if not self.is_resuming:
            self._note_end()

    def _note_end(self):
        """Nothing is left to go on with."""
        self.pending = []
        if self.state is not None or self.interrupted is not None:
            self.state = self.interrupted = None
            self._write(ENDED)

    # Going on

    cmd_DISCARD_INTERRUPTED_help = "Forget the print that was interrupted"

    def cmd_DISCARD_INTERRUPTED(self, gcmd):
        self._get_interrupted(gcmd)
        self._note_end()

    cmd_RESUME_INTERRUPTED_help = "Go on with the print that was interrupted"

    def cmd_RESUME_INTERRUPTED(self, gcmd):
        state = self._get_interrupted(gcmd)
        self._check_file(gcmd, state)
        if not self.homing_gcode.text and self.kinematics not in (
                LIFTING + AWAY_FROM_BED):
            raise gcmd.error(
                "RESUME_INTERRUPTED does not know how a %s machine homes with a part on"
                " its bed: set homing_gcode in [print_recovery]" % (self.kinematics,))
        self._heat(state)
        self.is_resuming = True
        try:
            self._find_position(gcmd, state)
            self._load(gcmd, state)
            self._restore(state)
            self._go_back(state)
            self.interrupted = None
            self.sdcard.do_resume()
        finally:
            self.is_resuming = False

    def _get_interrupted(self, gcmd):
        if self.sdcard.is_active() or self.sdcard.is_cmd_from_sd():
            raise gcmd.error("A file is printed already")
        if self.interrupted is None:
            raise gcmd.error("No print was interrupted")
        return self.interrupted

    def _check_file(self, gcmd, state):
        path = state["file"]
        try:
            identity = recovery_state.identify_file(path)
        except OSError as err:
            raise gcmd.error("Unable to read '%s': %s. DISCARD_INTERRUPTED forgets the"
                             " print" % (path, err.strerror))
        if identity != state["identity"]:
            raise gcmd.error(
                "'%s' was changed since it was printed: byte %d is another place now."
                " DISCARD_INTERRUPTED forgets the print" % (path, state["byte"]))

    def _heat(self, state):
        """Heat everything at once, wait for the bed and what else there is first.

        A cold nozzle may stick to the part: it moves when it is hot.
        """
        heaters = self.printer.lookup_object("heaters", None)
        targets = state["heaters"]
        for name, target in targets.items():
            heaters.set_temperature(heaters.lookup_heater(name), target)
        for name in sorted(targets, key=lambda name: name.startswith("extruder")):
            heater = heaters.lookup_heater(name)
            heaters.set_temperature(heater, targets[name], wait=True)

    def _find_position(self, gcmd, state):
        run = self.gcode.run_script_from_command
        if self.homing_gcode.text:
            context = self.homing_gcode.create_template_context()
            context["z"] = state["height"]
            self.homing_gcode.run_gcode_from_command(context)
        elif self.kinematics in AWAY_FROM_BED:
            run("G28")
        else:
            self._raise_nozzle(gcmd, state)
            run("G28 X Y")

    def _raise_nozzle(self, gcmd, state):
        """Lift the nozzle off the part, as far as z goes.

        Its height is the saved one, unless somebody has homed z since.
        """
        toolhead = self.printer.lookup_object("toolhead")
        status = toolhead.get_kinematics().get_status(self.reactor.monotonic())
        if "z" not in status["homed_axes"]:
            if state["height"] is None:
                raise gcmd.error(
                    "The power was cut while the nozzle was lifted off the part: its"
                    " height is not known. Home z, or set its position, and use"
                    " RESUME_INTERRUPTED again")
            position = toolhead.get_position()
            position[2] = state["height"]
            toolhead.set_position(position, homing_axes="z")
        top = status["axis_maximum"][2]
        z = min(toolhead.get_position()[2] + self.lift, top)
        self._save(state, None)
        toolhead.manual_move([None, None, z], self.lift_speed)
        toolhead.wait_moves()
        self._save(state, z)

    def _load(self, gcmd, state):
        name = os.path.relpath(state["file"], self.sdcard.sdcard_dirname)
        if name.startswith(os.pardir + os.sep):
            raise gcmd.error("'%s' is not below '%s' any more"
                             % (state["file"], self.sdcard.sdcard_dirname))
        self.sdcard.load_at(gcmd, name, state["byte"])
        self.sdcard.print_stats.restore(state["stats"])

    def _restore(self, state):
        run = self.gcode.run_script_from_command
        if state["extruder"] != self.printer.lookup_object(
                "toolhead").get_extruder().get_name():
            run("ACTIVATE_EXTRUDER EXTRUDER=" + state["extruder"])
        run("\n".join(recovery_state.list_settings(state)))
        self.resume_gcode.run_gcode_from_command()
        recovery_state.restore_coordinates(
            self.printer.lookup_object("gcode_move"), state["coordinates"])

    def _go_back(self, state):
        """To where the print was, over the part and from above."""
        gcode_move = self.printer.lookup_object("gcode_move")
        x, y, z = state["coordinates"]["position"]
        start_x, start_y, height, e = gcode_move.last_position[:4]
        height = max(min(height, z + self.lift), z)
        gcode_move.make_move(start_x, start_y, height, e, self.travel_speed)
        gcode_move.make_move(x, y, height, e, self.travel_speed)
        self._save(state, None)
        gcode_move.make_move(x, y, z, e, self.lift_speed)
        toolhead = self.printer.lookup_object("toolhead")
        toolhead.wait_moves()
        self._save(state, toolhead.get_position()[2])


def load_config(config):
    return PrintRecovery(config)
