/* SPDX-License-Identifier: GPL-3.0-or-later
 * usage: klipper.elf sched|fuzz SEED | races
 *        klipper.elf injection FIRST STRIDE */
#include <stdint.h>
#include <string.h>

#include "tests.h"

int main(int argc, char **argv)
{
    uint32_t seed = argc > 2 ? (uint32_t)atoi(argv[2]) : 1;

    if (argc > 1 && !strcmp(argv[1], "sched"))
        test_sched(seed);
    else if (argc > 1 && !strcmp(argv[1], "injection"))
        test_injection(seed, argc > 3 ? (uint32_t)atoi(argv[3]) : 1);
    else if (argc > 1 && !strcmp(argv[1], "races"))
        test_races();
    else if (argc > 1 && !strcmp(argv[1], "fuzz"))
        fuzz_command(seed);
    else
        return 2;
    return 0;
}
