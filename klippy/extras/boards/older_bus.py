# SPDX-License-Identifier: GPL-3.0-or-later
"""Buses of older firmware, whose commands had other names and fields.

Software buses were told a rate, not the ticks of half a period; I2C had one command
to write and one to read, and no answer that tells errors: firmware shut down instead.
"""

SPI_SW = ("spi_set_software_bus oid=%c miso_pin=%u mosi_pin=%u sclk_pin=%u mode=%u"
          " rate=%u")
I2C_SW = "i2c_set_software_bus oid=%c scl_pin=%u sda_pin=%u rate=%u address=%u"
I2C_WRITE = "i2c_write oid=%c data=%*s"
I2C_READ = "i2c_read oid=%c reg=%*s read_len=%u"
I2C_READ_RESPONSE = "i2c_read_response oid=%c response=%*s"


def has(mcu, msgformat):
    """True if the firmware of an mcu has a command."""
    return mcu.try_lookup_command(msgformat) is not None


def add_spi_sw(mcu, oid, pins, mode, rate):
    """Set up SPI on three pins (miso, mosi, sclk).  False: firmware is newer."""
    if not has(mcu, SPI_SW):
        return False
    mcu.add_config_cmd("spi_set_software_bus oid=%d miso_pin=%s mosi_pin=%s sclk_pin=%s"
                       " mode=%d rate=%d" % (oid, *pins, mode, rate))
    return True


def add_i2c_sw(mcu, oid, pins, rate, address):
    """Set up I2C on two pins (scl, sda).  False: firmware is newer."""
    if not has(mcu, I2C_SW):
        return False
    mcu.add_config_cmd("i2c_set_software_bus oid=%d scl_pin=%s sda_pin=%s rate=%d"
                       " address=%d" % (oid, *pins, rate, address))
    return True


class OlderTransfer:
    """i2c_transfer by the older commands: as its command, and as its query."""

    def __init__(self, mcu, oid, queue):
        self._write = mcu.lookup_command(I2C_WRITE, cq=queue)
        self._read = mcu.lookup_query_command(
            I2C_READ, I2C_READ_RESPONSE, oid=oid, cq=queue)
        self.query = OlderQuery(self._write, self._read)

    def send(self, data=(), minclock=0, reqclock=0):
        """Write: data is oid, bytes, 0."""
        self._write.send(data[:2], minclock=minclock, reqclock=reqclock)


class OlderQuery:
    """Waits for the answer."""

    def __init__(self, write, read):
        self._write, self._read = write, read

    def send(self, data=(), minclock=0, reqclock=0, retry=True):
        """Write, then read: data is oid, bytes, count.  Returns a response's fields."""
        if not data[2]:
            self._write.send_wait_ack(data[:2], minclock=minclock, reqclock=reqclock)
            return {"i2c_bus_status": "SUCCESS", "response": b""}
        params = self._read.send(data, minclock=minclock, reqclock=reqclock,
                                 retry=retry)
        return {"i2c_bus_status": "SUCCESS", "response": params["response"]}
