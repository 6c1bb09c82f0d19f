# SPDX-License-Identifier: GPL-3.0-or-later
"""Where an mcu is reached, by its config and the way the host was started."""

from klippy import seriallink
from klippy.errors import ConfigError, McuError

MIN_BAUD = 2400
DEFAULT_BAUD = 250000


class Connection:
    """Reads the options of one [mcu] section and opens its link."""

    def __init__(self, config, mcu_name):
        self.mcu_name = mcu_name
        self.start_args = config.get_printer().get_start_args()
        self.canbus_uuid = config.get("canbus_uuid", None)
        self.path, self.baud = None, 0
        if self.canbus_uuid is not None:
            self.canbus_interface = config.get("canbus_interface", "can0")
            numbers = config.get_printer().load_object(config, "canbus_ids")
            self.canbus_node = numbers.add_uuid(config, self.canbus_uuid,
                                                self.canbus_interface)
            return
        self.path = config.get("serial")
        self.baud = config.getint("baud", DEFAULT_BAUD, minval=MIN_BAUD)

    def is_fileoutput(self):
        """True if commands go to a file."""
        return self.start_args.get("debugoutput") is not None

    def get_machine(self):
        """The SimMachine, or None on a real printer."""
        return self.start_args.get("machine")

    def open(self, serial, rts=True):
        """Connect a SerialReader.  Raises McuError or ConfigError."""
        machine = self.get_machine()
        if self.is_fileoutput():
            self._open_file(serial)
        elif machine is not None:
            serial.connect_virtual(machine.world, machine.open_link(self.mcu_name))
        elif self.canbus_uuid is not None:
            serial.connect_canbus(self.canbus_uuid, self.canbus_node,
                                  self.canbus_interface)
        elif seriallink.is_socket(self.path):
            serial.connect_remote(self.path)
        elif seriallink.is_terminal(self.path):
            serial.connect_pipe(self.path)
        else:
            serial.connect_uart(self.path, self.baud, rts)

    def _open_file(self, serial):
        path = self._find_dictionary()
        try:
            with open(path, "rb") as source:
                dictionary = source.read()
        except OSError as err:
            raise McuError("Unable to read the dictionary '%s' of mcu '%s': %s"
                           % (path, self.mcu_name, err.strerror))
        output = self.start_args["debugoutput"]
        if self.mcu_name != "mcu" and output != "/dev/null":
            output = "%s-%s" % (output, self.mcu_name)
        serial.connect_file(output, dictionary)

    def _find_dictionary(self):
        """Path of the dictionary given by -d [mcu=]path."""
        given = self.start_args.get("dictionary") or {}
        path = given.get(self.mcu_name)
        if path is None and self.mcu_name == "mcu":
            path = given.get(None)
        if path is None:
            raise ConfigError(
                "No dictionary for mcu '%s': give one with -d %sPATH" % (
                    self.mcu_name,
                    "" if self.mcu_name == "mcu" else self.mcu_name + "="))
        return path
