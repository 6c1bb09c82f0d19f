/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Scanner of plain G0/G1 lines.
 *
 * Accepts "[Nnnn] G0|G1 words [*checksum] [;comment]" in any case, with or
 * without spaces, where a word is X, Y, Z, E or F and a decimal number, each
 * at most once.  Whatever else is on a line is left to the full parser, which
 * also words the error messages.  Numbers are rounded correctly: one that
 * cannot be computed exactly in one division is left to the full parser too.
 *
 * Threads: pure functions of their arguments.  Never reads outside [s, s+len).
 */
#ifndef GSCAN_H
#define GSCAN_H

#include <stddef.h>

enum {
    GSCAN_X = 1, GSCAN_Y = 2, GSCAN_Z = 4, GSCAN_E = 8, GSCAN_F = 16,
};

/* value[i] is defined where bit i of mask is set; units of the G-code */
struct gscan {
    unsigned mask;
    double value[5];
};

/* Returns 1 and fills out if the line is a plain move, else 0. */
int gscan_line(const char *s, size_t len, struct gscan *out);

/* 0, or a negative number if this is not what gscan_line() fills in. */
int gscan_check(const struct gscan *g);

/* Length of the line that starts at s, newline included; 0 if none ends. */
size_t gscan_line_length(const char *s, size_t len);

#endif
