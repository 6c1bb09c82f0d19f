/* SPDX-License-Identifier: GPL-3.0-or-later
 * The fake board (--fake DIR): pins that are bytes in a file. */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "devices.h"
#include "fake.h"
#include "process.h"

enum { PATH_SIZE = 512, READING_MIDDLE = 2048 };

_Static_assert(sizeof(struct fake_header) == 64
               && sizeof(struct fake_pin) == 48, "watchers know the layout");

struct fake_board *fake_board;


/* ---- The file ---- */

static void init_board(struct fake_board *board)
{
    memset(board, 0, sizeof(*board));
    memcpy(board->header.magic, FAKE_MAGIC, sizeof(board->header.magic));
    board->header.pin_count = PINS_END;
    board->header.edge_size = FAKE_EDGES;
    board->header.stepper_count = FAKE_STEPPERS;
    for (uint32_t i = 0; i < PINS_END; i++) {
        board->pins[i].input = FAKE_INPUT_PULL;
        board->pins[i].reading = READING_MIDDLE;
    }
}

/* What a reset of the mcu does to its pins. */
static void release_pins(struct fake_board *board)
{
    for (uint32_t i = 0; i < PINS_END; i++) {
        board->pins[i].mode = FAKE_UNUSED;
        board->pins[i].level = 0;
        board->pins[i].changed = 0;
        board->pins[i].on_ns = 0;
    }
    board->header.start_ns = clock_start_ns();
    board->header.boots++;
}

static struct fake_board *map_board(const char *path)
{
    int fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR);
    void *map = MAP_FAILED;

    if (fd >= 0 && !ftruncate(fd, sizeof(struct fake_board)))
        map = mmap(NULL, sizeof(struct fake_board), PROT_READ | PROT_WRITE,
                   MAP_SHARED, fd, 0);
    if (map == MAP_FAILED)
        process_log("The fake board %s cannot be mapped: %s. --fake needs a "
                    "folder that exists and may be written", path,
                    strerror(errno));
    if (fd >= 0)
        close(fd);
    return map == MAP_FAILED ? NULL : map;
}

int fake_open(const char *folder)
{
    char path[PATH_SIZE];

    snprintf(path, sizeof(path), "%s/board", folder);
    fake_board = map_board(path);
    if (!fake_board)
        return -1;
    if (memcmp(fake_board->header.magic, FAKE_MAGIC,
               sizeof(fake_board->header.magic)))
        init_board(fake_board);
    release_pins(fake_board);
    return fake_rules_read(folder);
}


/* ---- Digital ---- */

static void set_level(uint32_t number, uint8_t level)
{
    struct fake_header *header = &fake_board->header;
    struct fake_pin *pin = &fake_board->pins[number];
    uint64_t clock = clock_read();

    if (pin->level)
        pin->on_ticks += clock - pin->changed;
    pin->level = level;
    pin->changed = clock;
    pin->edges++;
    fake_board->edges[header->edge_count % FAKE_EDGES] =
        (struct fake_edge){ clock, number, level };
    __atomic_store_n(&header->edge_count, header->edge_count + 1,
                     __ATOMIC_RELEASE);
}

static int fake_configure(int number, const struct gpio_setting *set)
{
    struct fake_pin *pin = &fake_board->pins[number];

    pin->mode = set->is_output ? FAKE_OUTPUT : FAKE_INPUT;
    pin->pull = set->pull;
    if (set->is_output && pin->level != set->level)
        set_level((uint32_t)number, set->level);
    return 0;
}

static int fake_open_line(uint32_t chip, uint32_t line,
                          const struct gpio_setting *set)
{
    int number = (int)(PINS_GPIO(chip) + line);

    fake_configure(number, set);
    return number;
}

static int fake_write(int number, uint8_t level)
{
    set_level((uint32_t)number, level);
    fake_rules_note_edge((uint32_t)number, level);
    return 0;
}

static int fake_read(int number)
{
    const struct fake_pin *pin = &fake_board->pins[number];
    int level = fake_rules_read_switch((uint32_t)number);

    if (level >= 0)
        return level;
    return pin->input == FAKE_INPUT_PULL ? pin->pull > 0 : pin->input;
}

static const struct gpio_device fake_gpio = {
    .open = fake_open_line, .configure = fake_configure, .write = fake_write,
    .read = fake_read,
};


/* ---- Pwm ---- */

static int fake_open_channel(uint32_t chip, uint32_t channel)
{
    uint32_t number = PINS_PWM(chip) + channel;

    fake_board->pins[number].mode = FAKE_PWM;
    return (int)number;
}

static int fake_set_on(int number, uint64_t on_ns)
{
    fake_board->pins[number].on_ns = on_ns;
    return 0;
}

static int fake_set_cycle(int number, uint64_t cycle_ns, uint64_t on_ns)
{
    fake_board->pins[number].cycle_ns = cycle_ns;
    return fake_set_on(number, on_ns);
}

static const struct pwm_device fake_pwm = {
    .open = fake_open_channel, .set_cycle = fake_set_cycle,
    .set_on = fake_set_on,
};


/* ---- Analog ---- */

static int fake_open_input(uint32_t input)
{
    fake_board->pins[PINS_ANALOG + input].mode = FAKE_ANALOG;
    return (int)(PINS_ANALOG + input);
}

static uint32_t fake_sample(int number)
{
    (void)number;
    return 0;
}

static int fake_read_input(int number)
{
    return (int)(fake_board->pins[number].reading & INT16_MAX);
}

static void fake_cancel(int number)
{
    (void)number;
}

static const struct adc_device fake_adc = {
    .open = fake_open_input, .sample = fake_sample, .read = fake_read_input,
    .cancel = fake_cancel,
};


/* ---- Buses: nothing is connected ---- */

static int fake_open_spi(uint32_t bus, uint32_t select)
{
    (void)bus, (void)select;
    return 0;
}

static int fake_set_mode(int handle, uint8_t mode)
{
    (void)handle, (void)mode;
    return 0;
}

static int fake_exchange(int handle, uint32_t rate, const uint8_t *tx,
                         uint8_t *rx, uint8_t len)
{
    (void)handle, (void)rate, (void)tx;
    if (rx)
        memset(rx, 0xff, len);
    return 0;
}

static const struct spi_device fake_spi = {
    .open = fake_open_spi, .set_mode = fake_set_mode,
    .transfer = fake_exchange,
};

static int fake_open_i2c(uint32_t bus)
{
    (void)bus;
    return 0;
}

static int fake_nobody(int handle, uint8_t addr, uint8_t write_len,
                       const uint8_t *write, uint8_t read_len, uint8_t *read)
{
    (void)handle, (void)addr, (void)write_len, (void)write, (void)read_len;
    (void)read;
    return -ENXIO;
}

static const struct i2c_device fake_i2c = {
    .open = fake_open_i2c, .transfer = fake_nobody,
};

const struct devices fake_devices = {
    .gpio = &fake_gpio, .pwm = &fake_pwm, .adc = &fake_adc, .spi = &fake_spi,
    .i2c = &fake_i2c,
};
