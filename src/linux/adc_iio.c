/* SPDX-License-Identifier: GPL-3.0-or-later
 * Analog inputs of the kernel's IIO subsystem.
 *
 * A conversion may take milliseconds, which timers cannot wait for: a thread
 * of ordinary priority reads the files.  Each input's state says whose turn it
 * is; the thread owns `value` while it is ASKED or DROPPED. */
#include <errno.h>
#include <fcntl.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "devices.h"
#include "pins.h"
#include "process.h"
#include "worker.h"

#define RAW "sys/bus/iio/devices/iio:device0/in_voltage%u_raw"
#define ASK_AGAIN_TICKS (CONFIG_CLOCK_FREQ / 10000)
enum { ADC_BITS = 12, TEXT_SIZE = 24 };
enum { IDLE, ASKED, DROPPED, READY };

struct input {
    int fd;
    int value; /* or -errno */
    atomic_int state;
};

static struct input inputs[PINS_ANALOG_INPUTS];
static atomic_int input_count;
static sem_t questions;
static bool has_thread;

/* To the 12 bits that the firmware promises. */
static int scale(long raw)
{
    int shift = (int)process_options.adc_bits - ADC_BITS;

    if (raw < 0)
        raw = 0;
    return (int)(shift > 0 ? raw >> shift : raw << -shift);
}

static int read_raw(int fd)
{
    char text[TEXT_SIZE];
    ssize_t n = pread(fd, text, sizeof(text) - 1, 0);

    if (n <= 0)
        return n ? -errno : -EIO;
    text[n] = 0;
    return scale(strtol(text, NULL, 10));
}

static void answer(struct input *input)
{
    int state = atomic_load(&input->state);

    if (state != ASKED && state != DROPPED)
        return;
    input->value = read_raw(input->fd);
    state = ASKED;
    if (!atomic_compare_exchange_strong(&input->state, &state, READY))
        atomic_store(&input->state, IDLE);
}

static void *read_inputs(void *unused)
{
    for (;;) {
        if (sem_wait(&questions))
            continue;
        for (int i = 0; i < atomic_load(&input_count); i++)
            answer(&inputs[i]);
    }
    return unused;
}

static int start_thread(void)
{
    int error;

    sem_init(&questions, 0, 0);
    error = worker_start(read_inputs);
    has_thread = !error;
    return error;
}

static int iio_open(uint32_t number)
{
    const char *path = process_path(RAW, number);
    int handle = atomic_load(&input_count), fd = open(path, O_RDONLY
                                                      | O_CLOEXEC);
    int error = fd < 0 ? -errno : read_raw(fd);

    if (error >= 0)
        error = has_thread ? 0 : start_thread();
    if (error < 0) {
        process_log("analog%u cannot be read: %s: %s. Is the converter's "
                    "driver loaded?", number, path, strerror(-error));
        if (fd >= 0)
            close(fd);
        return error;
    }
    inputs[handle].fd = fd;
    atomic_store(&input_count, handle + 1);
    return handle;
}

static uint32_t iio_sample(int handle)
{
    struct input *input = &inputs[handle];
    int state = atomic_load(&input->state);

    if (state == READY)
        return 0;
    if (state == IDLE) {
        atomic_store(&input->state, ASKED);
        sem_post(&questions);
    }
    return ASK_AGAIN_TICKS;
}

static int iio_read(int handle)
{
    int value = inputs[handle].value;

    atomic_store(&inputs[handle].state, IDLE);
    return value;
}

static void iio_cancel(int handle)
{
    int state = ASKED;

    if (atomic_compare_exchange_strong(&inputs[handle].state, &state,
                                       DROPPED))
        return;
    if (state == READY)
        atomic_store(&inputs[handle].state, IDLE);
}

const struct adc_device adc_iio = {
    .open = iio_open, .sample = iio_sample, .read = iio_read,
    .cancel = iio_cancel,
};
