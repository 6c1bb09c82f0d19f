# SPDX-License-Identifier: GPL-3.0-or-later
"""[canbus_stats NAME]: errors on the CAN bus of an [mcu NAME], once a second."""

from klippy.mcu import absence

PERIOD = 1.             # s
STATES = ("active", "warn", "passive", "off")


class BusStats:
    """Asks one mcu about its CAN controller."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.reactor = self.printer.get_reactor()
        self.name = config.get_name().split()[-1]
        self.mcu = self.query = self.timer = None
        self.status = dict.fromkeys(("rx_error", "tx_error", "tx_retries",
                                     "bus_state"))
        self.printer.register_event_handler("klippy:connect", self._handle_connect)
        self.printer.register_event_handler("klippy:ready", self._handle_ready)
        self.printer.register_event_handler("klippy:shutdown", self._stop)
        self.printer.register_event_handler("klippy:disconnect", self._stop)

    def _handle_connect(self):
        key = "mcu" if self.name == "mcu" else "mcu " + self.name
        self.mcu = self.printer.lookup_object(key, None)
        if self.mcu is None:
            raise self.printer.config_error(
                "[canbus_stats %s]: there is no [%s]" % (self.name, key))
        if self.mcu.try_lookup_command("get_canbus_status") is not None:
            self.query = self.mcu.lookup_query_command(
                "get_canbus_status", "canbus_status rx_error=%u tx_error=%u"
                " tx_retries=%u canbus_bus_state=%u")

    def _handle_ready(self):
        if self.query is not None and not self.mcu.is_fileoutput():
            self.timer = self.reactor.register_timer(self._ask, self.reactor.NOW)

    def _stop(self):
        timer, self.timer = self.timer, None
        if timer is not None:
            self.reactor.unregister_timer(timer)

    def _ask(self, eventtime):
        try:
            params = self.query.send()
        except self.mcu.error:
            if not absence.may_be_absent(self.mcu):
                raise
            self.status = dict.fromkeys(self.status)
            return eventtime + PERIOD
        state = params["canbus_bus_state"]
        if not isinstance(state, str):
            state = STATES[state] if state < len(STATES) else str(state)
        self.status = {"rx_error": params["rx_error"],
                       "tx_error": params["tx_error"],
                       "tx_retries": params["tx_retries"], "bus_state": state}
        return eventtime + PERIOD

    def get_status(self, eventtime):
        """rx_error, tx_error, tx_retries: counts since the mcu started; bus_state:
        active, warn, passive or off.  All are None until the mcu has answered."""
        return self.status

    def stats(self, eventtime):
        """The log's text."""
        return False, "canstat_%s: bus_state=%s rx_error=%s tx_error=%s" \
            " tx_retries=%s" % (self.name, self.status["bus_state"],
                                self.status["rx_error"], self.status["tx_error"],
                                self.status["tx_retries"])


def load_config_prefix(config):
    """Make the printer object canbus_stats NAME."""
    return BusStats(config)
