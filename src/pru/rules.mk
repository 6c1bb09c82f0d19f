# SPDX-License-Identifier: GPL-3.0-or-later
pru0-objects := $(pru0-src:%.c=$(OUT)pru0/%.o) $(OUT)pru0/tables.o
pru1-objects := $(filter-out $(only0-src:%.c=$(OUT)%.o),$(objects))
pru-asm := $(OUT)$(pru)/start.o $(OUT)$(pru)/setjmp.o

$(OUT)$(pru)/%.o: $(pru)/%.S
	@mkdir -p $(@D)
	@$(CC) -c $< -o $@

# -U, -D: of the flags of both, the last one counts
for-pru0 = $(CPPFLAGS_ALL) $(CFLAGS_ALL) -UPRU_CORE -DPRU_CORE=0

$(OUT)pru0/%.o: %.c $(OUT)decl/%.h $(OUT)autoconf.h src/build.mk \
  src/pru/port.mk src/pru/rules.mk
	@echo "  CC      $< (for PRU0)"
	@mkdir -p $(@D)
	@$(CC) $(for-pru0) -include $(OUT)decl/$*.h -MMD -c $< -o $@

$(OUT)pru0/tables.o: $(tables) $(OUT)autoconf.h
	@echo "  CC      $< (for PRU0)"
	@mkdir -p $(@D)
	@$(CC) $(for-pru0) -MMD -c $< -o $@

# Memory behind DATA_END is the mailbox (PRU1); both stacks end there.
define link-core
	@echo "  LINK    $@"
	@$(CC) -E -P -x c -DDATA_END=$(1) -DSTACK_SIZE=$(2) $(pru)/link.ld \
	  -o $@.ld
	@$(CC) $(CFLAGS_ALL) -nostdlib -nostartfiles -Wl,--gc-sections \
	  -Wl,-T,$@.ld $(filter %.o,$^) -o $@ || { echo "Too much for PRU$(3):" \
	  "leave out some features (make menuconfig), each has 8 kB of code"; exit 1; }
endef

$(OUT)pru0.elf: $(pru0-objects) $(pru-asm) $(pru)/link.ld
	$(call link-core,0x2000,512,0)

$(OUT)pru1.elf: $(pru1-objects) $(pru-asm) $(pru)/link.ld
	$(call link-core,0x1900,768,1)

# Both cores, each with 8 kB of code
print-size = $(SIZE) $(PORT_OUTPUTS) | awk 'NR > 1 { \
  printf "PRU%d: code %d bytes of 8192, memory %d bytes of 8192\n", NR - 2, \
  $$1, $$2 + $$3 }'

include src/flash.mk

-include $(pru0-objects:.o=.d)
