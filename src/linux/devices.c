/* SPDX-License-Identifier: GPL-3.0-or-later
 * The choice between this computer's devices and the fake board. */
#include "devices.h"
#include "process.h"

struct devices devices = {
    .gpio = &gpio_chardev, .pwm = &pwm_sysfs, .adc = &adc_iio,
    .spi = &spi_dev, .i2c = &i2c_dev,
};

int devices_open(void)
{
    if (!process_options.fake)
        return 0;
    devices = fake_devices;
    return fake_open(process_options.fake);
}
