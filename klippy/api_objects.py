# SPDX-License-Identifier: GPL-3.0-or-later
"""API endpoints for the status of printer objects: list, query, subscribe.

Objects return a new value where a status field changes; a value that is the
same object as before counts as unchanged.  Clients that follow the same fields
at the same rate share the work: see Follower.
"""

import logging
import math

from klippy.api_encoding import PushTemplate, encode_json

SUBSCRIPTION_PERIOD = 0.25          # s, unless a client asks for another
MIN_PERIOD = 0.01
_UNKNOWN = object()


class StatusApi:
    """Answers queries at once and sends subscribers what changed."""

    def __init__(self, printer, webhooks):
        self.printer = printer
        self.reactor = printer.get_reactor()
        self.followers = []
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
        period = read_period(web_request)
        template = web_request.get_dict("response_template", {})
        client = web_request.get_client_connection()
        for follower in self.followers:
            follower.templates.pop(client, None)
        answer = self._answer(StatusReader(self), wanted)
        web_request.send(answer)
        if not wanted:
            return
        # a copy: the answer is encoded later and belongs to others
        follower = Follower(wanted, period, dict(answer["status"]))
        follower.templates[client] = PushTemplate(template)
        follower.plan(self.reactor.monotonic())
        self.followers.append(follower)
        if self.timer is None:
            self.timer = self.reactor.register_timer(self._send_changes)
        waketime = min(f.next_time for f in self.followers)
        self.reactor.update_timer(self.timer, waketime)

    def _answer(self, reader, wanted):
        status = {name: reader.read(name, fields) for name, fields in wanted.items()}
        return {"eventtime": reader.eventtime, "status": status}

    def _send_changes(self, eventtime):
        """Serve the followers that are due; those of one kind become one."""
        reader, kinds, kept = StatusReader(self), {}, []
        for follower in self.followers:
            if follower.next_time <= eventtime and follower.forget_closed():
                follower.send_changes(reader)
                follower.plan(eventtime)
                same = kinds.setdefault(follower.key, follower)
                if same is not follower:
                    same.templates.update(follower.templates)
                    continue
            if follower.templates:
                kept.append(follower)
        self.followers = kept
        if not kept:
            timer, self.timer = self.timer, None
            self.reactor.unregister_timer(timer)
            return self.reactor.NEVER
        return min(follower.next_time for follower in kept)

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


class Follower:
    """Clients that follow the same fields at the same rate, and what they know.

    A client begins with a Follower of its own, as what it knows is newer than
    what the others know, and joins theirs after its first round: then all know
    the same.  Rounds fall on multiples of the period, so they coincide.
    """

    def __init__(self, wanted, period, status):
        self.wanted, self.period, self.last = wanted, period, status
        self.key = period, tuple((name, None if fields is None else tuple(fields))
                                 for name, fields in sorted(wanted.items()))
        self.templates = {}             # client -> PushTemplate
        self.next_time = 0.

    def plan(self, eventtime):
        """Choose the time of the next round: after eventtime."""
        self.next_time = (math.floor(eventtime / self.period + 1e-6) + 1) * self.period

    def forget_closed(self):
        """Drop clients that are gone; False if nobody is left."""
        for client in [c for c in self.templates if c.is_closed()]:
            del self.templates[client]
        return bool(self.templates)

    def send_changes(self, reader):
        """Push the fields that differ from the ones sent before."""
        changes = {}
        for name, fields in self.wanted.items():
            current, last = reader.read(name, fields), self.last.get(name, {})
            self.last[name] = current
            changed = find_changes(last, current)
            if changed:
                changes[name] = changed
        if not changes:
            return
        params = encode_json({"eventtime": reader.eventtime, "status": changes})
        for client, template in list(self.templates.items()):
            client.send_encoded(template.make(params))


def find_changes(last, current):
    """The fields of a status (dict) that differ from those of the last one."""
    try:
        return {field: value for field, value in current.items()
                if (known := last.get(field, _UNKNOWN)) is not value
                and known != value}
    except ValueError:      # arrays differ in many ways: send them again
        return current


def read_period(web_request):
    """The request's `interval` (s between rounds), the usual one without it."""
    period = web_request.get_float("interval", SUBSCRIPTION_PERIOD)
    if not MIN_PERIOD <= period <= 3600.:
        raise web_request.error("'interval' is %g to 3600 s, not %r"
                                % (MIN_PERIOD, period))
    return period


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
