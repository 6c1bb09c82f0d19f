# SPDX-License-Identifier: GPL-3.0-or-later
# The fake board: the firmware's core and its C tests as one program, under the
# address and undefined behaviour sanitizers.
fake := test/firmware/fakeboard
port-src := $(fake)/fakeboard.c $(fake)/test_sched.c \
  $(fake)/test_injection.c $(fake)/fuzz_command.c \
  $(fake)/fuzz_message.c $(fake)/main.c
PORT_CFLAGS := -I$(fake) -fsanitize=address,undefined \
  -fno-sanitize-recover=all -fno-omit-frame-pointer -fno-lto
PORT_LDFLAGS :=
FLASH_HINT := nothing, run it
