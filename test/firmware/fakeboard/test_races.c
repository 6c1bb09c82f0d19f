/* SPDX-License-Identifier: GPL-3.0-or-later
 * A command and the endstop that triggers within it: wherever the interrupt
 * strikes, the outcome is that of the trigger before or after the command. */
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/command.h"
#include "fakeboard.h"
#include "send_command.h"
#include "tests.h"

enum { HIT = 20000, STEPS_FROM = 50000, END = 200000, MAX_EVENTS = 1000 };
enum { STEPPER, TRSYNC, ENDSTOP, OUTPUT, N_OIDS };
enum { NO_REASON, EXPIRED = 4, PRESSED = 5, TOLD = 9, LAST = 33 };
enum { STEP_PIN = 10, DIR_PIN, SWITCH, OUT_PIN, MAX_VALUES = 8 };

static uint32_t last_reason, n_states;

static void note_message(const uint8_t *payload, uint8_t len)
{
    const uint8_t *p = payload, *end = payload + len;
    uint32_t values[MAX_VALUES];
    int n = 0;

    while (p < end && n < MAX_VALUES && command_get_int(&p, end, &values[n]))
        n++;
    if (n == 5 && values[1] == TRSYNC && !values[2]) {
        last_reason = values[3];
        n_states++;
    }
}

static void send_values(void *handler, int n, const uint32_t *values)
{
    uint8_t payload[COMMAND_PAYLOAD_MAX];

    CHECK(fake_send(payload, put_command(payload, handler, n, values)));
    fake_run(fake.clock, MAX_EVENTS);
}

/* Of the trigger: late, so that the endstop strikes first. */
static uint32_t report_clock = END / 2;

static void start_trigger(void)
{
    SEND(trsync_start, TRSYNC, report_clock, END, EXPIRED);
}

static void trigger(void)
{
    SEND(trsync_trigger, TRSYNC, TOLD);
}

static void add_stepper(void)
{
    SEND(stepper_stop_on_trigger, STEPPER, TRSYNC);
}

static void set_timeout(void)
{
    SEND(trsync_set_timeout, TRSYNC, STEPS_FROM + 30000);
}

static void queue_steps(void)
{
    SEND(queue_step, STEPPER, 1000, 20, 0);
}

static void reset_clock(void)
{
    SEND(reset_step_clock, STEPPER, STEPS_FROM);
}

/* A regular report is due just before. */
static void report(void)
{
    fake_run(HIT - 5, MAX_EVENTS);
}

/* The value before it is due first of all. */
static void queue_value(void)
{
    SEND(queue_digital_out, OUTPUT, END / 2, 0);
}

/* The reasons that may be told in the end, and how many steps be made. */
static const struct race {
    const char *name;
    void (*run)(void);
    uint32_t reasons[2], steps[2];
    bool has_stepper; /* ... that the trigger stops, before */
} races[] = {
    { "start", start_trigger, { PRESSED, LAST }, { 0, 20 }, true },
    { "trigger", trigger, { PRESSED, TOLD }, { 0, 0 }, true },
    { "add", add_stepper, { PRESSED, PRESSED }, { 0, 0 }, false },
    { "timeout", set_timeout, { PRESSED, PRESSED }, { 0, 0 }, true },
    { "queue", queue_steps, { PRESSED, PRESSED }, { 0, 0 }, true },
    { "report", report, { PRESSED, PRESSED }, { 0, 0 }, true },
    { "value", queue_value, { PRESSED, PRESSED }, { 0, 0 }, true },
    { "reset", reset_clock, { PRESSED, PRESSED }, { 0, 20 }, true },
};

static uint32_t count_rises(uint8_t pin)
{
    uint32_t n = 0;

    for (uint32_t i = 0; i < fake.n_edges; i++)
        n += fake.edges[i].pin == pin && fake.edges[i].level;
    return n;
}

static void configure(const struct race *race)
{
    fake.note_message = note_message;
    SEND(allocate_oids, N_OIDS);
    SEND(config_stepper, STEPPER, STEP_PIN, DIR_PIN, 0, 100);
    SEND(config_trsync, TRSYNC);
    SEND(config_endstop, ENDSTOP, SWITCH, 1);
    SEND(config_digital_out, OUTPUT, OUT_PIN, 0, 0, 0);
    SEND(finalize_config, 1);
    if (race->run == queue_value)
        SEND(queue_digital_out, OUTPUT, HIT - 20, 1);
    if (race->run == report)
        report_clock = HIT - 10;
    start_trigger();
    if (race->has_stepper)
        add_stepper();
    reset_clock();
    SEND(endstop_home, ENDSTOP, HIT, 10, 1, 1000, 0, TRSYNC, PRESSED);
}

static bool is_one_of(uint32_t value, const uint32_t *values)
{
    return value == values[0] || value == values[1];
}

static void check_race(const struct race *race)
{
    uint32_t n_told = n_states;

    if (n_told && race->run != trigger)
        CHECK(last_reason == PRESSED);
    CHECK(count_rises(OUT_PIN) == (race->run == queue_value));
    CHECK(!fake.levels[OUT_PIN]);
    SEND(trsync_trigger, TRSYNC, LAST);
    if (!is_one_of(last_reason, race->reasons)
        || !is_one_of(count_rises(STEP_PIN), race->steps)
        || (last_reason == LAST) != (n_told == 0)) {
        fprintf(stderr, "%s: reason %u after %u reports, %u steps\n",
                race->name, last_reason, n_told, count_rises(STEP_PIN));
        exit(1);
    }
}

/* Returns the number of points that the command has. */
static uint32_t run_race(const struct race *race, uint32_t inject_at)
{
    configure(race);
    fake.points = 0;
    fake.inject_at = inject_at;
    race->run();
    fake.inject_at = 0;
    uint32_t points = fake.points;
    if (race->run != queue_steps)
        queue_steps();
    fake_run(END, MAX_EVENTS);
    check_race(race);
    return points;
}

static bool run_child(const struct race *race, uint32_t inject_at)
{
    pid_t pid = fork();
    int status;

    CHECK(pid >= 0);
    if (!pid)
        _exit(run_race(race, inject_at) < inject_at ? 2 : 0);
    waitpid(pid, &status, 0);
    CHECK(status == 0 || WEXITSTATUS(status) == 2);
    return status == 0;
}

void test_races(void)
{
    uint32_t n_points = 0;

    for (size_t i = 0; i < sizeof(races) / sizeof(races[0]); i++) {
        uint32_t at = 0;
        while (run_child(&races[i], at))
            at++;
        CHECK(at > 1);
        n_points += at;
    }
    printf("races: %u points\n", n_points);
}
