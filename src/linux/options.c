/* SPDX-License-Identifier: GPL-3.0-or-later
 * Options of the command line. */
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>

#include "process.h"

#define DEFAULT_LINK "/tmp/klipper_host_mcu"
#define MAX_LATE_MS 60000
#define MIN_ADC_BITS 1
#define MAX_ADC_BITS 31

struct process_options process_options = {
    .link = DEFAULT_LINK, .root = "", .adc_bits = 12,
};

static const char usage[] =
    "usage: %s [options]\n"
    "A micro-controller for the printer's host, made of this computer's pins.\n"
    "  -r             real-time scheduling (needs the permission for it)\n"
    "  -w             feed the system's watchdog /dev/watchdog\n"
    "  -I PATH        symbolic link to the console (" DEFAULT_LINK ")\n"
    "  --max-late MS  how late a timer or step may be before the mcu shuts\n"
    "                 down (default: timers 100 ms, steps 1 ms)\n"
    "  --adc-bits N   resolution of the analog inputs (default 12)\n"
    "  --root DIR     look for dev and sys in this folder\n"
    "  --fake DIR     no real pins: their state is in this folder\n"
    "  -h, --help     show this text\n";

enum { OPT_FAKE = 256, OPT_ROOT, OPT_MAX_LATE, OPT_ADC_BITS };

static const struct option long_options[] = {
    { "fake", required_argument, NULL, OPT_FAKE },
    { "root", required_argument, NULL, OPT_ROOT },
    { "max-late", required_argument, NULL, OPT_MAX_LATE },
    { "adc-bits", required_argument, NULL, OPT_ADC_BITS },
    { "help", no_argument, NULL, 'h' },
    { NULL, 0, NULL, 0 },
};

static uint32_t read_number(const char *name, long low, long high)
{
    char *end;
    long value = strtol(optarg, &end, 10);

    if (end == optarg || *end || value < low || value > high) {
        process_log("--%s %s: must be a number from %ld to %ld", name, optarg,
                    low, high);
        exit(2);
    }
    return (uint32_t)value;
}

static void take_option(int opt, const char *program)
{
    struct process_options *o = &process_options;

    switch (opt) {
    case 'r': o->is_realtime = true; break;
    case 'w': o->has_watchdog = true; break;
    case 'I': o->link = optarg; break;
    case OPT_FAKE: o->fake = optarg; break;
    case OPT_ROOT: o->root = optarg; break;
    case OPT_MAX_LATE:
        o->max_late_ms = read_number("max-late", 1, MAX_LATE_MS);
        break;
    case OPT_ADC_BITS:
        o->adc_bits = read_number("adc-bits", MIN_ADC_BITS, MAX_ADC_BITS);
        break;
    case 'h':
        printf(usage, program);
        exit(0);
    default:
        fprintf(stderr, usage, program);
        exit(2);
    }
}

void options_read(int argc, char **argv)
{
    int opt;

    while ((opt = getopt_long(argc, argv, "rwI:h", long_options, NULL)) != -1)
        take_option(opt, argv[0]);
    if (optind == argc)
        return;
    process_log("What is %s? See %s --help", argv[optind], argv[0]);
    exit(2);
}
