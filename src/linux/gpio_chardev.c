/* SPDX-License-Identifier: GPL-3.0-or-later
 * Gpio lines of the kernel's character devices (uAPI version 2, Linux 5.10):
 * Documentation/userspace-api/gpio of the kernel. */
#include <errno.h>
#include <fcntl.h>
#include <linux/gpio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "devices.h"
#include "process.h"

#define CONSUMER "klipper_mcu"

/* One line, as the kernel wants it said. */
static struct gpio_v2_line_config line_config(const struct gpio_setting *set)
{
    static const uint64_t bias[] = {
        GPIO_V2_LINE_FLAG_BIAS_PULL_DOWN, GPIO_V2_LINE_FLAG_BIAS_DISABLED,
        GPIO_V2_LINE_FLAG_BIAS_PULL_UP,
    };
    struct gpio_v2_line_config config;

    memset(&config, 0, sizeof(config));
    if (!set->is_output) {
        config.flags = GPIO_V2_LINE_FLAG_INPUT | bias[set->pull + 1];
        return config;
    }
    config.flags = GPIO_V2_LINE_FLAG_OUTPUT;
    config.num_attrs = 1;
    config.attrs[0].mask = 1;
    config.attrs[0].attr.id = GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES;
    config.attrs[0].attr.values = set->level;
    return config;
}

static int request_line(int chip_fd, uint32_t line,
                        const struct gpio_setting *set)
{
    struct gpio_v2_line_request request;

    memset(&request, 0, sizeof(request));
    request.offsets[0] = line;
    request.num_lines = 1;
    request.config = line_config(set);
    strncpy(request.consumer, CONSUMER, sizeof(request.consumer) - 1);
    return ioctl(chip_fd, GPIO_V2_GET_LINE_IOCTL, &request) < 0 ? -errno
                                                                : request.fd;
}

/* Who holds the line?  "" if nobody is known. */
static void read_owner(int chip_fd, struct gpio_v2_line_info *info,
                       uint32_t line)
{
    memset(info, 0, sizeof(*info));
    info->offset = line;
    if (ioctl(chip_fd, GPIO_V2_GET_LINEINFO_IOCTL, info) < 0)
        info->consumer[0] = 0;
}

static void explain(int chip_fd, uint32_t chip, uint32_t line, int error)
{
    struct gpio_v2_line_info info;

    read_owner(chip_fd, &info, line);
    process_log("gpiochip%u/gpio%u cannot be had: %s%s%s. See gpioinfo for "
                "the lines that there are, and who holds them",
                chip, line, strerror(error),
                info.consumer[0] ? ", it belongs to " : "", info.consumer);
}

static int chardev_open(uint32_t chip, uint32_t line,
                        const struct gpio_setting *set)
{
    const char *path = process_path("dev/gpiochip%u", chip);
    int chip_fd = open(path, O_RDWR | O_CLOEXEC), fd;

    if (chip_fd < 0) {
        fd = -errno;
        process_log("%s cannot be opened: %s. Does the chip exist (gpiodetect)"
                    ", and may this user open it (group gpio)?",
                    path, strerror(-fd));
        return fd;
    }
    fd = request_line(chip_fd, line, set);
    if (fd < 0)
        explain(chip_fd, chip, line, -fd);
    else
        fcntl(fd, F_SETFD, FD_CLOEXEC);
    close(chip_fd);
    return fd;
}

static int chardev_configure(int fd, const struct gpio_setting *set)
{
    struct gpio_v2_line_config config = line_config(set);

    return ioctl(fd, GPIO_V2_LINE_SET_CONFIG_IOCTL, &config) < 0 ? -errno : 0;
}

static int chardev_write(int fd, uint8_t level)
{
    struct gpio_v2_line_values values = { .bits = level, .mask = 1 };

    return ioctl(fd, GPIO_V2_LINE_SET_VALUES_IOCTL, &values) < 0 ? -errno : 0;
}

static int chardev_read(int fd)
{
    struct gpio_v2_line_values values = { .mask = 1 };

    if (ioctl(fd, GPIO_V2_LINE_GET_VALUES_IOCTL, &values) < 0)
        return -errno;
    return values.bits & 1;
}

const struct gpio_device gpio_chardev = {
    .open = chardev_open, .configure = chardev_configure,
    .write = chardev_write, .read = chardev_read,
};
