# SPDX-License-Identifier: GPL-3.0-or-later
"""[neopixel name]: a chain of WS2812, SK6812 and the like, sent pulse by pulse."""
import logging

from klippy.mcu import absence

# The printer goes on without it
MAY_LACK_FIRMWARE = True

# Longest pause between two bits that leds do not take for the end (s)
BIT_MAX_TIME = 0.000004
# Shortest pause that they take for it (s)
RESET_MIN_TIME = 0.000050
# What the mcus keep room for (bytes)
MAX_DATA_SIZE = 500
# Bytes of a message to the mcu
CHUNK = 48
# Equal bytes between two changes that are cheaper to send again (bytes)
MERGE_GAP = 6
MAX_TRIES = 8
CHANNELS = {"R": 0, "G": 1, "B": 2, "W": 3}


class PrinterNeoPixel:
    """Status: color_data, as LEDHelper."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.name = config.get_name()
        params = printer.lookup_object("pins").lookup_pin(config.get("pin"))
        self.mcu, self.pin = params["chip"], params["pin"]
        self.oid = self.mcu.create_oid()
        count = config.getint("chain_count", 1, minval=1)
        orders = self._read_orders(config, count)
        # of each byte: which led, and which of its channels
        self.layout = [(led, CHANNELS[letter])
                       for led, order in enumerate(orders) for letter in order]
        if len(self.layout) > MAX_DATA_SIZE:
            raise config.error(
                "Section '%s': the chain takes %d bytes, at most %d can be sent"
                % (self.name, len(self.layout), MAX_DATA_SIZE))
        self.sent_data = bytes(len(self.layout))
        self.update_cmd = self.send_cmd = None
        self.helper = printer.load_object(config, "led").setup_helper(
            config, self._update, count)
        self.get_status = self.helper.get_status
        self.part = absence.find_part(self.mcu)
        self.part.register_config_callback(self._build_config)
        printer.register_event_handler("klippy:connect", self._handle_connect)
        absence.watch(self.mcu, None, self._handle_connect)

    @staticmethod
    def _read_orders(config, count):
        """The order of channels of each led."""
        orders = [order.upper() for order in config.getlist("color_order", ["GRB"])]
        if len(orders) == 1:
            orders *= count
        if len(orders) != count:
            raise config.error(
                "Option 'color_order' in section '%s' has %d entries; it needs one, or"
                " one for each of the %d leds"
                % (config.get_name(), len(orders), count))
        for order in orders:
            if sorted(order) not in (sorted("RGB"), sorted("RGBW")):
                raise config.error(
                    "Option 'color_order' in section '%s': '%s' should hold R, G and B,"
                    " and may hold W, each once" % (config.get_name(), order))
        return orders

    def _build_config(self):
        mcu = self.mcu
        mcu.add_config_cmd(
            "config_neopixel oid=%d pin=%s data_size=%d bit_max_ticks=%d"
            " reset_min_ticks=%d" % (
                self.oid, self.pin, len(self.layout),
                mcu.seconds_to_clock(BIT_MAX_TIME),
                mcu.seconds_to_clock(RESET_MIN_TIME)))
        queue = mcu.alloc_command_queue()
        self.update_cmd = mcu.lookup_command(
            "neopixel_update oid=%c pos=%hu data=%*s", cq=queue)
        self.send_cmd = mcu.lookup_query_command(
            "neopixel_send oid=%c", "neopixel_result oid=%c success=%c",
            oid=self.oid, cq=queue)

    def _handle_connect(self):
        # The leds keep what they showed before, the mcu's memory may not: send all
        self.sent_data = None
        self.helper.transmit_again()

    def _pack(self, colors):
        return bytes(int(colors[led][channel] * 255.0 + 0.5)
                     for led, channel in self.layout)

    def _update(self, colors, print_time):
        if absence.is_absent(self.part):
            self.sent_data = None
            return
        data, old = self._pack(colors), self.sent_data
        clock = 0 if print_time is None else self.mcu.print_time_to_clock(print_time)
        for start, end in list_changes(old, data):
            for pos in range(start, end, CHUNK):
                self.update_cmd.send(
                    [self.oid, pos, data[pos:min(pos + CHUNK, end)]], minclock=clock)
        self.sent_data = data
        self._send(clock)

    def _send(self, clock):
        """Have the mcu show what it has, again until the leds have taken it all."""
        if self.mcu.is_fileoutput():
            return
        try:
            for _ in range(MAX_TRIES):
                if self.send_cmd.send([self.oid], minclock=clock)["success"]:
                    return
        except self.mcu.error as err:
            logging.warning("[%s]: %s", self.name, err)
            return
        logging.info("[%s]: interrupted %d times, colors may be wrong",
                     self.name, MAX_TRIES)


def list_changes(old, new):
    """[(start, end)] of what differs, neighbours merged; all of it without old."""
    if old is None:
        return [(0, len(new))]
    spans = []
    for pos in range(len(new)):
        if old[pos] == new[pos]:
            continue
        if spans and pos - spans[-1][1] <= MERGE_GAP:
            spans[-1] = (spans[-1][0], pos + 1)
        else:
            spans.append((pos, pos + 1))
    return spans


def load_config_prefix(config):
    return PrinterNeoPixel(config)
