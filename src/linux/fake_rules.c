/* SPDX-License-Identifier: GPL-3.0-or-later
 * Machines on the fake board: DIR/rules, one rule a line, # for remarks.
 *
 *   stepper NAME STEP_PIN DIR_PIN [both]
 *       counts steps; ! before a pin inverts it; both: steps on both edges
 *   switch PIN LEVEL below|above LIMIT NAME FACTOR [NAME FACTOR]...
 *       the pin reads LEVEL while the sum of factor * position is below or
 *       above the limit, else the other level
 *
 * Pins are gpio<line> or gpiochip<chip>/gpio<line>.
 */
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fake.h"
#include "process.h"

enum { NAME_SIZE = 16, SWITCHES = 16, WORDS = 40, LINE_SIZE = 256 };
#define SPACE " \t\r\n"

struct stepper {
    char name[NAME_SIZE];
    uint32_t step_pin, dir_pin;
    uint8_t idle_level, back_level;
    bool is_both;
};

struct end_switch {
    uint32_t pin;
    uint8_t level;   /* while pressed */
    bool is_above;
    double limit;
    double factors[FAKE_STEPPERS];
};

static struct stepper steppers[FAKE_STEPPERS];
static struct end_switch switches[SWITCHES];
static uint32_t stepper_count, switch_count;


/* ---- What happens ---- */

static void count_step(uint32_t index)
{
    const struct stepper *s = &steppers[index];
    struct fake_stepper *count = &fake_board->steppers[index];
    bool is_back = fake_board->pins[s->dir_pin].level == s->back_level;

    count->position += is_back ? -1 : 1;
    count->total++;
}

void fake_rules_note_edge(uint32_t pin, uint8_t level)
{
    for (uint32_t i = 0; i < stepper_count; i++)
        if (steppers[i].step_pin == pin
            && (steppers[i].is_both || level != steppers[i].idle_level))
            count_step(i);
}

static bool is_pressed(const struct end_switch *sw)
{
    double sum = 0.;

    for (uint32_t i = 0; i < stepper_count; i++)
        sum += sw->factors[i] * (double)fake_board->steppers[i].position;
    return sw->is_above ? sum > sw->limit : sum < sw->limit;
}

int fake_rules_read_switch(uint32_t pin)
{
    for (uint32_t i = 0; i < switch_count; i++)
        if (switches[i].pin == pin)
            return is_pressed(&switches[i]) ? switches[i].level
                                            : !switches[i].level;
    return -1;
}


/* ---- Reading: each returns NULL, or what is wrong ---- */

static const char *read_pin(const char *word, uint32_t *pin, uint8_t *inverted)
{
    unsigned chip = 0, line;
    int used = 0;

    *inverted = *word == '!';
    word += *inverted;
    if (sscanf(word, "gpiochip%u/gpio%u%n", &chip, &line, &used) != 2) {
        chip = 0;
        if (sscanf(word, "gpio%u%n", &line, &used) != 1)
            return "a pin is gpio<line> or gpiochip<chip>/gpio<line>";
    }
    if (word[used] || chip >= PINS_GPIO_CHIPS || line >= PINS_GPIO_LINES)
        return "there is no such pin";
    *pin = PINS_GPIO(chip) + line;
    return NULL;
}

static const char *read_stepper(char **words, int count)
{
    struct stepper *s = &steppers[stepper_count];
    uint8_t is_dir_inverted;
    const char *wrong;

    if (count < 4 || count > 5 || (count == 5 && strcmp(words[4], "both")))
        return "must be: stepper NAME STEP_PIN DIR_PIN [both]";
    if (stepper_count >= FAKE_STEPPERS || strlen(words[1]) >= NAME_SIZE)
        return "too many steppers, or too long a name";
    wrong = read_pin(words[2], &s->step_pin, &s->idle_level);
    if (!wrong)
        wrong = read_pin(words[3], &s->dir_pin, &is_dir_inverted);
    if (wrong)
        return wrong;
    strcpy(s->name, words[1]);
    s->back_level = is_dir_inverted;
    s->is_both = count == 5;
    stepper_count++;
    return NULL;
}

static const char *read_factor(struct end_switch *sw, char **words)
{
    for (uint32_t i = 0; i < stepper_count; i++)
        if (!strcmp(steppers[i].name, words[0])) {
            sw->factors[i] = atof(words[1]);
            return NULL;
        }
    return "a switch names a stepper that no line above it defines";
}

static const char *read_switch(char **words, int count)
{
    struct end_switch *sw = &switches[switch_count];
    const char *wrong;
    uint8_t ignored;

    if (switch_count >= SWITCHES)
        return "too many switches";
    if (count < 7 || count % 2 == 0 || (strcmp(words[2], "0")
                                        && strcmp(words[2], "1")))
        return "must be: switch PIN 0|1 below|above LIMIT NAME FACTOR ...";
    wrong = read_pin(words[1], &sw->pin, &ignored);
    sw->level = words[2][0] == '1';
    sw->is_above = !strcmp(words[3], "above");
    sw->limit = atof(words[4]);
    for (int i = 5; i < count && !wrong; i += 2)
        wrong = read_factor(sw, &words[i]);
    switch_count += !wrong;
    return wrong;
}

static const char *read_line(char *line)
{
    char *words[WORDS], *rest = NULL;
    int count = 0;

    line[strcspn(line, "#")] = 0;
    for (char *word = strtok_r(line, SPACE, &rest); word && count < WORDS;
         word = strtok_r(NULL, SPACE, &rest))
        words[count++] = word;
    if (!count)
        return NULL;
    if (!strcmp(words[0], "stepper"))
        return read_stepper(words, count);
    if (!strcmp(words[0], "switch"))
        return read_switch(words, count);
    return "a rule is a stepper or a switch";
}

int fake_rules_read(const char *folder)
{
    char path[LINE_SIZE], line[LINE_SIZE];
    const char *wrong = NULL;
    int number = 0;
    FILE *file;

    snprintf(path, sizeof(path), "%s/rules", folder);
    file = fopen(path, "re");
    if (!file)
        return errno == ENOENT ? 0 : -1;
    while (!wrong && fgets(line, sizeof(line), file)) {
        wrong = read_line(line);
        number++;
    }
    fclose(file);
    if (wrong)
        process_log("%s, line %d: %s", path, number, wrong);
    return wrong ? -1 : 0;
}
