/* SPDX-License-Identifier: GPL-3.0-or-later */
/* libFuzzer target: gscan_line() reads inside its line and rounds like
 * strtod().  clang -g -fsanitize=fuzzer,address,undefined -Iklippy_ext/csrc
 *     test/c/fuzz_gscan.c klippy_ext/csrc/gscan.c */

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gscan.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void
fail(const char *why)
{
    fprintf(stderr, "gscan: %s\n", why);
    abort();
}

/* Each value of the words must be what strtod() reads behind its letter. */
static void
check_values(const char *line, const struct gscan *found)
{
    static const char letters[] = "XYZEF";
    for (int i = 0; i < 5; i++) {
        if (!(found->mask & (1u << i)))
            continue;
        const char *p = line;
        while (*p && (*p & ~0x20) != letters[i])
            p++;
        if (!*p++)
            fail("a word that is not in the line");
        while (*p == ' ' || *p == '\t' || *p == '\r')
            p++;
        char number[64];
        size_t n = strspn(p, "+-.0123456789");
        if (n >= sizeof(number))
            return;
        memcpy(number, p, n);
        number[n] = 0;
        if (strtod(number, NULL) != found->value[i])
            fail("a number is not rounded correctly");
    }
}

int
LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    /* exact copies, so that the sanitizer sees any read outside */
    char *line = malloc(size ? size : 1);
    char *text = malloc(size + 1);
    struct gscan found = { .mask = 0 };
    if (!line || !text)
        abort();
    memcpy(line, data, size);
    memcpy(text, data, size);
    text[size] = 0;
    size_t length = gscan_line_length(line, size);
    if (length > size || (length && line[length - 1] != '\n'))
        fail("a wrong line length");
    if (gscan_line(line, size, &found))
        check_values(text, &found);
    if (found.mask && gscan_check(&found))
        fail("values that are no numbers");
    free(text);
    free(line);
    return 0;
}
