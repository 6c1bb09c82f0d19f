# SPDX-License-Identifier: GPL-3.0-or-later
"""The values of sensor_type, and which of them go together.

A room shows a few of the types; those that the same module makes need the same
options.  Sensors that a config defines itself have any name: nothing is known.
"""

from klippy.schema.explore import load_printer

SENSOR_TYPE = "sensor_type"


def read_sensor_types(rooms):
    """{value of sensor_type: name of the module that makes such sensors}."""
    for room in rooms:
        printer = load_printer(room.store, room.supply)
        heaters = printer.lookup_object("heaters", None)
        factories = dict(heaters.sensor_factories) if heaters is not None else {}
        printer.send_event("klippy:disconnect")
        printer.get_reactor().finalize()
        if factories:       # they are there when one section has a sensor
            return {name: find_module(factory) for name, factory in factories.items()}
    return {}


def find_module(factory):
    """Name of the module of a function, a method, or one with arguments bound."""
    return getattr(getattr(factory, "func", factory), "__module__", "")


def make_sensor_condition(states, types):
    """JSON Schema that holds for a sensor like those of some types."""
    modules = {types[state] for state in states if state in types}
    alike = sorted(name for name, module in types.items() if module in modules)
    return {"properties": {SENSOR_TYPE: {"enum": alike}}, "required": [SENSOR_TYPE]}
