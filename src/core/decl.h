/* SPDX-License-Identifier: GPL-3.0-or-later
 * Registration by declaration.
 *
 * Each source is read twice.  First the preprocessor runs with DECL_SCAN set:
 * declarations become marked lines that scripts/build_commands.py collects.
 * Then the source is compiled with a generated header in front that holds the
 * argument structs, typed senders and string numbers of this source.  Where a
 * declaration needs a number of its own both passes count it with
 * __COUNTER__; nothing else may use that macro.
 *
 * Numbers given to DECL_CONSTANT and DECL_ENUMERATION must be constant
 * expressions of literals after preprocessing (no casts, sizeof or enums).
 */
#ifndef CORE_DECL_H
#define CORE_DECL_H

#define DECL_PASTE_(A, B) A##B
#define DECL_PASTE(A, B) DECL_PASTE_(A, B)

/* Flags of DECL_COMMAND_FLAGS. */
#define COMMAND_IN_SHUTDOWN 1

#ifdef DECL_SCAN

#define DECL_MARK(KIND, ...) @@DECL KIND @| __VA_ARGS__ @@END
#define DECL_INIT(FUNC) DECL_MARK(init, FUNC)
#define DECL_TASK(FUNC) DECL_MARK(task, FUNC)
#define DECL_SHUTDOWN(FUNC) DECL_MARK(shutdown, FUNC)
#define DECL_COMMAND_FLAGS(FUNC, FLAGS, FMT) \
    DECL_MARK(command, FUNC @| FLAGS @| FMT)
#define DECL_CONSTANT(NAME, VALUE) DECL_MARK(constant, NAME @| VALUE)
#define DECL_CONSTANT_STR(NAME, TEXT) DECL_MARK(constant_str, NAME @| TEXT)
#define DECL_ENUMERATION(ENUM, NAME, VALUE) \
    DECL_MARK(enumeration, ENUM @| NAME @| VALUE @| 1)
#define DECL_ENUMERATION_RANGE(ENUM, NAME, VALUE, COUNT) \
    DECL_MARK(enumeration, ENUM @| NAME @| VALUE @| COUNT)
#define DECL_INITIAL_PINS(TEXT) DECL_MARK(initial_pins, TEXT)
#define DECL_STRING_ID(TEXT) DECL_MARK(string, __COUNTER__ @| TEXT)
#define sendf(FMT, ...) DECL_MARK(response, __COUNTER__ @| FMT)
#define output(FMT, ...) DECL_MARK(output, __COUNTER__ @| FMT)

#else

#define DECL_NOTHING struct decl_nothing

/* void FUNC(void): once at start; every pass of the main loop; with irqs off
 * when the mcu shuts down. */
#define DECL_INIT(FUNC) DECL_NOTHING
#define DECL_TASK(FUNC) DECL_NOTHING
#define DECL_SHUTDOWN(FUNC) DECL_NOTHING

/* void FUNC(const struct args_<name> *): a command of the host.  FMT is
 * "<name> <param>=<%c|%u|%i|%hu|%hi|%*s> ..."; the struct has one field a
 * parameter, and for %*s `<param>` and `<param>_len`. */
#define DECL_COMMAND_FLAGS(FUNC, FLAGS, FMT) DECL_NOTHING

/* Entries of the dictionary. */
#define DECL_CONSTANT(NAME, VALUE) DECL_NOTHING
#define DECL_CONSTANT_STR(NAME, TEXT) DECL_NOTHING
#define DECL_ENUMERATION(ENUM, NAME, VALUE) DECL_NOTHING
#define DECL_ENUMERATION_RANGE(ENUM, NAME, VALUE, COUNT) DECL_NOTHING

/* "PA1,!PB2": becomes the table initial_pins[]. */
#define DECL_INITIAL_PINS(TEXT) DECL_NOTHING

/* Number of a text in the enumeration static_string_id. */
#define DECL_STRING_ID(TEXT) DECL_PASTE(decl_string_, __COUNTER__)

/* Send a response, or a free-form message, to the host.  Task context (or
 * irqs off during shutdown).  Dropped when the console has no room. */
#define sendf(FMT, ...) DECL_PASTE(decl_send_, __COUNTER__)(__VA_ARGS__)
#define output(FMT, ...) DECL_PASTE(decl_send_, __COUNTER__)(__VA_ARGS__)

#endif

#define DECL_COMMAND(FUNC, FMT) DECL_COMMAND_FLAGS(FUNC, 0, FMT)

#endif
