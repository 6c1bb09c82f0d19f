# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user can do about an error of an mcu, added to the state message."""

CONNECT_HELP = "Check the cable, the power of the board and the option 'serial'."
PROTOCOL_HELP = ("The firmware and the host do not fit together. Build the firmware\n"
                 "from the same version as the host and flash it again.")
ERROR_HELP = {"connect": CONNECT_HELP, "protocol": PROTOCOL_HELP}
REASON_HELP = {
    "ADC out of range": (
        "A temperature sensor reads below min_temp or above max_temp. Check the\n"
        "sensor and its wiring for a short or an open contact."),
    "Timer too close": (
        "The host asked for an event too late. Usual causes are a host that is\n"
        "overloaded or swaps, and a bad link to the board."),
    "Rescheduled timer in the past": (
        "The board could not keep up with the step rate. Lower the speed or the\n"
        "microsteps."),
    "Stepper too far in past": (
        "The board could not keep up with the step rate. Lower the speed or the\n"
        "microsteps."),
    "Missed scheduling of next": (
        "The board got a pin update too late. Usual causes are a host that is\n"
        "overloaded or swaps, and a bad link to the board."),
    "exceed max_duration": (
        "The host did not renew an output in time: it was stopped or overloaded."),
    "No next step": (
        "The host did not send steps in time: it was stopped or overloaded."),
    "Command request": (
        "The host asked the board to shut down; the reason is in the log."),
    "Watchdog timer": (
        "The firmware hung. Check the power supply of the board."),
    "Move queue overflow": (
        "More moves were sent than the board can hold; please report this with\n"
        "the log."),
}
EVENT_HELP = {
    "timeout": ("The board does not answer any more. Check its cable and power, and\n"
                "electric noise from heaters and motors."),
    "spontaneous_restart": (
        "The board restarted by itself. Check its power supply."),
}


def find_help(details):
    """Advice for the details of a shutdown; empty if there is none."""
    event_type = details.get("event_type", "")
    if event_type in EVENT_HELP:
        return EVENT_HELP[event_type]
    reason = details.get("reason", "")
    for key, text in REASON_HELP.items():
        if key in reason:
            return text
    return ""


class ErrorMcu:
    """Extends the state message after an error of an mcu."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self._kinds = {}
        self._clarifiers = []
        self.printer.register_event_handler(
            "klippy:analyze_shutdown", self._handle_shutdown)
        self.printer.register_event_handler(
            "klippy:notify_mcu_error", self._handle_error)

    def add_clarify(self, reason, callback):
        """Let callback(message, details) add a line (or None) for a reason."""
        self._clarifiers.append((reason, callback))

    def _handle_shutdown(self, message, details):
        if "event_type" not in details:
            return
        lines = [callback(message, details)
                 for reason, callback in self._clarifiers
                 if reason in details.get("reason", "")]
        self._insert(message, [find_help(details), *lines])

    def _handle_error(self, message, details):
        kind = details.get("event_type")
        if kind is not None:
            self._kinds[message] = kind
        kind = self._kinds.get(message)
        if kind in ERROR_HELP:
            self._insert(message, [ERROR_HELP[kind]])

    def _insert(self, message, lines):
        """Put lines behind the message in the printer's state."""
        text, _ = self.printer.get_state_message()
        lines = [line for line in lines if line]
        if text.startswith(message) and lines:
            self.printer.state_message = "\n".join(
                [message, *lines]) + text[len(message):]


def load_config(config):
    return ErrorMcu(config)
