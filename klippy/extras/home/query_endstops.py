# SPDX-License-Identifier: GPL-3.0-or-later
"""[query_endstops]: tells which endstops are triggered."""

from klippy import webhooks


class QueryEndstops:
    """The printer's endstops by name; whoever makes one registers it."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.gcode = self.printer.lookup_object("gcode")
        self.endstops = []
        self.last_state = []
        webhooks.get(self.printer).register_endpoint(
            "query_endstops/status", self._handle_request)
        self.gcode.register_command("QUERY_ENDSTOPS", self.cmd_QUERY_ENDSTOPS,
                                    desc=self.cmd_QUERY_ENDSTOPS_help)
        self.gcode.register_command("M119", self.cmd_QUERY_ENDSTOPS)

    def register_endstop(self, mcu_endstop, name):
        """Show mcu_endstop under this name."""
        self.endstops.append((mcu_endstop, name))

    def get_status(self, eventtime):
        """last_query: state of each endstop when it was last asked for."""
        return {"last_query": dict(self.last_state)}

    def _query(self):
        """Ask all endstops; returns {name: "open" or "TRIGGERED"}."""
        print_time = self.printer.lookup_object("toolhead").get_last_move_time()
        self.last_state = [(name, endstop.query_endstop(print_time))
                           for endstop, name in self.endstops]
        return {name: "TRIGGERED" if value else "open"
                for name, value in self.last_state}

    def _handle_request(self, web_request):
        with self.gcode.get_mutex():
            states = self._query()
        web_request.send(states)

    cmd_QUERY_ENDSTOPS_help = "Tell the state of each endstop"

    def cmd_QUERY_ENDSTOPS(self, gcmd):
        states = self._query()
        gcmd.respond_raw(" ".join("%s:%s" % item for item in states.items()))


def load_config(config):
    return QueryEndstops(config)
