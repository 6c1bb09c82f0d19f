# SPDX-License-Identifier: GPL-3.0-or-later
"""API socket: endpoints, and the printer's own ones.

Requests are JSON objects that end with the byte 0x03; see
docs/internals/webhooks.md.  Connections live in api_socket.py, the status of
objects in api_objects.py.
"""

import logging
import os
import sys

from klippy import api_objects, api_socket, dangers, sysinfo
from klippy.api_encoding import PushTemplate, encode_json
from klippy.errors import PrinterError, describe

__all__ = ["WebHooks", "WebRequest", "WebRequestError", "get", "setup"]

REQUIRED = object()


class WebRequestError(PrinterError):
    """A request that cannot be fulfilled; its text goes to the client."""


class WebRequest:
    """One request of a client and its answer.

    Raises WebRequestError unless message is a dict with a text `method` and,
    if any, a dict `params`.
    """
    error = WebRequestError

    def __init__(self, client, message):
        if not isinstance(message, dict):
            raise WebRequestError("a request is a JSON object, not %s"
                                  % (type(message).__name__,))
        self.client = client
        self.id = message.get("id")
        self.method = message.get("method")
        self.params = message.get("params", {})
        self.response = None
        if not isinstance(self.method, str):
            raise WebRequestError("a request needs a text 'method', not %r"
                                  % (self.method,))
        if self.params is None:
            self.params = {}
        if not isinstance(self.params, dict):
            raise WebRequestError("'params' is a JSON object, not %s"
                                  % (type(self.params).__name__,))

    def get_client_connection(self):
        """The ClientConnection that asks."""
        return self.client

    def get_method(self):
        """The endpoint's path."""
        return self.method

    def get(self, item, default=REQUIRED, types=None):
        """One parameter, which must be of one of the types (None: any)."""
        value = self.params.get(item, REQUIRED)
        if value is REQUIRED:
            if default is REQUIRED:
                raise WebRequestError("%s needs the parameter '%s'"
                                      % (self.method, item))
            return default
        is_stray_bool = isinstance(value, bool) and types and bool not in types
        if types is not None and (
                is_stray_bool or not isinstance(value, tuple(types))):
            if value is None and default is None:
                return None
            raise WebRequestError(
                "the parameter '%s' of %s must be of type %s, not %r" % (
                    item, self.method, "/".join(t.__name__ for t in types), value))
        return value

    def get_str(self, item, default=REQUIRED):
        return self.get(item, default, (str,))

    def get_int(self, item, default=REQUIRED):
        return self.get(item, default, (int,))

    def get_float(self, item, default=REQUIRED):
        value = self.get(item, default, (int, float))
        try:
            return float(value) if isinstance(value, int) else value
        except OverflowError:
            raise WebRequestError("the parameter '%s' of %s is too large"
                                  % (item, self.method))

    def get_dict(self, item, default=REQUIRED):
        return self.get(item, default, (dict,))

    def get_list(self, item, default=REQUIRED):
        return self.get(item, default, (list,))

    def send(self, data):
        """Set the result; only once."""
        if self.response is not None:
            raise WebRequestError("%s was answered already" % (self.method,))
        self.response = data

    def finish(self):
        """The result; an empty object if none was set."""
        return {} if self.response is None else self.response


class WebHooks:
    """The endpoints and what clients registered."""
    error = WebRequestError

    def __init__(self, printer):
        self.printer = printer
        self._endpoints = {}
        self._mux_endpoints = {}
        self._remote_methods = {}       # method -> {client: PushTemplate}
        for path, callback in (
                ("list_endpoints", self._list_endpoints),
                ("info", self._get_info),
                ("emergency_stop", self._stop),
                ("register_remote_method", self._register_remote_method)):
            self.register_endpoint(path, callback)
        self.objects = api_objects.StatusApi(printer, self)
        self.server = api_socket.ApiServer(printer, self)

    # Registration

    def register_endpoint(self, path, callback):
        """Have callback(web_request) answer the requests for path."""
        if path in self._endpoints:
            raise self.printer.config_error(
                "API endpoint %s is already registered" % (path,))
        self._endpoints[path] = callback

    def register_mux_endpoint(self, path, key, value, callback):
        """Have callback answer the requests for path whose key is value.

        value None: also those without the key.
        """
        if path not in self._mux_endpoints:
            self.register_endpoint(path, self._run_mux)
            self._mux_endpoints[path] = (key, {})
        known_key, callbacks = self._mux_endpoints[path]
        if known_key != key:
            raise self.printer.config_error(
                "API endpoint %s is selected by %s, not by %s"
                % (path, known_key, key))
        if value in callbacks:
            raise self.printer.config_error(
                "API endpoint %s %s=%s is already registered" % (path, key, value))
        callbacks[value] = callback

    def _run_mux(self, web_request):
        key, callbacks = self._mux_endpoints[web_request.get_method()]
        if None in callbacks:
            value = web_request.get(key, None)
        else:
            value = web_request.get(key)
        if not isinstance(value, (str, type(None))) or value not in callbacks:
            raise web_request.error("%s has no %s %r" % (
                web_request.get_method(), key, value))
        callbacks[value](web_request)

    def find_callback(self, path):
        """The callback of an endpoint.  Raises WebRequestError if unknown."""
        callback = self._endpoints.get(path)
        if callback is None:
            raise WebRequestError("webhooks: there is no method '%s'" % (path,))
        return callback

    def register_gcode_endpoints(self, gcode):
        """Add the endpoints that need the G-code dispatcher."""
        GCodeApi(self.printer, self, gcode)

    # Clients

    def answer(self, client, message, is_overloaded=False):
        """Run a request of a client: the dispatch point of the API.

        message: decoded JSON.  is_overloaded: the client has so many requests
        that wait that only an emergency stop is obeyed.
        Returns the reply, None if none is wanted.
        """
        reply = {"id": message.get("id") if isinstance(message, dict) else None}
        if isinstance(reply["id"], (dict, list)):
            logging.warning("API %s: the id of a request is a number or text, not"
                            " %.200r", client.name, reply["id"])
            return None
        try:
            request = WebRequest(client, message)
            if is_overloaded and request.get_method() != "emergency_stop":
                raise WebRequestError("too many requests of this client wait")
            self.find_callback(request.get_method())(request)
            reply["result"] = request.finish()
        except PrinterError as err:
            reply["error"] = {"error": type(err).__name__, "message": str(err)}
        except Exception as err:
            logging.exception("API %s: internal error in %.500r", client.name, message)
            reply["error"] = {
                "error": "WebRequestError",
                "message": "internal error: %s: %s" % (type(err).__name__, err)}
        return reply if reply["id"] is not None else None

    def call_remote_method(self, method, **kwargs):
        """Call a method that clients registered.

        Raises CommandError if no connected client has.
        """
        templates = self._remote_methods.get(method)
        if templates is None:
            raise self.printer.command_error(
                "Remote method '%s' is not registered" % (method,))
        for client in [c for c in templates if c.is_closed()]:
            del templates[client]
        if not templates:
            del self._remote_methods[method]
            raise self.printer.command_error(
                "No client with the remote method '%s' is connected" % (method,))
        params = encode_json(kwargs)
        for client, template in list(templates.items()):
            client.send_encoded(template.make(params))

    def get_status(self, eventtime):
        """state and state_message of the printer."""
        message, state = self.printer.get_state_message()
        return {"state": state, "state_message": message}

    # Endpoints

    def _list_endpoints(self, web_request):
        web_request.send({"endpoints": sorted(self._endpoints)})

    def _get_info(self, web_request):
        client_info = web_request.get_dict("client_info", None)
        if client_info is not None:
            web_request.get_client_connection().note_client_info(client_info)
        message, state = self.printer.get_state_message()
        answer = {
            "state": state, "state_message": message,
            "hostname": os.uname().nodename, "klipper_path": sysinfo.ROOT,
            "python_path": sys.executable, "process_id": os.getpid(),
            "user_id": os.getuid(), "group_id": os.getgid(), "app": "Klipper",
            "errors": []}
        if state == "error":
            answer["errors"] = [describe(err) for err in self.printer.load_errors]
        start_args = self.printer.get_start_args()
        for key in ("log_file", "config_file", "software_version", "cpu_info"):
            answer[key] = start_args.get(key)
        web_request.send(answer)

    def _stop(self, web_request):
        self.printer.invoke_shutdown("Shutdown due to webhooks request")

    def _register_remote_method(self, web_request):
        template = web_request.get_dict("response_template")
        method = web_request.get_str("remote_method")
        client = web_request.get_client_connection()
        self._remote_methods.setdefault(method, {})[client] = PushTemplate(template)
        if dangers.get(self.printer).log_webhook_method_register_messages:
            logging.info("API %s: remote method '%s' registered", client.name, method)


class GCodeApi:
    """Endpoints that run G-code and pass on its output."""

    def __init__(self, printer, webhooks, gcode):
        self.printer, self.gcode = printer, gcode
        self.templates = {}             # client -> PushTemplate
        for path, callback in (
                ("gcode/help", self._get_help), ("gcode/script", self._run_script),
                ("gcode/restart", self._restart),
                ("gcode/firmware_restart", self._firmware_restart),
                ("gcode/subscribe_output", self._subscribe_output)):
            webhooks.register_endpoint(path, callback)

    def _get_help(self, web_request):
        web_request.send(self.gcode.get_command_help())

    def _run_script(self, web_request):
        self.gcode.run_script(web_request.get_str("script"))

    def _restart(self, web_request):
        self.gcode.run_script("RESTART")

    def _firmware_restart(self, web_request):
        self.gcode.run_script("FIRMWARE_RESTART")

    def _subscribe_output(self, web_request):
        template = web_request.get_dict("response_template", {})
        if not self.templates:
            self.gcode.register_output_handler(self._pass_on)
        self.templates[web_request.get_client_connection()] = PushTemplate(template)

    def _pass_on(self, text):
        params = encode_json({"response": text})
        for client, template in list(self.templates.items()):
            if client.is_closed():
                del self.templates[client]
            else:
                client.send_encoded(template.make(params))


def setup(printer):
    """Create the printer's WebHooks and add it as object `webhooks`.

    Comes after gcode.setup().
    """
    webhooks = WebHooks(printer)
    printer.add_object("webhooks", webhooks)
    gcode = printer.lookup_object("gcode", None)
    if gcode is None:
        logging.warning("API socket without G-code: the dispatcher comes later")
    else:
        webhooks.register_gcode_endpoints(gcode)
    return webhooks


def get(printer):
    """The printer's WebHooks."""
    return printer.lookup_object("webhooks")
