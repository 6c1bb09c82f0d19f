/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI through /dev/spidev<bus>.<select>: Documentation/spi/spidev of the
 * kernel. */
#include <errno.h>
#include <fcntl.h>
#include <linux/spi/spidev.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "devices.h"
#include "process.h"

static int spidev_open(uint32_t bus, uint32_t select)
{
    const char *path = process_path("dev/spidev%u.%u", bus, select);
    int fd = open(path, O_RDWR | O_CLOEXEC), error = errno;

    if (fd >= 0)
        return fd;
    process_log("%s cannot be opened: %s. Is SPI enabled on this computer, "
                "and may this user open it (group spi)?",
                path, strerror(error));
    return -error;
}

static int spidev_set_mode(int fd, uint8_t mode)
{
    return ioctl(fd, SPI_IOC_WR_MODE, &mode) < 0 ? -errno : 0;
}

static int spidev_transfer(int fd, uint32_t rate, const uint8_t *tx,
                           uint8_t *rx, uint8_t len)
{
    struct spi_ioc_transfer transfer;

    memset(&transfer, 0, sizeof(transfer));
    transfer.tx_buf = (uintptr_t)tx;
    transfer.rx_buf = (uintptr_t)rx;
    transfer.len = len;
    transfer.speed_hz = rate;
    transfer.bits_per_word = 8;
    return ioctl(fd, SPI_IOC_MESSAGE(1), &transfer) < 0 ? -errno : 0;
}

const struct spi_device spi_dev = {
    .open = spidev_open, .set_mode = spidev_set_mode,
    .transfer = spidev_transfer,
};
