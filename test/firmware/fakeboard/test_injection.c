/* SPDX-License-Identifier: GPL-3.0-or-later
 * One job, run once for every point at which an interrupt may strike: all
 * its edges must be the same, and what it says at the end.  Each run is a
 * process of its own. */
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "board/timer.h"
#include "core/command.h"
#include "core/decl.h"
#include "fakeboard.h"
#include "message_log.h"
#include "send_command.h"
#include "tests.h"

enum { START = 1000000, OVER = 2500000, END = 3000000, MAX_JOB = 400 };

/* The job's messages; the firmware gets the next one whenever it is idle. */
struct message {
    uint8_t payload[COMMAND_PAYLOAD_MAX];
    uint8_t len;
};

static struct message job[MAX_JOB];
static uint32_t job_len, job_pos, job_learn, job_start, job_over, first_point;

struct outcome {
    struct fake_edge edges[FAKE_MAX_EDGES];
    uint32_t n_edges, points;
    struct message_log log;
};

static struct outcome *outcome;

static void send_values(void *handler, int n, const uint32_t *values)
{
    struct message *message = &job[job_len++];

    CHECK(job_len < MAX_JOB);
    message->len = put_command(message->payload, handler, n, values);
}

static bool is_time(void)
{
    if (job_pos == job_start)
        return !timer_is_before(fake.clock, START);
    return job_pos != job_over || !timer_is_before(fake.clock, OVER);
}

/* The second part of the job comes while the first is being executed: there
 * points count.  The third asks for the results. */
static void begin_part(void)
{
    if (job_pos == job_learn)
        message_log_start(&outcome->log);
    if (job_pos == job_start) {
        fake.points = 0;
        fake.inject_at = first_point;
    }
    if (job_pos == job_over) {
        outcome->points = fake.points;
        fake.inject_at = 0;
    }
    outcome->log.is_over = job_pos > job_over;
}

static bool is_question(const struct message *message)
{
    return message->payload[0] == find_command((void *)command_stepper_get_position);
}

static bool feed_message(void)
{
    struct message *message = &job[job_pos];

    if (job_pos == job_len || !is_time())
        return false;
    begin_part();
    job_pos++;
    if (is_question(message)) {
        uint8_t oid = message->payload[1];
        message_log_expect_position(oid, oid ? 12 : 10, oid ? 13 : 11, oid);
    }
    CHECK(fake_send(message->payload, message->len));
    return true;
}

static void write_config(void)
{
    SEND(allocate_oids, 12);
    SEND(config_stepper, 0, 10, 11, 0, 100);
    SEND(config_stepper, 1, 12, 13, 255, 0);
    SEND(config_digital_out, 2, 14, 0, 0, 0);
    SEND(config_trsync, 3);
    SEND(config_endstop, 4, 15, 1);
    SEND(config_analog_in, 5, 77);
    SEND(config_digital_out, 6, 16, 0, 0, 900000);
    SEND(config_pwm_out, 7, 17, 1000, 0, 0, 900000);
    SEND(config_trsync, 8);
    SEND(config_endstop, 9, 18, 1);
    SEND(finalize_config, 1);
    job_learn = job_len;
    SEND(stepper_get_position, 0);
    SEND(trsync_trigger, 8, 1);
}

static void write_start(void)
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
    SEND(trsync_start, 8, START, 90000, 7);
    SEND(endstop_home, 9, START + 100000, 50, 3, 10000, 0, 8, 5);
}

/* Both steppers get runs, and the outputs values, all the time. */
static void write_turn(uint32_t i)
{
    SEND(set_next_step_dir, 0, i & 1);
    SEND(queue_step, 0, 5000 + i, 4, 3);
    SEND(queue_step, 1, 4000 - i, 6, (uint32_t)-2);
    SEND(stepper_get_position, i & 1);
    SEND(trsync_set_timeout, 3, START + 400000 + i);
    SEND(queue_digital_out, 6, START + 20000 * i, i & 1);
    if (!(i & 3))
        SEND(queue_pwm_out, 7, START + 21000 * i, i * 4);
    SEND(endstop_query_state, 4);
}

static void write_job(void)
{
    write_start();
    for (uint32_t i = 0; i < 40; i++) {
        if (i == 20)
            job_start = job_len;
        write_turn(i);
    }
    SEND(queue_digital_out, 2, START + 600000, 0);
    SEND(queue_digital_out, 6, START + 810000, 0);
    SEND(queue_pwm_out, 7, START + 810000, 0);
    job_over = job_len;
    SEND(query_analog_in, 5, 0, 0, 0, 0, 0, 0, 0, 0);
    SEND(stepper_get_position, 0);
    SEND(stepper_get_position, 1);
    SEND(endstop_query_state, 4);
    SEND(endstop_query_state, 9);
    SEND(trsync_trigger, 3, 33);
    SEND(trsync_trigger, 8, 33);
    SEND(get_config);
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
        memcpy(outcome->edges, fake.edges, sizeof(fake.edges));
        _exit(0);
    }
    waitpid(pid, &status, 0);
    CHECK(status == 0);
}

static bool is_same(const struct outcome *a, const struct outcome *b)
{
    return a->n_edges == b->n_edges
        && !memcmp(a->edges, b->edges, a->n_edges * sizeof(a->edges[0]))
        && a->log.n_finals == b->log.n_finals
        && !memcmp(a->log.replies, b->log.replies, sizeof(a->log.replies));
}

void test_injection(uint32_t first, uint32_t stride)
{
    static struct outcome plain;

    outcome = mmap(NULL, sizeof(*outcome), PROT_READ | PROT_WRITE,
                   MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    run_child(0);
    plain = *outcome;
    CHECK(plain.n_edges > 300 && plain.points > 200);
    CHECK(plain.log.n_replies == 7 && plain.log.n_finals == 3);
    for (uint32_t at = first; at < plain.points; at += stride) {
        run_child(at);
        if (!is_same(outcome, &plain)) {
            fprintf(stderr, "interrupt at point %u changed the job\n", at);
            exit(1);
        }
    }
    printf("injection: %u edges, %u points\n", plain.n_edges, plain.points);
}
