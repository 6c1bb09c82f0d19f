/* SPDX-License-Identifier: GPL-3.0-or-later
 * DS18B20 thermometers, by the kernel's 1-wire files (w1_therm).
 *
 * Reading one takes most of a second, which timers cannot wait for: a thread
 * reads the files, and an event looks now and then whether it is done.  A
 * reader's state says whose turn it is; the thread owns the reading while it is
 * ASKED.  Readers stay when the configuration goes.
 */
#include <errno.h>
#include <fcntl.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "board/irq.h"
#include "board/timer.h"
#include "core/oid.h"
#include "core/sched.h"
#include "process.h"
#include "worker.h"

#define FILE_NAME "sys/bus/w1/devices/%s/w1_slave"
#define LOOK_TICKS (CONFIG_CLOCK_FREQ / 100)
enum { READERS = 16, SERIAL_SIZE = 32, TEXT_SIZE = 128 };
enum { IDLE, ASKED, READY };

struct reading {
    int32_t value; /* 1/1000 degC */
    int error;     /* negative errno, or 0 */
};

struct reader {
    char serial[SERIAL_SIZE];
    int fd;
    struct reading reading;
    atomic_int state;
};

struct ds18b20 {
    struct timer timer;
    struct reader *reader;
    uint32_t rest_ticks;
    uint32_t next_clock;         /* of the next reading's begin */
    int32_t min_value, max_value;
    struct reading reading;
    uint8_t n_errors, max_errors; /* in a row */
    bool is_asked, is_due, is_late;
};

static struct reader readers[READERS];
static atomic_int reader_count;
static sem_t questions;
static bool has_thread;

static const ROM struct oid_kind ds18b20_kind = { sizeof(struct ds18b20) };
static struct task_wake ds18b20_wake;


/* ---- The thread ---- */

/* The file has two lines: "... crc=e1 YES", "... t=20687". */
static struct reading read_file(int fd)
{
    char text[TEXT_SIZE], *value;
    ssize_t n = pread(fd, text, sizeof(text) - 1, 0);

    if (n < 0)
        return (struct reading){ .error = -errno };
    text[n] = 0;
    value = strstr(text, "t=");
    if (!value || !strstr(text, "YES"))
        return (struct reading){ .error = -EIO };
    return (struct reading){ .value = (int32_t)strtol(value + 2, NULL, 10) };
}

static void *read_thermometers(void *unused)
{
    for (;;) {
        if (sem_wait(&questions))
            continue;
        for (int i = 0; i < atomic_load(&reader_count); i++) {
            struct reader *reader = &readers[i];
            if (atomic_load(&reader->state) != ASKED)
                continue;
            reader->reading = read_file(reader->fd);
            atomic_store(&reader->state, READY);
        }
    }
    return unused;
}

static void start_thread(void)
{
    if (has_thread)
        return;
    sem_init(&questions, 0, 0);
    has_thread = !worker_start(read_thermometers);
    if (!has_thread)
        shutdown("Could not start DS18B20 reader thread");
}


/* ---- Readers ---- */

static struct reader *find_reader(const char *serial)
{
    for (int i = 0; i < atomic_load(&reader_count); i++)
        if (!strcmp(readers[i].serial, serial))
            return &readers[i];
    return NULL;
}

static struct reader *open_reader(const char *serial)
{
    const char *path = process_path(FILE_NAME, serial);
    int count = atomic_load(&reader_count), fd = -1, error = ENFILE;

    if (count < READERS) {
        fd = open(path, O_RDONLY | O_CLOEXEC);
        error = errno;
    }
    if (fd < 0) {
        process_log("DS18B20 %s cannot be read: %s: %s. Are the drivers w1-gpio"
                    " and w1-therm loaded?", serial, path, strerror(error));
        shutdown("Invalid DS18B20 serial id, could not open for reading");
    }
    readers[count].fd = fd;
    strcpy(readers[count].serial, serial);
    atomic_store(&reader_count, count + 1);
    return &readers[count];
}


/* ---- Timer ---- */

static void ask(struct ds18b20 *d)
{
    int state = IDLE;

    /* One from before the last configuration may be under way: it will do. */
    if (atomic_compare_exchange_strong(&d->reader->state, &state, ASKED))
        sem_post(&questions);
    d->is_asked = true;
    d->next_clock = d->timer.waketime + d->rest_ticks;
}

static void take_answer(struct ds18b20 *d)
{
    d->reading = d->reader->reading;
    atomic_store(&d->reader->state, IDLE);
    d->is_asked = false;
    d->is_due = true;
    sched_wake(&ds18b20_wake);
}

static bool look_event(struct timer *timer)
{
    struct ds18b20 *d = CONTAINER_OF(timer, struct ds18b20, timer);
    bool is_over = !timer_is_before(timer->waketime, d->next_clock);

    if (!d->is_asked) {
        ask(d);
    } else if (is_over) {
        d->is_late = true;
        d->next_clock = timer->waketime + d->rest_ticks;
        sched_wake(&ds18b20_wake);
    }
    if (atomic_load(&d->reader->state) == READY) {
        take_answer(d);
        timer->waketime = d->next_clock;
    } else {
        timer->waketime += LOOK_TICKS;
    }
    return TIMER_AGAIN;
}


/* ---- Commands ---- */

void command_config_ds18b20(const struct args_config_ds18b20 *args)
{
    char serial[SERIAL_SIZE];
    struct reader *reader;
    struct ds18b20 *d;

    if (!args->serial_len || args->serial_len >= SERIAL_SIZE
        || memchr(args->serial, '/', args->serial_len)
        || memchr(args->serial, 0, args->serial_len))
        shutdown("Invalid DS18B20 serial id, must not contain '/'");
    memcpy(serial, args->serial, args->serial_len);
    serial[args->serial_len] = 0;
    start_thread();
    reader = find_reader(serial);
    if (!reader)
        reader = open_reader(serial);
    d = oid_new(args->oid, &ds18b20_kind);
    d->timer.event = look_event;
    d->reader = reader;
    d->max_errors = args->max_error_count;
}
DECL_COMMAND(command_config_ds18b20,
             "config_ds18b20 oid=%c serial=%*s max_error_count=%c");

/* rest_ticks=0 stops. */
void command_query_ds18b20(const struct args_query_ds18b20 *args)
{
    struct ds18b20 *d = oid_lookup(args->oid, &ds18b20_kind);

    sched_del_timer(&d->timer);
    d->is_asked = d->is_due = d->is_late = false;
    d->n_errors = 0;
    if (!args->rest_ticks)
        return;
    d->timer.waketime = args->clock;
    d->rest_ticks = args->rest_ticks;
    d->min_value = args->min_value;
    d->max_value = args->max_value;
    sched_add_timer(&d->timer);
}
DECL_COMMAND(command_query_ds18b20,
             "query_ds18b20 oid=%c clock=%u rest_ticks=%u min_value=%i"
             " max_value=%i");


/* ---- Task ---- */

/* One more fault in a row; returns whether that is too many. */
static bool count_fault(struct ds18b20 *d)
{
    bool is_last = ++d->n_errors >= d->max_errors;

    if (is_last)
        d->n_errors = 0;
    return is_last;
}

static void check_reading(struct ds18b20 *d, const struct reading *reading)
{
    if (reading->error) {
        if (count_fault(d))
            try_shutdown("Error reading DS18B20 sensor");
    } else if (reading->value < d->min_value || reading->value > d->max_value) {
        if (count_fault(d))
            try_shutdown("DS18B20 out of range");
    } else {
        d->n_errors = 0;
    }
}

static void report(struct ds18b20 *d, uint8_t oid)
{
    struct reading reading;
    uint32_t next_clock;

    irq_disable();
    d->is_due = false;
    reading = d->reading;
    next_clock = d->next_clock;
    irq_enable();
    sendf("ds18b20_result oid=%c next_clock=%u value=%i fault=%u", oid,
          next_clock, reading.value, (uint32_t)-reading.error);
    check_reading(d, &reading);
}

void ds18b20_task(void)
{
    struct ds18b20 *d;
    int16_t oid = -1;

    if (!sched_take(&ds18b20_wake))
        return;
    while ((d = oid_next(&oid, &ds18b20_kind))) {
        if (d->is_late && count_fault(d))
            try_shutdown("DS18B20 sensor didn't respond in time");
        d->is_late = false;
        if (d->is_due)
            report(d, (uint8_t)oid);
    }
}
DECL_TASK(ds18b20_task);

void ds18b20_shutdown(void)
{
    struct ds18b20 *d;
    int16_t oid = -1;

    while ((d = oid_next(&oid, &ds18b20_kind)))
        d->is_asked = d->is_due = d->is_late = false;
}
DECL_SHUTDOWN(ds18b20_shutdown);
