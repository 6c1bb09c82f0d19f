# SPDX-License-Identifier: GPL-3.0-or-later
"""API endpoints for the status of printer objects: list, query, subscribe.

Objects return a new value where a status field changes; a value that is the
same object as before counts as unchanged.
"""

import logging

SUBSCRIPTION_PERIOD = 0.25


class StatusApi:
    """Answers queries at once and sends subscribers what changed."""

    def __init__(self, printer, webhooks):
        self.printer = printer
        self.reactor = printer.get_reactor()
        self.subscriptions = {}         # client -> Subscription
        self.failed = set()             # names of objects told in the log
        self.timer = None
        for path, callback in (("objects/list", self._list),
                               ("objects/query", self._query),
                               ("objects/subscribe", self._subscribe)):
            webhooks.register_endpoint(path, callback)

    def _list(self, web_request):
        names = [name for name, obj in self.printer.lookup_objects()
                 if hasattr(obj, "get_status")]
        web_request.send({"objects": names})

    def _query(self, web_request):
        wanted = read_wanted(web_request)
        web_request.send(self._answer(StatusReader(self), wanted))

    def _subscribe(self, web_request):
        wanted = read_wanted(web_request)
        template = web_request.get_dict("response_template", {})
        client = web_request.get_client_connection()
        self.subscriptions.pop(client, None)
        answer = self._answer(StatusReader(self), wanted)
        web_request.send(answer)
        if not wanted:
            return
        self.subscriptions[client] = Subscription(
            client, wanted, template, answer["status"])
        if self.timer is None:
            self.timer = self.reactor.register_timer(
                self._send_changes,
                self.reactor.monotonic() + SUBSCRIPTION_PERIOD)

    def _answer(self, reader, wanted):
        status = {name: reader.read(name, fields) for name, fields in wanted.items()}
        return {"eventtime": reader.eventtime, "status": status}

    def _send_changes(self, eventtime):
        reader = StatusReader(self)
        for client, subscription in list(self.subscriptions.items()):
            if client.is_closed():
                del self.subscriptions[client]
            else:
                subscription.send_changes(reader)
        if not self.subscriptions:
            timer, self.timer = self.timer, None
            self.reactor.unregister_timer(timer)
            return self.reactor.NEVER
        return eventtime + SUBSCRIPTION_PERIOD

    def note_failure(self, name):
        """Log a get_status() that raised, once an object (in its handler)."""
        if name not in self.failed:
            self.failed.add(name)
            logging.exception("get_status() of object '%s' failed", name)


class StatusReader:
    """Status of all objects at one time, each read once."""

    def __init__(self, api):
        self.api = api
        self.printer = api.printer
        self.eventtime = api.reactor.monotonic()
        self.known = {}

    def read(self, name, fields=None):
        """Fields of an object (None: all); {} if there is no such object.

        A field that the object does not have is None.
        """
        status = self.known.get(name)
        if status is None:
            status = self.known[name] = self._read_object(name)
        if fields is None:
            return dict(status)
        return {field: status.get(field) for field in fields}

    def _read_object(self, name):
        obj = self.printer.lookup_object(name, None)
        if not hasattr(obj, "get_status"):
            return {}
        try:
            return obj.get_status(self.eventtime)
        except Exception:
            self.api.note_failure(name)
            return {}


class Subscription:
    """What one client follows, and the values it knows."""

    def __init__(self, client, wanted, template, status):
        self.client, self.wanted, self.template = client, wanted, template
        self.last = status

    def send_changes(self, reader):
        """Push the fields that differ from the ones sent before."""
        changes = {}
        for name, fields in self.wanted.items():
            current, last = reader.read(name, fields), self.last.get(name, {})
            changed = {field: value for field, value in current.items()
                       if field not in last or _differs(last[field], value)}
            self.last[name] = current
            if changed:
                changes[name] = changed
        if changes:
            self.client.send({**self.template, "params": {
                "eventtime": reader.eventtime, "status": changes}})


def _differs(old, new):
    return old is not new and old != new


def read_wanted(web_request):
    """The request's `objects`: {name: list of field names or None}."""
    wanted = web_request.get_dict("objects")
    for name, fields in wanted.items():
        if fields is not None and not (isinstance(fields, list) and all(
                isinstance(field, str) for field in fields)):
            raise web_request.error(
                "the fields of object '%s' are a list of names or null, not %r"
                % (name, fields))
    return dict(wanted)
