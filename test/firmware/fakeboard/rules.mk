# SPDX-License-Identifier: GPL-3.0-or-later
# The compiler announces each memory access; interleave.c listens.
ifeq ($(FAKE_SANITIZER),interleave)
$(OUT)src/%.o: FILE_CFLAGS := -fsanitize=thread \
  --param tsan-instrument-func-entry-exit=0 -Wno-maybe-uninitialized
endif

# The fuzzer's mutator knows the commands of this very build.
ifeq ($(FAKE_SANITIZER),fuzzer)
$(OUT)fuzz_formats.h: $(OUT)decl/stamp $(fake)/write_formats.py
	@$(PYTHON) $(fake)/write_formats.py $(OUT)klipper.dict $@

$(OUT)$(fake)/fuzz_mutator.o: $(OUT)fuzz_formats.h
endif
