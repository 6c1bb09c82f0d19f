# SPDX-License-Identifier: GPL-3.0-or-later
"""[palette2]: a Mosaic Palette 2 in connected mode, which splices filament.

The O-codes of a file are passed to the device, which asks for them one by one, has
its filament loaded, and then lets the print go on.  During the print it is told of
each ping when the extruder has come to its place.  See docs/internals/palette2.md.
"""
import logging

from klippy.errors import PrinterError
from klippy.extras import omega_code, palette_job, palette_link, palette_load

START_TIME = 4.0            # s an answer may take
HEARTBEAT_TIME, WATCH_TIME = 2.0, 1.0       # s
FILE_CODES = range(1, 33)
FILE_ENDING = ".mcf.gcode"
IDLE, SETUP, PRINTING = "idle", "setup", "printing"
ENDED = ("complete", "cancelled", "error")


class Palette2:
    """The device as the printer sees it; status: see get_status()."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.gcode = printer.lookup_object("gcode")
        self.link = palette_link.PaletteLink(
            config, self._handle_line, self._handle_lost)
        self.slow = config.getfloat("feedrate_splice", 0.8, minval=0.0, maxval=1.0)
        self.normal = config.getfloat("feedrate_normal", 1.0, minval=0.0, maxval=1.0)
        self.load = palette_load.SmartLoad(self, config.getint("auto_load_speed", 2))
        self.max_variation = config.getfloat(
            "auto_cancel_variation", None, minval=0.01, maxval=0.2)
        self.pause_resume = printer.load_object(config, "pause_resume")
        self.is_batch = printer.get_start_args().get("debugoutput") is not None
        self.files = []
        self._reset_print()
        self.timer = self.reactor.register_timer(self._watch)
        printer.register_event_handler("klippy:disconnect", self._handle_disconnect)
        self._register_commands()

    def _register_commands(self):
        for name in ("CONNECT", "DISCONNECT", "CLEAR", "CUT", "SMART_LOAD"):
            name = "PALETTE_" + name
            self.gcode.register_command(name, getattr(self, "cmd_" + name),
                                        desc=getattr(self, "cmd_%s_help" % name))
        for number in FILE_CODES:
            self.gcode.register_command("O%d" % number, self.cmd_O)

    def _reset_print(self):
        self.load.stop()
        self.job = palette_job.PaletteJob()
        self.stage, self.is_holding = IDLE, False
        self.ping = self.remaining_load_length = None
        self.is_splicing = self.is_cancelling = False

    def get_status(self, eventtime):
        """ping: percent, the last one; remaining_load_length: mm to load before the
        print starts; both None before they are known."""
        return {"ping": self.ping, "is_splicing": self.is_splicing,
                "remaining_load_length": self.remaining_load_length}

    def get_extruder(self):
        """The extruder that is fed."""
        return self.printer.lookup_object("toolhead").get_extruder()

    def tell(self, text):
        """Tell the user."""
        self.gcode.respond_info("Palette 2: " + text)

    # The link

    def _handle_lost(self, reason):
        """The link has failed: a print that needs it waits."""
        self.load.stop()
        self.tell("connection lost (%s); PALETTE_CONNECT makes a new one" % (reason,))
        if self.stage == PRINTING:
            self.run_script("PAUSE")

    def _handle_disconnect(self):
        self.load.stop()
        self.link.close()

    def _connect(self):
        self.link.connect()
        self.reactor.update_timer(self.timer, self.reactor.NOW)

    def _watch(self, eventtime):
        """Look after the link while it rests, and after the print's end."""
        if not self.link.is_open:
            return self.reactor.NEVER
        if self.stage != IDLE:
            self._watch_print(eventtime)
            self.link.is_late = False
            return eventtime + WATCH_TIME
        self.link.beat()
        return eventtime + HEARTBEAT_TIME

    def _watch_print(self, eventtime):
        stats = self.printer.lookup_object("print_stats", None)
        state = stats.get_status(eventtime)["state"] if stats else ""
        if state not in ENDED:
            return
        if state != "complete" and not self.is_cancelling:
            self.link.send(omega_code.CANCEL)
        self._reset_print()

    # From the device

    def _handle_line(self, line):
        if line == omega_code.HEARTBEAT_ANSWER:
            self.link.note_alive()
            return
        logging.info("palette2: got %s", line)
        code = omega_code.parse(line)
        handle = None if code is None else HANDLERS.get(code.number)
        if handle is not None:
            handle(self, code)

    def handle_request(self, code):
        """O20 Dn: it wants a line of the file."""
        kind = int(code.get_text(0))
        if kind == palette_job.ASK_FIRST_USE:
            self.tell("it is used for the first time: follow its screen")
            return
        if kind == palette_job.ASK_AGAIN:
            self.link.send(self.link.last_line)
            return
        try:
            self.link.send(self.job.take(kind))
        except ValueError as err:
            self.tell("it %s" % (err,))

    def handle_ping(self, code):
        """O34: what it thinks of a ping: D0 missed, D1 percent, D2 a pong."""
        if code.is_like("D0"):
            self.tell("a ping was missed")
        elif code.is_like("D1"):
            last, self.ping = self.ping, code.get_float(1)
            self.tell("ping %d: %.1f%%" % (code.get_hex(2), self.ping))
            self._judge_ping(last)

    def _judge_ping(self, last):
        if self.max_variation is None or last is None:
            return
        change = abs(self.ping - last) / 100.0
        if change > self.max_variation:
            self.tell("two pings differ by %.1f%%, more than auto_cancel_variation:"
                      " the print is cancelled" % (change * 100.0,))
            self._cancel()

    def _cancel(self):
        """End the print here and there."""
        if not self.is_cancelling:
            self.is_cancelling = True
            self.link.send(omega_code.CANCEL)
            self.run_script("CANCEL_PRINT")

    def handle_resume(self, code):
        """O40: the print may go on."""
        if self.is_holding:
            self.is_holding, self.stage = False, PRINTING
            self.tell("the print starts")
            self._set_speed()
            self.pause_resume.send_resume_command()
        elif self.pause_resume.get_status(0.0)["is_paused"]:
            self.run_script("RESUME")

    def handle_version(self, code):
        """O50: its firmware; without a word it wants the names of files."""
        if code.words:
            self.link.version = tuple(int(part) for part in code.get_text(0).split("."))
            self.tell("connected, firmware %s" % (code.get_text(0),))
            return
        self.files = self._list_files()
        for name in self.files:
            self.link.send(omega_code.FILE_NAME % (name[:-len(FILE_ENDING)],))
        self.link.send(omega_code.NO_MORE_FILES)

    def _list_files(self):
        sdcard = self.printer.lookup_object("virtual_sdcard", None)
        if sdcard is None:
            return []
        try:
            names = [name for name, _ in sdcard.get_file_list(check_subdirs=True)]
        except PrinterError as err:
            self.tell(str(err))
            return []
        return [name for name in names if name.endswith(FILE_ENDING)]

    def handle_print(self, code):
        """O53 D1 Dn: print the file that is the nth from the end of the list."""
        if not code.is_like("D1"):
            return
        index = code.get_hex(1)
        if index >= len(self.files):
            raise ValueError("there are %d files" % (len(self.files),))
        self.run_script('SDCARD_PRINT_FILE FILENAME="%s"' % (self.files[-1 - index],))

    def handle_error(self, code):
        """O88 Dn: it has failed; a print waits."""
        self.tell("error %d, see its screen" % (code.get_hex(0),))
        if self.stage == PRINTING:
            self.run_script("PAUSE")

    def handle_state(self, code):
        """O97: what it does."""
        if code.is_like("U0", "D0"):
            self.tell("all splices are made")
        elif code.is_like("U0", "D2"):
            self.tell("it cancels the print")
            if self.stage != IDLE and not self.is_cancelling:
                self.is_cancelling = True
                self.run_script("CANCEL_PRINT")
        elif code.is_like("U0", "D3"):
            self._reset_print()
        elif code.is_like("U25"):
            self._note_splicing(code)
        elif code.is_like("U39"):
            self._note_loading(code)

    def _note_splicing(self, code):
        self.is_splicing = code.is_like("U25", "D0")
        if self.stage == PRINTING:
            self._set_speed()

    def _set_speed(self):
        """Print slower while it splices, so that filament does not run short."""
        share = self.slow if self.is_splicing else self.normal
        self.run_script("M220 S%d" % (max(1, round(share * 100.0)),))

    def _note_loading(self, code):
        """Decimal mm, negative while they are missing; none at the beginning."""
        if len(code.words) == 1:
            self.tell("put the filament into the extruder, then PALETTE_SMART_LOAD")
            return
        left = -int(code.get_text(1))
        self.remaining_load_length = left
        if left == 0:
            self.tell("the filament is loaded: start the print at the device")
        elif left < 0:
            self.tell("%d mm too much are loaded" % (-left,))

    def handle_pause(self, code):
        """O100: the print must wait."""
        self.run_script("PAUSE")

    def handle_smart_load(self, code):
        """O102 D0: the extruder shall pull."""
        if code.is_like("D0") and not self.load.is_active:
            try:
                self.load.start()
            except PrinterError as err:
                self.gcode.respond_raw("!! %s" % (err,))

    def note_load_failed(self):
        """No filament came: the user must put it in again."""
        self.link.send(omega_code.SMART_LOAD_STOP)
        self.tell("the filament did not move: put it into the extruder again, then"
                  " PALETTE_SMART_LOAD")

    def run_script(self, script):
        """Run G-code when it is its turn; its errors are told by the runner."""
        def run(eventtime):
            try:
                self.gcode.run_script(script)
            except PrinterError as err:
                logging.info("palette2: %s failed: %s", script, err)
        self.reactor.register_callback(run)

    # O-codes of files

    def cmd_O(self, gcmd):
        number = int(gcmd.get_command()[1:])
        line = " ".join([gcmd.get_command(), gcmd.get_raw_command_parameters()]).strip()
        if number == palette_job.HEADER_NUMBERS[0]:
            self._begin_file()
        if self.job.add(number, line) or self.is_batch:
            return
        if number == 1:
            self._start_print(gcmd, line)
        elif number == palette_job.PING_NUMBER:
            self._plan_ping(line)
        else:
            self._check_connected(gcmd)
            self.link.send(line)

    def _begin_file(self):
        self._reset_print()
        if not (self.link.is_open or self.is_batch):
            self._connect()

    def _start_print(self, gcmd, line):
        """All is known: the device makes filament, and the print waits for it."""
        self._check_connected(gcmd)
        if not self.link.ask_alive(START_TIME):
            self.link.close()
            raise gcmd.error("Palette 2: it does not answer; the print cannot start")
        self.stage, self.is_holding = SETUP, True
        self.link.send(line)
        self.tell("the print waits until its filament is made and loaded")
        self.pause_resume.send_pause_command()

    def _plan_ping(self, line):
        """Tell of a ping at the moment when the extruder comes to it."""
        def plan(print_time):
            now = self.reactor.monotonic()
            ahead = print_time - self.printer.lookup_object(
                "mcu").estimated_print_time(now)
            self.reactor.register_callback(send, now + max(0.0, ahead))

        def send(eventtime):
            self.job.ping = line
            self.link.send(omega_code.PING)
        self.printer.lookup_object("toolhead").register_lookahead_callback(plan)

    def _check_connected(self, gcmd):
        if not self.link.is_open:
            raise gcmd.error("Palette 2 is not connected: use PALETTE_CONNECT")

    # Commands

    cmd_PALETTE_CONNECT_help = "Connect to the Palette 2"

    def cmd_PALETTE_CONNECT(self, gcmd):
        if self.link.is_open:
            gcmd.respond_info("Palette 2 is connected already")
        elif not self.is_batch:
            self._connect()

    cmd_PALETTE_DISCONNECT_help = "End the connection to the Palette 2"

    def cmd_PALETTE_DISCONNECT(self, gcmd):
        self.link.close()
        self._reset_print()

    cmd_PALETTE_CLEAR_help = "Have the Palette 2 run all filament back"

    def cmd_PALETTE_CLEAR(self, gcmd):
        self._send_all(gcmd, omega_code.CLEAR)

    cmd_PALETTE_CUT_help = "Have the Palette 2 cut its filament"

    def cmd_PALETTE_CUT(self, gcmd):
        self._send_all(gcmd, [omega_code.CUT])

    def _send_all(self, gcmd, lines):
        if self.is_batch:
            return
        self._check_connected(gcmd)
        for line in lines:
            self.link.send(line)

    cmd_PALETTE_SMART_LOAD_help = "Pull the Palette 2's filament into the extruder"

    def cmd_PALETTE_SMART_LOAD(self, gcmd):
        if self.is_batch:
            return
        self._check_connected(gcmd)
        self.load.start()
        self.link.send(omega_code.SMART_LOAD_START)


HANDLERS = {20: Palette2.handle_request, 34: Palette2.handle_ping,
            40: Palette2.handle_resume, 50: Palette2.handle_version,
            53: Palette2.handle_print, 88: Palette2.handle_error,
            97: Palette2.handle_state, 100: Palette2.handle_pause,
            102: Palette2.handle_smart_load}


def load_config(config):
    return Palette2(config)
