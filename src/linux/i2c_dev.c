/* SPDX-License-Identifier: GPL-3.0-or-later
 * I2C through /dev/i2c-<bus>: Documentation/i2c/dev-interface of the kernel. */
#include <errno.h>
#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "devices.h"
#include "process.h"

static int i2cdev_open(uint32_t bus)
{
    const char *path = process_path("dev/i2c-%u", bus);
    int fd = open(path, O_RDWR | O_CLOEXEC), error = errno;

    if (fd >= 0)
        return fd;
    process_log("%s cannot be opened: %s. Is I2C enabled on this computer, "
                "the module i2c-dev loaded, and may this user open it (group "
                "i2c)?", path, strerror(error));
    return -error;
}

/* Write and read in one transaction, with a repeated start between. */
static int i2cdev_transfer(int fd, uint8_t addr, uint8_t write_len,
                           const uint8_t *write, uint8_t read_len,
                           uint8_t *read)
{
    struct i2c_msg messages[2] = {
        { .addr = addr, .len = write_len, .buf = (uint8_t *)(uintptr_t)write },
        { .addr = addr, .flags = I2C_M_RD, .len = read_len, .buf = read },
    };
    struct i2c_rdwr_ioctl_data data = {
        .msgs = &messages[write_len ? 0 : 1],
        .nmsgs = (write_len ? 1u : 0u) + (read_len ? 1u : 0u),
    };

    return ioctl(fd, I2C_RDWR, &data) < 0 ? -errno : 0;
}

const struct i2c_device i2c_dev = {
    .open = i2cdev_open, .transfer = i2cdev_transfer,
};
