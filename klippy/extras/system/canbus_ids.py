# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of the nodes on CAN buses; loaded by each [mcu] that is on one."""

from klippy import canlink


class NodeNumbers:
    """Gives each uuid a number that no other on its bus has."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self._ids = {}          # uuid: (interface, node id)

    def add_uuid(self, config, canbus_uuid, canbus_interface):
        """The number of a node that a section names.

        Raises config.error for a bad or doubled uuid, or a full bus.
        """
        try:
            uuid = canlink.parse_uuid(canbus_uuid)
        except canlink.error as err:
            raise config.error("Option 'canbus_uuid' in section '%s': %s"
                               % (config.get_name(), err)) from None
        if uuid in self._ids:
            raise config.error("canbus_uuid '%s' of section '%s' is that of another"
                               " [mcu] too" % (canbus_uuid, config.get_name()))
        used = sum(1 for name, _ in self._ids.values() if name == canbus_interface)
        node_id = canlink.FIRST_NODE + used
        if node_id > canlink.LAST_NODE:
            raise config.error("Too many mcus on '%s'" % (canbus_interface,))
        self._ids[uuid] = (canbus_interface, node_id)
        return node_id

    def get_nodeid(self, canbus_uuid):
        """The number of a uuid.  Raises the printer's error if it has none."""
        uuid = canlink.parse_uuid(canbus_uuid)
        if uuid not in self._ids:
            raise self.printer.command_error("Unknown canbus_uuid '%s'"
                                             % (canbus_uuid,))
        return self._ids[uuid][1]


def load_config(config):
    """Make the printer object canbus_ids."""
    return NodeNumbers(config)
