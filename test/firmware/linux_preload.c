/* SPDX-License-Identifier: GPL-3.0-or-later
 * Preloaded into the linux firmware: an I2C bus that notes what is written to it,
 * and files that take long to read.
 *
 * I2C_LOG: file that gets a line "ADDRESS BYTES" in hex for each write; while
 * there is I2C_LOG.fail, nobody answers.  SLOW_READS: while there is such a file,
 * a pread() lasts two seconds.
 */
#include <errno.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <unistd.h>

static void note_write(const char *path, const struct i2c_msg *msg)
{
    FILE *file = fopen(path, "a");

    fprintf(file, "%02x ", msg->addr);
    for (int i = 0; i < msg->len; i++)
        fprintf(file, "%02x", msg->buf[i]);
    fputc('\n', file);
    fclose(file);
}

int ioctl(int fd, unsigned long request, ...)
{
    const char *log = getenv("I2C_LOG");
    const struct i2c_rdwr_ioctl_data *data;
    char fail[512];
    va_list args;
    void *arg;

    va_start(args, request);
    arg = va_arg(args, void *);
    va_end(args);
    if (request != I2C_RDWR || !log)
        return (int)syscall(SYS_ioctl, fd, request, arg);
    snprintf(fail, sizeof(fail), "%s.fail", log);
    if (!access(fail, F_OK)) {
        errno = EREMOTEIO;
        return -1;
    }
    data = arg;
    for (unsigned i = 0; i < data->nmsgs; i++)
        note_write(log, &data->msgs[i]);
    return (int)data->nmsgs;
}

ssize_t pread(int fd, void *buf, size_t size, off_t offset)
{
    const char *slow = getenv("SLOW_READS");

    if (slow && !access(slow, F_OK))
        sleep(2);
    return syscall(SYS_pread64, fd, buf, size, offset);
}
