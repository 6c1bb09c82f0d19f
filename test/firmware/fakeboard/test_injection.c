/* SPDX-License-Identifier: GPL-3.0-or-later
 * One job, run once for every point at which an interrupt may strike: all
 * its edges must be the same.  Each run is a process of its own. */
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "board/timer.h"
#include "core/command.h"
#include "core/decl.h"
#include "core/tables.h"
#include "fakeboard.h"
#include "tests.h"

enum { START = 1000000, END = 3000000, MAX_JOB = 250 };

/* The job's messages; the firmware gets the next one whenever it is idle. */
struct message {
    uint8_t payload[COMMAND_PAYLOAD_MAX];
    uint8_t len;
};

static struct message job[MAX_JOB];
static uint32_t job_len, job_pos, job_start, first_point;

struct outcome {
    struct fake_edge edges[FAKE_MAX_EDGES];
    uint32_t n_edges, points;
};

static struct outcome *outcome;

/* The number of a command is where its handler stands in the table. */
static uint32_t find_id(void *handler)
{
    for (uint32_t i = 0; i < tables_command_count; i++)
        if ((void *)tables_commands[i].handler == handler)
            return i;
    CHECK(!"unknown command");
    return 0;
}

static void send_values(void *handler, int n, const uint32_t *values)
{
    struct message *message = &job[job_len++];
    uint8_t *p = message->payload;

    CHECK(job_len < MAX_JOB);
    p = command_put_int(p, find_id(handler));
    for (int i = 0; i < n; i++)
        p = command_put_int(p, values[i]);
    message->len = (uint8_t)(p - message->payload);
}

/* The second part of the job comes while the first is being executed; from
 * there on points count. */
static bool feed_message(void)
{
    struct message *message = &job[job_pos];

    if (job_pos == job_len)
        return false;
    if (job_pos == job_start && timer_is_before(fake.clock, START))
        return false;
    if (job_pos++ == job_start) {
        fake.points = 0;
        fake.inject_at = first_point;
    }
    CHECK(fake_send(message->payload, message->len));
    return true;
}

#define SEND(NAME, ...) \
    send_values((void *)command_##NAME, \
                (int)(sizeof((uint32_t[]){ __VA_ARGS__ }) / 4), \
                (uint32_t[]){ __VA_ARGS__ })

static void write_config(void)
{
    SEND(allocate_oids, 8);
    SEND(config_stepper, 0, 10, 11, 0, 100);
    SEND(config_stepper, 1, 12, 13, 255, 0);
    SEND(config_digital_out, 2, 14, 0, 0, 0);
    SEND(config_trsync, 3);
    SEND(config_endstop, 4, 15, 1);
    SEND(config_analog_in, 5, 77);
    SEND(finalize_config, 1);
}

static void write_job(void)
{
    SEND(reset_step_clock, 0, START);
    SEND(reset_step_clock, 1, START);
    SEND(set_digital_out_pwm_cycle, 2, 7000);
    SEND(queue_digital_out, 2, START + 500, 3000);
    SEND(query_analog_in, 5, START, 100, 4, 30000, 2, 0, 65535, 0);
    SEND(trsync_start, 3, START, 100000, 9);
    SEND(stepper_stop_on_trigger, 1, 3);
    SEND(trsync_set_timeout, 3, START + 300000);
    SEND(endstop_home, 4, START, 50, 3, 10000, 1, 3, 2);
    for (uint32_t i = 0; i < 40; i++) {
        if (i == 20)
            job_start = job_len;
        SEND(set_next_step_dir, 0, i & 1);
        SEND(queue_step, 0, 5000 + i, 4, 3);
        SEND(queue_step, 1, 4000 - i, 6, (uint32_t)-2);
        SEND(stepper_get_position, 0);
        SEND(trsync_set_timeout, 3, START + 400000 + i);
    }
    SEND(queue_digital_out, 2, START + 600000, 0);
}

static void run_child(uint32_t inject_at)
{
    pid_t pid = fork();
    int status;

    CHECK(pid >= 0);
    if (!pid) {
        write_config();
        write_job();
        first_point = inject_at;
        fake.feed = feed_message;
        fake_run(END, 100000);
        outcome->n_edges = fake.n_edges;
        outcome->points = fake.points;
        memcpy(outcome->edges, fake.edges, sizeof(fake.edges));
        _exit(0);
    }
    waitpid(pid, &status, 0);
    CHECK(status == 0);
}

static bool is_same(const struct outcome *a, const struct outcome *b)
{
    return a->n_edges == b->n_edges
        && !memcmp(a->edges, b->edges, a->n_edges * sizeof(a->edges[0]));
}

void test_injection(uint32_t seed)
{
    static struct outcome plain;

    (void)seed;
    outcome = mmap(NULL, sizeof(*outcome), PROT_READ | PROT_WRITE,
                   MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    run_child(0);
    plain = *outcome;
    CHECK(plain.n_edges > 300 && plain.points > 200);
    for (uint32_t at = 1; at < plain.points; at++) {
        run_child(at);
        if (!is_same(outcome, &plain)) {
            fprintf(stderr, "interrupt at point %u changed the job\n", at);
            exit(1);
        }
    }
    printf("injection: %u edges, %u points\n", plain.n_edges, plain.points);
}
