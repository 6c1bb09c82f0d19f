# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed of a fan from its tachometer pulses, counted by the mcu."""

from klippy.mcu import absence

SAMPLE_TIME = 1.0


class FanTachometer:
    """Counts edges on tachometer_pin; rpm None without such a pin."""

    def __init__(self, config):
        self.section = config.get_name()
        self.frequency = None
        pin = config.get("tachometer_pin", None)
        if pin is None:
            return
        self.pulses_per_turn = config.getint("tachometer_ppr", 2, minval=1)
        self.poll_time = config.getfloat("tachometer_poll_interval", 0.0015,
                                         above=0.0)
        self._setup(config.get_printer(), pin)

    def _setup(self, printer, pin):
        ppins = printer.lookup_object("pins")
        self.pin = ppins.lookup_pin(pin, can_pullup=True)
        self.mcu = self.pin["chip"]
        self.oid = self.mcu.create_oid()
        self.last_count = self.last_time = None
        self.frequency = 0.0
        self.samples = 0             # reports so far, one each SAMPLE_TIME
        self.part = absence.make_part(
            self.mcu, "option 'tachometer_pin'", may_lack=True)
        self.part.register_config_callback(self._build_config)
        absence.watch(self.mcu, self._handle_loss, None)

    def _handle_loss(self):
        self.frequency, self.last_time = 0.0, None

    def _build_config(self):
        mcu, oid = self.mcu, self.oid
        mcu.add_config_cmd("config_counter oid=%d pin=%s pull_up=%d"
                           % (oid, self.pin["pin"], self.pin["pullup"]))
        clock = mcu.get_query_slot(oid)
        mcu.add_config_cmd(
            "query_counter oid=%d clock=%d poll_ticks=%d sample_ticks=%d"
            % (oid, clock, mcu.seconds_to_clock(self.poll_time),
               mcu.seconds_to_clock(SAMPLE_TIME)), is_init=True)
        mcu.register_serial_response(
            self._handle_state, "counter_state oid=%c next_clock=%u count=%u"
            " count_clock=%u", oid)

    def _handle_state(self, params):
        self.samples += 1
        count = params["count"]
        edge_time = self._find_time(params["count_clock"])
        if self.last_time is not None:
            edges = (count - self.last_count) & 0xffffffff
            elapsed = edge_time - self.last_time
            if not edges:
                # it stands: what comes next is counted from this report on
                self.frequency = 0.0
                edge_time = self._find_time(params["next_clock"]) - SAMPLE_TIME
            elif elapsed > 0.0:
                # both edges of every pulse are counted
                self.frequency = 0.5 * edges / elapsed
        self.last_count, self.last_time = count, edge_time

    def _find_time(self, clock32):
        """print_time of a clock of the mcu."""
        return self.mcu.clock_to_print_time(self.mcu.clock32_to_clock64(clock32))

    def has_reports(self):
        """True if its mcu has reported a count that the next can be compared with."""
        return self.last_time is not None and not absence.is_absent(self.part)

    def get_status(self, eventtime):
        if self.frequency is None or absence.is_absent(self.part):
            return {"rpm": None}
        return {"rpm": self.frequency * 60.0 / self.pulses_per_turn}
