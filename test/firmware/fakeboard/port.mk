# SPDX-License-Identifier: GPL-3.0-or-later
# The fake board: the firmware's core and its C tests as one program, under the
# address and undefined behaviour sanitizers.  FAKE_SANITIZER=
#   interleave  interrupts strike between any two memory accesses instead
#   fuzzer      the program is a libFuzzer (with CC=clang)
fake := test/firmware/fakeboard
port-src := $(fake)/fakeboard.c $(fake)/fuzz_command.c $(fake)/fuzz_message.c \
  $(fake)/send_command.c
PORT_CFLAGS := -I$(fake) -fno-omit-frame-pointer -fno-lto
ifeq ($(FAKE_SANITIZER),interleave)
port-src += $(fake)/interleave.c
else
PORT_CFLAGS += -fsanitize=address,undefined -fno-sanitize-recover=all
endif
ifeq ($(FAKE_SANITIZER),fuzzer)
port-src += $(fake)/fuzz_mutator.c
PORT_CFLAGS += -fsanitize=fuzzer-no-link
PORT_LDFLAGS := -fsanitize=fuzzer
else
port-src += $(fake)/test_sched.c $(fake)/test_injection.c \
  $(fake)/test_races.c $(fake)/message_log.c $(fake)/main.c
PORT_LDFLAGS :=
endif
FLASH_HINT := nothing, run it
