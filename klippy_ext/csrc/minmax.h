/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The lesser and the greater of two numbers, without the calls that fmin() and
 * fmax() are.  If one of them is no number, it is b.
 */
#ifndef MINMAX_H
#define MINMAX_H

static inline double
min_of(double a, double b)
{
    return a < b ? a : b;
}

static inline double
max_of(double a, double b)
{
    return a > b ? a : b;
}

#endif
