# SPDX-License-Identifier: GPL-3.0-or-later
"""[multi_pin name]: several outputs that any section uses like one.

The pin `multi_pin:name` of another section stands for all pins of the list.
"""
CHIP = "multi_pin"
PIN_TYPES = ("digital_out", "pwm")


class MultiPinChip:
    """The pin chip `multi_pin`, shared by all sections of that name."""

    def __init__(self, printer):
        self.printer = printer
        self.pins_of = {}

    def add(self, name, descriptions):
        self.pins_of[name] = descriptions

    def setup_pin(self, pin_type, pin_params):
        """The group of a name, as a digital_out or pwm pin."""
        ppins = self.printer.lookup_object("pins")
        name = pin_params["pin"]
        if name not in self.pins_of:
            raise self.printer.config_error(
                "Pin 'multi_pin:%s': there is no section [multi_pin %s] above the"
                " one that uses it, only: %s"
                % (name, name, ", ".join(sorted(self.pins_of))))
        if pin_type not in PIN_TYPES:
            raise self.printer.config_error(
                "Pin 'multi_pin:%s' cannot be a %s: several pins together are"
                " outputs, digital_out or pwm" % (name, pin_type))
        return PinGroup([
            ppins.setup_pin(pin_type, invert(text) if pin_params["invert"] else text)
            for text in self.pins_of[name]])


def invert(description):
    """The description of the same pin the other way round."""
    text = description.strip()
    return text[1:] if text.startswith("!") else "!" + text


class PinGroup:
    """Outputs that are set up and switched together."""

    def __init__(self, members):
        self.members = members

    def get_mcu(self):
        """The mcu of the first pin."""
        return self.members[0].get_mcu()

    def setup_max_duration(self, max_duration):
        for pin in self.members:
            pin.setup_max_duration(max_duration)

    def setup_expiry(self, callback):
        for pin in self.members:
            pin.setup_expiry(callback)

    def setup_start_value(self, start_value, shutdown_value):
        for pin in self.members:
            pin.setup_start_value(start_value, shutdown_value)

    def setup_cycle_time(self, cycle_time, hardware_pwm=False):
        for pin in self.members:
            pin.setup_cycle_time(cycle_time, hardware_pwm)

    def set_digital(self, print_time, value):
        for pin in self.members:
            pin.set_digital(print_time, value)

    def set_pwm(self, print_time, value):
        for pin in self.members:
            pin.set_pwm(print_time, value)


class PrinterMultiPin:
    """A named list of pins."""

    def __init__(self, config):
        printer = config.get_printer()
        name = config.get_name().split(None, 1)[1]
        ppins = printer.lookup_object("pins")
        texts = [text for text in config.getlist("pins") if text]
        if not texts:
            raise config.error("Option 'pins' in section '%s' names no pin"
                               % (config.get_name(),))
        for text in texts:
            ppins.parse_pin(text, can_invert=True)
        find_chip(ppins, printer).add(name, texts)


def find_chip(ppins, printer):
    """The chip of this printer; the first section makes it."""
    chip = ppins.chips.get(CHIP)
    if chip is None:
        chip = MultiPinChip(printer)
        ppins.register_chip(CHIP, chip)
    return chip


def load_config_prefix(config):
    return PrinterMultiPin(config)
