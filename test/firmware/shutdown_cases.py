# SPDX-License-Identifier: GPL-3.0-or-later
"""What brings about each shutdown of the firmware: one table.

A script is a list of steps, one a line: a command with its parameters, or
`wait SECONDS`, or one that is not as it should be: `raw BYTES` are the content of a
block, `after COMMAND BYTES` are bytes behind the number of a command.  Parameters
that are left out are 0; `@N` is N ticks from the clock at that step; `hex:` starts a
byte string.  The last step is the one that shuts down.
"""

OIDS = "allocate_oids count=20\n"
DIGITAL = OIDS + ("config_digital_out oid=1 pin=5 max_duration=50000\n"
                  "finalize_config crc=1\n")
PWM = OIDS + ("config_pwm_out oid=1 pin=5 cycle_ticks=1000 max_duration=50000\n"
              "finalize_config crc=1\n")
STEPPER = OIDS + ("config_stepper oid=1 step_pin=1 dir_pin=2 step_pulse_ticks=40\n"
                  "config_trsync oid=2\nfinalize_config crc=1\n"
                  "reset_step_clock oid=1 clock=@10000\n")
SPI = OIDS + "config_spi oid=1 pin=3\n"
I2C = OIDS + "config_i2c oid=1\n"
ANGLE = SPI + "spi_set_bus oid=1 rate=1000000\nconfig_spi_angle oid=2 spi_oid=1\n"
BUTTONS = OIDS + "config_buttons oid=1 button_count=2\n"
FILTER = OIDS + "config_sos_filter oid=1 max_sections=2\n"
FILL = OIDS + "".join("config_neopixel oid=%d pin=4 data_size=32767\n" % i
                      for i in range(3))

CASES = {
    "ADC out of range": [
        OIDS + "config_analog_in oid=1 pin=4\nfinalize_config crc=1\n"
        "query_analog_in oid=1 clock=@1000 sample_ticks=10 sample_count=1"
        " rest_ticks=1000 bytes_per_report=2 min_value=5 max_value=9"
        " range_check_count=1\nwait .01"],
    "Already finalized": [
        OIDS + "finalize_config crc=1\nconfig_trsync oid=3"],
    "Can not set soft pwm cycle ticks while updates pending": [
        DIGITAL + "queue_digital_out oid=1 clock=@9000 on_ticks=1\n"
        "set_digital_out_pwm_cycle oid=1 cycle_ticks=1000",
        DIGITAL + "set_digital_out_pwm_cycle oid=1 cycle_ticks=1000\n"
        "queue_digital_out oid=1 clock=@9000 on_ticks=500\nwait .001\n"
        "set_digital_out_pwm_cycle oid=1 cycle_ticks=1000"],
    "Can't add signal that is already active": [
        STEPPER + "trsync_start oid=2\n"
        "stepper_stop_on_trigger oid=1 trsync_oid=2\n"
        "stepper_stop_on_trigger oid=1 trsync_oid=2"],
    "Can't assign oid": [
        OIDS + "config_trsync oid=20", "config_trsync oid=0",
        OIDS + "config_trsync oid=3\nconfig_trsync oid=3"],
    "Can't finalize": [
        "finalize_config crc=1",
        OIDS + "finalize_config crc=1\nfinalize_config crc=1"],
    "Can't reset time when stepper active": [
        STEPPER + "queue_step oid=1 interval=9000 count=3\n"
        "reset_step_clock oid=1 clock=@99000"],
    "Command parser error": [
        "raw hex:05", "raw hex:8180808080800105", "raw hex:0180",
        "after debug_ping hex:0961", "after debug_nop hex:8180808080800105",
        "after debug_nop hex:80"],
    "Command request": ["emergency_stop"],
    "Filter section index larger than max_sections": [
        FILTER + "sos_filter_set_section oid=1 section_idx=2",
        FILTER + "sos_filter_set_state oid=1 section_idx=2",
        FILTER + "sos_filter_set_active oid=1 n_sections=3"],
    "HX71x gain/channel out of range 1-4": [
        OIDS + "config_hx71x oid=1 gain_channel=0",
        OIDS + "config_hx71x oid=1 gain_channel=5"],
    "Invalid ads131m0x channels configuration": [
        SPI + "config_ads131m0x oid=2 spi_oid=1 num_channels=5",
        SPI + "config_ads131m0x oid=2 spi_oid=1 channel=4 num_channels=4"],
    "Invalid analog_in bytes_per_report": [
        OIDS + "config_analog_in oid=1\n"
        "query_analog_in oid=1 sample_count=1 bytes_per_report=%d" % size
        for size in (0, 3, 50)],
    "Invalid buttons retransmit count": [
        BUTTONS + "buttons_query oid=1 clock=@1000 rest_ticks=100"],
    "Invalid command": ["raw hex:9738", "raw hex:7b", "raw hex:00"],
    "Invalid count parameter": [STEPPER + "queue_step oid=1 interval=1000"],
    "Invalid filter fraction bits": [
        FILTER + "sos_filter_set_active oid=1 coeff_frac_bits=32",
        FILTER + "sos_filter_set_offset_scale oid=1 scale_frac_bits=32"],
    "Invalid i2c config": [
        I2C + "i2c_set_bus oid=1 rate=1 address=128",
        I2C + "i2c_set_bus oid=1 rate=1 address=1\n"
        "i2c_set_bus oid=1 rate=1 address=1",
        I2C + "i2c_transfer oid=1 read_len=1"],
    "Invalid i2c read length": [
        I2C + "i2c_set_bus oid=1 rate=1 address=1\n"
        "i2c_transfer oid=1 read_len=300"],
    "Invalid neopixel data_size": [OIDS + "config_neopixel oid=1 data_size=32768"],
    "Invalid neopixel update command": [
        OIDS + "config_neopixel oid=1 data_size=3\n"
        "neopixel_update oid=1 data=hex:01020304",
        OIDS + "config_neopixel oid=1 data_size=3\n"
        "neopixel_update oid=1 pos=2 data=hex:0102"],
    "Invalid oid type": [
        "trsync_start oid=0", OIDS + "trsync_start oid=3",
        DIGITAL + "trsync_start oid=1", OIDS + "trsync_start oid=20"],
    "Invalid spi bus": [SPI + "spi_set_bus oid=1 spi_bus=8"],
    "Invalid spi config": [
        SPI + "spi_set_bus oid=1 mode=4",
        SPI + "spi_set_bus oid=1\nspi_set_bus oid=1",
        SPI + "spi_transfer oid=1 data=hex:01"],
    "Invalid spi_angle chip type": [
        SPI + "config_spi_angle oid=2 spi_oid=1 spi_angle_type=200"],
    "Invalid spi_angle data length": [
        ANGLE + "spi_angle_transfer oid=2 data=hex:" + "00" * 53],
    "Invalid spi_angle time_shift": [
        ANGLE + "query_spi_angle oid=2 clock=@9 rest_ticks=9 time_shift=32"],
    "Invalid thermocouple chip type": [
        SPI + "config_thermocouple oid=2 spi_oid=1 thermocouple_type=4"],
    "Invalid trigger_analog type": [
        FILTER + "config_trigger_analog oid=2 sos_filter_oid=1\n"
        "trigger_analog_set_trigger oid=2 trigger_analog_type=200"],
    "Max of 8 buttons": [OIDS + "config_buttons oid=1 button_count=9"],
    "Message encode error": ["debug_ping data=hex:" + "61" * 57],
    "Missed scheduling of next digital out event": [
        DIGITAL + "queue_digital_out oid=1 clock=@9000 on_ticks=1\nwait .1"],
    "Missed scheduling of next hard pwm event": [
        PWM + "queue_pwm_out oid=1 clock=@9000 value=1\nwait .1"],
    "Move queue overflow": [
        STEPPER.replace("config_trsync oid=2", FILL.removeprefix(OIDS).replace(
            "oid=1 ", "oid=7 ") + "config_neopixel oid=8 data_size=32000")
        + "queue_step oid=1 interval=9999 count=9\n" * 200],
    "Not a valid ADC pin": [OIDS + "config_analog_in oid=1 pin=256"],
    "Not a valid PWM pin": [
        OIDS + "config_pwm_out oid=1 pin=256 cycle_ticks=1",
        "set_pwm_out pin=256 cycle_ticks=1"],
    "Not a valid input pin": [
        OIDS + "config_endstop oid=1 pin=256", OIDS + "config_endstop oid=1 pull_up=2",
        BUTTONS + "buttons_add oid=1 pin=300", OIDS + "config_counter oid=1 pin=256"],
    "Not an output pin": [
        OIDS + "config_digital_out oid=1 pin=256", "set_digital_out pin=256",
        OIDS + "config_stepper oid=1 step_pin=256 dir_pin=1",
        OIDS + "config_stepper oid=1 step_pin=1 dir_pin=256"],
    "Rescheduled timer in the past": [
        STEPPER.replace("dir_pin=2", "dir_pin=2 invert_step=255")
        .replace("pulse_ticks=40", "pulse_ticks=0")
        + "queue_step oid=1 interval=1000 count=1\n"
        "queue_step oid=1 interval=4294937296 count=2\nwait .1"],
    "Scheduled digital out event will exceed max_duration": [
        DIGITAL + "queue_digital_out oid=1 clock=@9000 on_ticks=1\n"
        "queue_digital_out oid=1 clock=@59001\nwait .1",
        DIGITAL + "queue_digital_out oid=1 clock=@9000 on_ticks=1\nwait .001\n"
        "queue_digital_out oid=1 clock=@59001"],
    "Scheduled pwm event will exceed max_duration": [
        PWM + "queue_pwm_out oid=1 clock=@9000 value=1\n"
        "queue_pwm_out oid=1 clock=@59001\nwait .1"],
    "Set button past maximum button count": [BUTTONS + "buttons_add oid=1 pos=2"],
    "Shutdown cleared when not shutdown": ["clear_shutdown"],
    "Stepper too far in past": [
        STEPPER + "queue_step oid=1 interval=1000 count=1\n"
        "queue_step oid=1 interval=4294937296 count=2\nwait .1"],
    "Thermocouple reader fault": [
        SPI + "spi_set_bus oid=1 rate=1000000\n"
        "config_thermocouple oid=2 spi_oid=1 thermocouple_type=1\n"
        "finalize_config crc=1\n"
        "query_thermocouple oid=2 clock=@1000 rest_ticks=1000 min_value=5"
        " max_value=9 max_invalid_count=1\nwait .01"],
    "Timer too close": [
        STEPPER + "wait .1\nqueue_step oid=1 interval=10 count=1",
        DIGITAL + "wait .1\nqueue_digital_out oid=1 clock=@-1 on_ticks=1",
        STEPPER + "trsync_start oid=2\ntrsync_set_timeout oid=2 clock=@-1"],
    "Unsupported i2c bus": [I2C + "i2c_set_bus oid=1 i2c_bus=8 rate=1"],
    "alloc_chunk failed": [FILL + "config_neopixel oid=9 data_size=32767"],
    "alloc_chunks failed": ["fill_arena\nfinalize_config crc=1"],
    "angle sensor requires cs pin": [
        OIDS + "config_spi_without_cs oid=1\n"
        "config_spi_angle oid=2 spi_oid=1"],
    "bus_type invalid": [SPI + "config_bmi160 oid=2 bus_oid=1 bus_oid_type=2"],
    "model type invalid": [SPI + "config_lis2dw oid=2 bus_oid=1 lis_chip_type=9"],
    "oids already allocated": [OIDS + "allocate_oids count=4"],
    "tmcuart data too large": [
        OIDS + "config_tmcuart oid=1 tx_pin=1 bit_time=100\n"
        "tmcuart_send oid=1 write=hex:%s read=%d" % (data, read)
        for data, read in (("00" * 11, 0), ("00", 11))],
    "update_digital_out not valid with active queue": [
        DIGITAL + "queue_digital_out oid=1 clock=@9000 on_ticks=1\n"
        "update_digital_out oid=1 value=1"],
}

# Not on the simulator: the file whose tests bring it about, and the test where
# that does not name the text.
LINUX = "test/firmware/test_fw_linux.py"
LINUX_DEVICES = "test/firmware/linux_devices.c"
SLOW_DEVICES = "test/firmware/test_fw_linux_slow_devices.py"
ELSEWHERE = {
    **dict.fromkeys(("Invalid sdio bus", "Invalid sdio buffer offset"),
                    "test/emulator/test_unicorn_sdio.py::test_refused"),
    "Invalid sdio block size":
        "test/emulator/test_unicorn_sdio.py::test_odd_block_sizes",
    "Analog input cannot be read": "test/firmware/test_fw_linux_devices.py",
    "Another CAN node assigned this ID":
        "test/emulator/test_unicorn_can.py::test_number_given_to_another_node",
    "Gpio cannot be an input": LINUX_DEVICES + "::test_line_that_fails",
    "Gpio cannot be driven": LINUX_DEVICES + "::test_line_that_fails",
    "Gpio read failed": LINUX_DEVICES + "::test_line_that_fails",
    "Gpio write failed": LINUX_DEVICES + "::test_line_that_fails",
    "Invalid SERCOM bus": "test/emulator/test_unicorn_samd.py",
    "Invalid SERCOM configuration": "test/emulator/test_unicorn_samd.py",
    "Mcu process was told to end": LINUX + "::test_end_puts_outputs_back",
    "Mcu reset": LINUX + "::test_reset_lets_go_of_outputs_first",
    "PWM already programmed at different speed":
        "test/emulator/test_unicorn_ports.py",
    "PRU does not support push/pull pins": "test/emulator/test_pru.py",
    "Spi mode cannot be set": LINUX_DEVICES + "::test_spi_that_fails",
    "Spi transfer failed": LINUX_DEVICES + "::test_spi_that_fails",
    **dict.fromkeys((
        "All PCA9685 channels must have the same cycle_ticks",
        "DS18B20 out of range", "DS18B20 sensor didn't respond in time",
        "Error reading DS18B20 sensor",
        "Invalid DS18B20 serial id, could not open for reading",
        "Invalid DS18B20 serial id, must not contain '/'",
        "Invalid pca9685 channel or value", "Invalid pca9685 value",
        "Missed scheduling of next pca9685 event",
        "Scheduled pca9685 event will exceed max_duration",
        "Unable to open and init PCA9685 device", "Unable to update PCA9685 value"),
        SLOW_DEVICES),
    "config_reset only available when shutdown": LINUX,
}

NO_CASE = {
    "Could not start DS18B20 reader thread":
        "the system has no room for another thread",
    "Invalid move request size":
        "guards the firmware's own code: whoever asks for cells makes an object"
        " first, and that fails with 'Already finalized'",
    "PWM channel already in use": "two pins of one channel on sam4; not emulated",
    "Pwm write failed":
        "the system takes a pwm's files away while they are open: sysfs only",
    "Sercom RX pad collides with TX or CLK pad":
        "a choice of pins on samd that no bus of the dictionary makes",
    "bus_type spi unsupported": "only in builds without any spi device",
    "bus_type i2c unsupported": "only in builds without any i2c device",
}
