/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pwm channels in sysfs: Documentation/ABI/testing/sysfs-class-pwm of the
 * kernel.  All times there are ns. */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "devices.h"
#include "pins.h"
#include "process.h"

#define CHIP "sys/class/pwm/pwmchip%u"
enum { NUMBER_SIZE = 24, UDEV_TRIES = 20, UDEV_WAIT_NS = 10000000 };

struct channel {
    uint32_t chip, number;
    int duty_fd;
};

static struct channel channels[PINS_PWM_CHIPS * PINS_PWM_CHANNELS];
static int channel_count;

static int write_number(int fd, uint64_t value)
{
    char text[NUMBER_SIZE];
    int len = snprintf(text, sizeof(text), "%" PRIu64, value);

    return pwrite(fd, text, (size_t)len, 0) == len ? 0 : -errno;
}

static int write_file(const char *path, uint64_t value)
{
    int fd = open(path, O_WRONLY | O_CLOEXEC), result;

    if (fd < 0)
        return -errno;
    result = write_number(fd, value);
    close(fd);
    return result;
}

/* After the export it takes udev a moment to give the group its rights. */
static int open_duty(uint32_t chip, uint32_t number)
{
    const struct timespec pause = { .tv_nsec = UDEV_WAIT_NS };
    const char *path = process_path(CHIP "/pwm%u/duty_cycle", chip, number);
    int fd = -1;

    for (int i = 0; i < UDEV_TRIES; i++) {
        fd = open(path, O_WRONLY | O_CLOEXEC);
        if (fd >= 0 || (errno != EACCES && errno != ENOENT))
            break;
        nanosleep(&pause, NULL);
    }
    return fd < 0 ? -errno : fd;
}

static int sysfs_open(uint32_t chip, uint32_t number)
{
    struct channel *channel = &channels[channel_count];
    struct stat info;
    int result = 0;

    if (stat(process_path(CHIP "/pwm%u", chip, number), &info))
        result = write_file(process_path(CHIP "/export", chip), number);
    if (result >= 0)
        result = open_duty(chip, number);
    if (result < 0) {
        process_log("pwmchip%u/pwm%u cannot be had: %s. Is there such a "
                    "channel in /sys/class/pwm, and may this user write "
                    "there?", chip, number, strerror(-result));
        return result;
    }
    *channel = (struct channel){ chip, number, result };
    return channel_count++;
}

/* The kernel wants on-time <= cycle at any moment: through zero. */
static int sysfs_set_cycle(int handle, uint64_t cycle_ns, uint64_t on_ns)
{
    const struct channel *c = &channels[handle];
    int result;

    write_number(c->duty_fd, 0);
    result = write_file(process_path(CHIP "/pwm%u/period", c->chip,
                                     c->number), cycle_ns);
    if (result >= 0)
        result = write_number(c->duty_fd, on_ns);
    if (result >= 0)
        result = write_file(process_path(CHIP "/pwm%u/enable", c->chip,
                                         c->number), 1);
    if (result < 0)
        process_log("pwmchip%u/pwm%u refuses a cycle of %" PRIu64 " ns: %s",
                    c->chip, c->number, cycle_ns, strerror(-result));
    return result;
}

static int sysfs_set_on(int handle, uint64_t on_ns)
{
    return write_number(channels[handle].duty_fd, on_ns);
}

const struct pwm_device pwm_sysfs = {
    .open = sysfs_open, .set_cycle = sysfs_set_cycle, .set_on = sysfs_set_on,
};
