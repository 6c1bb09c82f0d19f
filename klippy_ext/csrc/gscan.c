/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Scanner of plain G0/G1 lines; see gscan.h. */

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "gscan.h"

#define MANTISSA_END (UINT64_C(1) << 53)
#define MAX_FRACTION 22

/* Every power of ten that a double holds exactly. */
static const double exact_power[MAX_FRACTION + 1] = {
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
};

struct cursor {
    const char *pos, *end;
};

static inline int
cursor_peek(const struct cursor *c)
{
    return c->pos < c->end ? (unsigned char)*c->pos : -1;
}

static inline int
is_blank(int ch)
{
    return ch == ' ' || ch == '\t' || ch == '\r';
}

static inline int
is_digit(int ch)
{
    return ch >= '0' && ch <= '9';
}

static inline void
cursor_skip_blanks(struct cursor *c)
{
    while (is_blank(cursor_peek(c)))
        c->pos++;
}

/* Digits onto *mantissa; returns their number, -1 when it grows too large. */
static inline int
scan_digits(struct cursor *c, uint64_t *mantissa)
{
    const char *start = c->pos;
    uint64_t m = *mantissa;
    for (int ch; is_digit(ch = cursor_peek(c)); c->pos++) {
        m = m * 10 + (uint64_t)(ch - '0');
        if (m >= MANTISSA_END)
            return -1;
    }
    *mantissa = m;
    return (int)(c->pos - start);
}

/* A decimal number: mantissa and power of ten are both exact doubles, so that
 * the one division rounds correctly. */
static inline int
scan_number(struct cursor *c, double *value)
{
    uint64_t mantissa = 0;
    int sign = cursor_peek(c), fraction = 0;
    if (sign == '-' || sign == '+')
        c->pos++;
    int whole = scan_digits(c, &mantissa);
    if (whole < 0)
        return 0;
    if (cursor_peek(c) == '.') {
        c->pos++;
        fraction = scan_digits(c, &mantissa);
        if (fraction < 0 || fraction > MAX_FRACTION)
            return 0;
    }
    if (!whole && !fraction)
        return 0;
    double magnitude = (double)mantissa;
    if (fraction)
        magnitude /= exact_power[fraction];
    *value = sign == '-' ? -magnitude : magnitude;
    return 1;
}

static int
word_index(int letter)
{
    switch (letter) {
    case 'X': return 0;
    case 'Y': return 1;
    case 'Z': return 2;
    case 'E': return 3;
    case 'F': return 4;
    default: return -1;
    }
}

/* "[Nnnn] G0" or "G1", leading zeros allowed */
static int
scan_head(struct cursor *c)
{
    cursor_skip_blanks(c);
    if ((cursor_peek(c) | 0x20) == 'n') {
        uint64_t line_number = 0;
        c->pos++;
        if (scan_digits(c, &line_number) <= 0)
            return 0;
        cursor_skip_blanks(c);
    }
    if ((cursor_peek(c) | 0x20) != 'g')
        return 0;
    c->pos++;
    uint64_t number = 0;
    return scan_digits(c, &number) > 0 && number <= 1 && cursor_peek(c) != '.';
}

/* The rest from '*': xor of all bytes before it, then blanks or a comment */
static int
scan_checksum(struct cursor *c, const char *start)
{
    unsigned char sum = 0;
    for (const char *p = start; p < c->pos; p++)
        sum ^= (unsigned char)*p;
    c->pos++;
    uint64_t told = 0;
    if (scan_digits(c, &told) <= 0 || told != sum)
        return 0;
    cursor_skip_blanks(c);
    return cursor_peek(c) == -1 || cursor_peek(c) == ';';
}

/* An 'e' glued to a number in the other case than its word is an exponent. */
static inline int
is_exponent(int letter, int next)
{
    return (next | 0x20) == 'e' && ((letter ^ next) & 0x20);
}

static inline int
scan_word(struct cursor *c, struct gscan *out)
{
    int letter = cursor_peek(c);
    int index = word_index(letter & ~0x20);
    if (index < 0 || out->mask & (1u << index))
        return 0;
    c->pos++;
    cursor_skip_blanks(c);
    if (!scan_number(c, &out->value[index])
        || is_exponent(letter, cursor_peek(c)))
        return 0;
    out->mask |= 1u << index;
    return 1;
}

int
gscan_line(const char *s, size_t len, struct gscan *out)
{
    struct cursor c = { s, s + len };
    out->mask = 0;
    if (!scan_head(&c))
        return 0;
    for (;;) {
        cursor_skip_blanks(&c);
        int ch = cursor_peek(&c);
        if (ch == -1 || ch == ';' || ch == '\n')
            return 1;
        if (ch == '*')
            return scan_checksum(&c, s);
        if (!scan_word(&c, out))
            return 0;
    }
}

size_t
gscan_line_length(const char *s, size_t len)
{
    const char *newline = len ? memchr(s, '\n', len) : NULL;
    return newline ? (size_t)(newline - s) + 1 : 0;
}

int
gscan_check(const struct gscan *g)
{
    if (g->mask >> 5)
        return -100;
    for (int i = 0; i < 5; i++)
        if (g->mask & (1u << i) && !isfinite(g->value[i]))
            return -101;
    return 0;
}
