/* SPDX-License-Identifier: GPL-3.0-or-later
 * Tests of what the linux firmware says to the kernel: gpio lines, spidev and
 * i2c-dev, with open(), close() and ioctl() caught by the linker (--wrap).
 *
 * The kernel's side keeps what it was told and answers as told.  usage: the
 * program, without arguments; status 1 after the first check that fails.
 */
#include <errno.h>
#include <fcntl.h>
#include <linux/gpio.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <linux/spi/spidev.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>

#undef I2C_TIMEOUT /* an ioctl of the kernel, a result of ours */
#include "board/gpio.h"
#include "board/i2c.h"
#include "board/spi.h"
#include "core/sched.h"
#include "devices.h"
#include "process.h"

#define CHECK(CONDITION) check(!!(CONDITION), #CONDITION, __func__, __LINE__)

enum { CHIP_FD = 1000, LINE_FD = 1001, BUS_FD = 1002, COPY_SIZE = 64 };

struct kernel {
    int error;                /* answer of the next ioctl: 0 or errno */
    int open_error;
    char path[128];
    unsigned long request;
    int fd, n_calls, n_closed;
    uint64_t value;           /* that a line reads */
    struct gpio_v2_line_request line;
    struct gpio_v2_line_config config;
    struct gpio_v2_line_values values;
    struct spi_ioc_transfer spi;
    uint8_t mode, sent[COPY_SIZE];
    struct i2c_msg messages[2];
    unsigned n_messages;
};

static struct kernel kernel;
static char last_log[512];
static jmp_buf shut_down;
static bool is_shutdown;
uint32_t clock_max_step_lag_us;
struct process_options process_options = { .root = "/root" };
struct devices devices = {
    .gpio = &gpio_chardev, .spi = &spi_dev, .i2c = &i2c_dev,
};

static void check(int holds, const char *what, const char *where, int line)
{
    if (holds)
        return;
    printf("%s:%d: not so: %s\n", where, line, what);
    exit(1);
}


/* ---- The kernel ---- */

int __wrap_open(const char *path, int flags, ...);
int __wrap_close(int fd);
int __wrap_ioctl(int fd, unsigned long request, ...);

int __wrap_open(const char *path, int flags, ...)
{
    CHECK(flags & O_CLOEXEC);
    snprintf(kernel.path, sizeof(kernel.path), "%s", path);
    errno = kernel.open_error;
    if (kernel.open_error)
        return -1;
    return strstr(path, "gpiochip") ? CHIP_FD : BUS_FD;
}

int __wrap_close(int fd)
{
    CHECK(fd == CHIP_FD);
    kernel.n_closed++;
    return 0;
}

static void keep_i2c(const struct i2c_rdwr_ioctl_data *data)
{
    kernel.n_messages = data->nmsgs;
    for (unsigned i = 0; i < data->nmsgs; i++) {
        kernel.messages[i] = data->msgs[i];
        if (data->msgs[i].flags & I2C_M_RD)
            memset(data->msgs[i].buf, 0xa5, data->msgs[i].len);
        else
            memcpy(kernel.sent, data->msgs[i].buf, data->msgs[i].len);
    }
}

static void keep_spi(struct spi_ioc_transfer *transfer)
{
    kernel.spi = *transfer;
    memcpy(kernel.sent, (void *)(uintptr_t)transfer->tx_buf, transfer->len);
    if (transfer->rx_buf)
        memset((void *)(uintptr_t)transfer->rx_buf, 0x5a, transfer->len);
}

static void name_owner(struct gpio_v2_line_info *info)
{
    strcpy(info->consumer, "the-other-one");
}

static void keep(unsigned long request, void *data)
{
    struct gpio_v2_line_values *values = data;

    switch (request) {
    case GPIO_V2_GET_LINE_IOCTL:
        kernel.line = *(struct gpio_v2_line_request *)data;
        ((struct gpio_v2_line_request *)data)->fd = LINE_FD;
        break;
    case GPIO_V2_LINE_SET_CONFIG_IOCTL:
        kernel.config = *(struct gpio_v2_line_config *)data;
        break;
    case GPIO_V2_LINE_SET_VALUES_IOCTL:
        kernel.values = *values;
        break;
    case GPIO_V2_LINE_GET_VALUES_IOCTL:
        CHECK(values->mask == 1);
        values->bits = kernel.value;
        break;
    case GPIO_V2_GET_LINEINFO_IOCTL: name_owner(data); break;
    case SPI_IOC_WR_MODE: kernel.mode = *(uint8_t *)data; break;
    case SPI_IOC_MESSAGE(1): keep_spi(data); break;
    case I2C_RDWR: keep_i2c(data); break;
    default: CHECK(!"an ioctl that is known");
    }
}

int __wrap_ioctl(int fd, unsigned long request, ...)
{
    va_list args;
    void *data;

    va_start(args, request);
    data = va_arg(args, void *);
    va_end(args);
    kernel.fd = fd;
    kernel.request = request;
    kernel.n_calls++;
    errno = kernel.error;
    if (kernel.error && request != GPIO_V2_GET_LINEINFO_IOCTL)
        return -1;
    keep(request, data);
    return 0;
}


/* ---- What the port needs besides ---- */

void process_log(const char *fmt, ...)
{
    va_list args;

    va_start(args, fmt);
    vsnprintf(last_log, sizeof(last_log), fmt, args);
    va_end(args);
}

const char *process_path(const char *fmt, ...)
{
    static char path[128];
    va_list args;

    va_start(args, fmt);
    strcpy(path, "/root/");
    vsnprintf(path + 6, sizeof(path) - 6, fmt, args);
    va_end(args);
    return path;
}

void sched_shutdown(uint16_t reason)
{
    (void)reason;
    is_shutdown = true;
    longjmp(shut_down, 1);
}

void sched_try_shutdown(uint16_t reason)
{
    (void)reason;
    is_shutdown = true;
}

/* Does this shut the mcu down? */
#define SHUTS_DOWN(STATEMENT) \
    (is_shutdown = false, setjmp(shut_down) ? (void)0 : (void)(STATEMENT), \
     is_shutdown)

static void start(void)
{
    memset(&kernel, 0, sizeof(kernel));
    last_log[0] = 0;
}


/* ---- Gpio ---- */

static void test_output(void)
{
    struct gpio_out out = gpio_setup_output(2 * 512 + 17, 1);
    const struct gpio_v2_line_attribute *attr =
        &kernel.line.config.attrs[0].attr;

    CHECK(!strcmp(kernel.path, "/root/dev/gpiochip2"));
    CHECK(kernel.line.offsets[0] == 17 && kernel.line.num_lines == 1);
    CHECK(kernel.line.config.flags == GPIO_V2_LINE_FLAG_OUTPUT);
    CHECK(attr->id == GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES && attr->values == 1);
    CHECK(kernel.line.config.attrs[0].mask == 1 && kernel.n_closed == 1);
    gpio_toggle(out);
    CHECK(kernel.fd == LINE_FD && kernel.values.mask == 1);
    CHECK(kernel.values.bits == 0);
    kernel.n_calls = 0;
    gpio_write(out, 0);
    CHECK(kernel.n_calls == 0);
    gpio_write(out, 4);
    CHECK(kernel.n_calls == 1 && kernel.values.bits == 1);
}

static void test_output_again_keeps_the_line(void)
{
    gpio_setup_output(18, 0);
    start();
    gpio_setup_output(18, 1);
    CHECK(!kernel.path[0] && kernel.n_calls == 1);
    CHECK(kernel.config.attrs[0].attr.values == 1);
}

static void test_input(void)
{
    struct gpio_in in = gpio_setup_input(21, 1);

    CHECK(kernel.line.config.flags == (GPIO_V2_LINE_FLAG_INPUT
                                       | GPIO_V2_LINE_FLAG_BIAS_PULL_UP));
    CHECK(gpio_read(in) == 0);
    kernel.value = 1;
    CHECK(gpio_read(in) == 1);
    gpio_float(in, -1);
    CHECK(kernel.config.flags == (GPIO_V2_LINE_FLAG_INPUT
                                  | GPIO_V2_LINE_FLAG_BIAS_PULL_DOWN));
    gpio_float(in, 0);
    CHECK(kernel.config.flags & GPIO_V2_LINE_FLAG_BIAS_DISABLED);
}

static void test_line_that_floats_and_drives(void)
{
    struct gpio_out out = gpio_setup_output(22, 0);
    struct gpio_in in = gpio_setup_input(22, 0);

    kernel.value = 1;
    CHECK(gpio_read(in) == 1);
    gpio_drive(out, 0);
    CHECK(kernel.config.flags == GPIO_V2_LINE_FLAG_OUTPUT);
    CHECK(kernel.config.attrs[0].attr.values == 0);
    CHECK(gpio_read(in) == 0);
}

static void test_busy_line(void)
{
    kernel.error = EBUSY;
    CHECK(SHUTS_DOWN(gpio_setup_output(23, 0)));
    CHECK(strstr(last_log, "gpiochip0/gpio23"));
    CHECK(strstr(last_log, "busy") && strstr(last_log, "the-other-one"));
    kernel.error = 0;
    CHECK(!SHUTS_DOWN(gpio_setup_output(23, 0)));
}

static void test_absent_chip(void)
{
    kernel.open_error = ENOENT;
    CHECK(SHUTS_DOWN(gpio_setup_input(5 * 512, 0)));
    CHECK(strstr(last_log, "/root/dev/gpiochip5"));
}

static void test_line_that_fails(void)
{
    struct gpio_out out = gpio_setup_output(24, 0);
    struct gpio_in in = gpio_setup_input(25, 0);

    kernel.error = EIO;
    CHECK(SHUTS_DOWN(gpio_toggle_irq(out)));
    CHECK(SHUTS_DOWN(gpio_read(in)));
    CHECK(SHUTS_DOWN(gpio_float(in, 0)));
    CHECK(SHUTS_DOWN(gpio_drive((struct gpio_out){ in.line }, 1)));
}


/* ---- Buses ---- */

static void test_spi(void)
{
    struct spi_config slow = spi_setup(1 * 16 + 2, 3, 100000);
    struct spi_config fast = spi_setup(1 * 16 + 2, 0, 4000000);
    uint8_t data[] = { 1, 2, 3 };

    CHECK(!strcmp(kernel.path, "/root/dev/spidev1.2"));
    spi_prepare(slow);
    CHECK(kernel.mode == 3);
    spi_transfer(slow, 0, sizeof(data), data);
    CHECK(kernel.spi.speed_hz == 100000 && kernel.spi.len == 3);
    CHECK(!memcmp(kernel.sent, data, 3) && data[0] == 1);
    spi_prepare(fast);
    CHECK(kernel.mode == 0);
    kernel.n_calls = 0;
    spi_prepare(fast);
    CHECK(kernel.n_calls == 0);
    spi_transfer(fast, 1, sizeof(data), data);
    CHECK(kernel.spi.speed_hz == 4000000 && data[0] == 0x5a && data[2] == 0x5a);
    CHECK(kernel.sent[2] == 3);
}

static void test_spi_that_fails(void)
{
    struct spi_config config = spi_setup(0, 0, 1000000);
    uint8_t data[1] = { 0 };

    kernel.error = EIO;
    CHECK(SHUTS_DOWN(spi_transfer(config, 1, 1, data)));
    CHECK(SHUTS_DOWN(spi_prepare(config)));
    CHECK(SHUTS_DOWN(spi_setup(8 * 16, 0, 1)));
    CHECK(SHUTS_DOWN(spi_setup(0, 4, 1)));
    kernel.open_error = ENOENT;
    CHECK(SHUTS_DOWN(spi_setup(5, 0, 1)));
    CHECK(strstr(last_log, "/root/dev/spidev0.5"));
}

static void test_i2c(void)
{
    struct i2c_config config = i2c_setup(3, 400000, 0x48);
    uint8_t write[] = { 7, 8 }, read[3];

    CHECK(!strcmp(kernel.path, "/root/dev/i2c-3"));
    CHECK(i2c_transfer(config, 2, write, 3, read) == I2C_OK);
    CHECK(kernel.n_messages == 2 && !kernel.messages[0].flags);
    CHECK(kernel.messages[0].addr == 0x48 && kernel.messages[0].len == 2);
    CHECK(kernel.messages[1].flags == I2C_M_RD && kernel.sent[1] == 8);
    CHECK(kernel.messages[1].len == 3 && read[2] == 0xa5);
    CHECK(i2c_transfer(config, 2, write, 0, NULL) == I2C_OK);
    CHECK(kernel.n_messages == 1 && kernel.messages[0].len == 2);
    CHECK(i2c_transfer(config, 0, NULL, 1, read) == I2C_OK);
    CHECK(kernel.n_messages == 1 && kernel.messages[0].flags == I2C_M_RD);
    kernel.n_calls = 0;
    CHECK(i2c_transfer(config, 0, NULL, 0, NULL) == I2C_OK);
    CHECK(kernel.n_calls == 0);
}

static void test_i2c_errors(void)
{
    struct i2c_config config = i2c_setup(0, 100000, 0x10);
    uint8_t data[1] = { 0 };
    const int errors[] = { ENXIO, EREMOTEIO, ETIMEDOUT, EIO };
    const int results[] = { I2C_START_NACK, I2C_START_NACK, I2C_TIMEOUT,
                            I2C_NACK };

    for (int i = 0; i < 4; i++) {
        kernel.error = errors[i];
        CHECK((int)i2c_transfer(config, 1, data, 1, data) == results[i]);
    }
    kernel.error = ENXIO;
    CHECK(i2c_transfer(config, 0, NULL, 1, data) == I2C_START_READ_NACK);
    CHECK(SHUTS_DOWN(i2c_setup(15, 1, 1)));
    CHECK(SHUTS_DOWN(i2c_setup(0, 1, 0x80)));
    kernel.open_error = EACCES;
    CHECK(SHUTS_DOWN(i2c_setup(1, 1, 1)));
    CHECK(strstr(last_log, "/root/dev/i2c-1"));
}

int main(void)
{
    void (*const tests[])(void) = {
        test_output, test_output_again_keeps_the_line, test_input,
        test_line_that_floats_and_drives, test_busy_line, test_absent_chip,
        test_line_that_fails, test_spi, test_spi_that_fails, test_i2c,
        test_i2c_errors,
    };

    for (unsigned i = 0; i < sizeof(tests) / sizeof(tests[0]); i++) {
        start();
        tests[i]();
    }
    printf("%zu tests passed\n", sizeof(tests) / sizeof(tests[0]));
    return 0;
}
