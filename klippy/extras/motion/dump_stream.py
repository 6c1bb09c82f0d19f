# SPDX-License-Identifier: GPL-3.0-or-later
"""A stream of measurements to clients of the API socket, in batches."""

from klippy import webhooks

# s between batches
BATCH_PERIOD = 0.5


class DumpStream:
    """Sends what collect() returns (a list of dicts) while anybody listens.

    start: called when the first client comes.  A client subscribes by a
    request for the endpoint `path` whose parameter `name` is this stream's;
    the reply holds `header`, the meaning of the columns of the data.
    """

    def __init__(self, printer, path, name, header, start, collect):
        self.printer = printer
        self.reactor = printer.get_reactor()
        self.header = {"header": list(header)}
        self.start, self.collect = start, collect
        self.clients = {}               # client -> template
        self.timer = None
        webhooks.get(printer).register_mux_endpoint(
            path, "name", name, self._handle_request)

    def _handle_request(self, web_request):
        template = web_request.get_dict("response_template", {})
        if self.timer is None:
            self.start()
            self.timer = self.reactor.register_timer(
                self._send_batch, self.reactor.monotonic() + BATCH_PERIOD)
        self.clients[web_request.get_client_connection()] = template
        web_request.send(self.header)

    def _send_batch(self, eventtime):
        for client in [c for c in self.clients if c.is_closed()]:
            del self.clients[client]
        if not self.clients:
            timer, self.timer = self.timer, None
            self.reactor.unregister_timer(timer)
            return self.reactor.NEVER
        for params in self.collect(eventtime):
            for client, template in self.clients.items():
                client.send({**template, "params": params})
        return eventtime + BATCH_PERIOD
