/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Allocations of which the N-th fails, for tests that are linked with malloc,
 * calloc, realloc and strdup wrapped.  Any thread may allocate.
 */
#ifndef FAILING_MEMORY_H
#define FAILING_MEMORY_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__real_realloc(void *p, size_t size);

/* Allocations since somebody made it 0; the number of the one that fails. */
static _Atomic long n_allocs, failing = -1;

static int
is_failing(void)
{
    return ++n_allocs == failing;
}

void *
__wrap_malloc(size_t size)
{
    return is_failing() ? NULL : __real_malloc(size);
}

void *
__wrap_calloc(size_t n, size_t size)
{
    return is_failing() ? NULL : __real_calloc(n, size);
}

void *
__wrap_realloc(void *p, size_t size)
{
    return is_failing() ? NULL : __real_realloc(p, size);
}

char *
__wrap_strdup(const char *text)
{
    char *copy = malloc(strlen(text) + 1);

    return copy ? strcpy(copy, text) : NULL;
}

/* The test ends here unless `is_true`; `what` says what would be right. */
static void
expect(int is_true, const char *what)
{
    if (is_true)
        return;
    fprintf(stderr, "allocation %ld failed, then not: %s\n", failing, what);
    exit(1);
}

#endif
