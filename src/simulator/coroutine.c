/* SPDX-License-Identifier: GPL-3.0-or-later
 * The firmware's own stack.
 *
 * makecontext() only makes the stack; from then on _setjmp() and _longjmp()
 * switch, which cost some nanoseconds and no system call.
 */
#include <setjmp.h>
#include <stddef.h>
#include <ucontext.h>

#include "world.h"

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/common_interface_defs.h>
#define SWITCH_START(SAVE, BOTTOM, SIZE) \
    __sanitizer_start_switch_fiber(SAVE, BOTTOM, SIZE)
#define SWITCH_FINISH(SAVE, BOTTOM, SIZE) \
    __sanitizer_finish_switch_fiber(SAVE, BOTTOM, SIZE)
#else
#define SWITCH_START(SAVE, BOTTOM, SIZE) ((void)0)
#define SWITCH_FINISH(SAVE, BOTTOM, SIZE) ((void)0)
#endif

enum { STACK_SIZE = 256 * 1024 };

static uint8_t stack[STACK_SIZE] __attribute__((aligned(64)));
static jmp_buf host_side, firmware_side;
static void (*firmware_entry)(void);
static bool is_started;
#ifdef __SANITIZE_ADDRESS__
static void *host_fake, *firmware_fake;
static const void *host_bottom;
static size_t host_size;
#endif

static void first_call(void)
{
    SWITCH_FINISH(NULL, &host_bottom, &host_size);
    firmware_entry();
}

void coroutine_start(void (*entry)(void))
{
    firmware_entry = entry;
    is_started = false;
}

static void enter_first(void)
{
    static ucontext_t context;

    is_started = true;
    getcontext(&context);
    context.uc_stack.ss_sp = stack;
    context.uc_stack.ss_size = sizeof(stack);
    context.uc_link = NULL;
    makecontext(&context, first_call, 0);
    setcontext(&context);
}

void coroutine_enter(void)
{
    SWITCH_START(&host_fake, stack, sizeof(stack));
    if (!_setjmp(host_side)) {
        if (is_started)
            _longjmp(firmware_side, 1);
        enter_first();
    }
    SWITCH_FINISH(host_fake, NULL, NULL);
}

void coroutine_leave(void)
{
    SWITCH_START(&firmware_fake, host_bottom, host_size);
    if (!_setjmp(firmware_side))
        _longjmp(host_side, 1);
    SWITCH_FINISH(firmware_fake, &host_bottom, &host_size);
}
