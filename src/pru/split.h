/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which core runs what.  Commands, tasks, and functions for start and shutdown
 * that are named here need nothing of PRU1: PRU0 runs them, and PRU1's 8 kB of
 * code have room for the others.
 *
 * Included by generated tables; PRU_CORE is the core they are for.
 */
#ifndef PRU_SPLIT_H
#define PRU_SPLIT_H

#define ON_PRU0_command_identify ~, 0
#define ON_PRU0_command_get_clock ~, 0
#define ON_PRU0_command_get_uptime ~, 0
#define ON_PRU0_command_debug_read ~, 0
#define ON_PRU0_command_debug_write ~, 0
#define ON_PRU0_command_debug_ping ~, 0
#define ON_PRU0_command_debug_nop ~, 0
#define ON_PRU0_stats_restart ~, 0
#define ON_PRU0_stats_task ~, 0
#define ON_PRU0_command_task ~, 0
#define ON_PRU0_command_shutdown ~, 0

/* A name from above makes two of the first, which moves the others on. */
#define SPLIT_SECOND_(A, B, ...) B
#define SPLIT_THIRD_(A, B, C, ...) C
#define SPLIT_SECOND(...) SPLIT_SECOND_(__VA_ARGS__)
#define SPLIT_THIRD(...) SPLIT_THIRD_(__VA_ARGS__)
#define SPLIT_CAST(FUNC) ((command_handler *)(void (*)(void))FUNC)

#if PRU_CORE == 0
#define TABLES_HANDLER(FUNC) SPLIT_CAST(SPLIT_THIRD(ON_PRU0_##FUNC, FUNC, 0, ~))
#define TABLES_FLAGS(FLAGS) ((FLAGS) | SPLIT_IS_COMMAND)
#define TABLES_CALL(FUNC) ((void)SPLIT_THIRD(ON_PRU0_##FUNC, FUNC(), 0, ~))
#else
#define TABLES_HANDLER(FUNC) SPLIT_CAST(SPLIT_SECOND(ON_PRU0_##FUNC, FUNC, ~))
#define TABLES_FLAGS(FLAGS) (FLAGS)
#define TABLES_CALL(FUNC) ((void)SPLIT_SECOND(ON_PRU0_##FUNC, FUNC(), ~))
#endif

/* PRU0: there is a command of this number, wherever it is run. */
#define SPLIT_IS_COMMAND 0x80

#endif
