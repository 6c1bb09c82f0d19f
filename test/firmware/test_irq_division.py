# SPDX-License-Identifier: GPL-3.0-or-later
"""The check of test_matrix.py for divisions in interrupts: what it can see."""

import shutil
import subprocess

import irq_division
import pytest

# `volatile`: nothing is inlined away or known in advance
PROGRAM = """
#include <stdint.h>
struct timer { struct timer *next; _Bool (*event)(struct timer *); };
volatile uint32_t value = 1000, divider = 7;
static __attribute__((noinline)) uint32_t share(void) { %(share)s }
static __attribute__((noinline)) void plan(void) { value = share(); }
%(kept)s _Bool look_event(struct timer *timer)
{ (void)timer; %(event)s return 1; }
struct timer look = { 0, look_event };
%(kept)s void armcm_timer_irq(void) { %(irq)s }
%(kept)s void __vector_1(void) { %(irq)s }
int main(void) { value = value / divider; %(main)s for (;;) ; }
"""
DIVIDES = "return value / divider;"
TOOLS = {"arm-none-eabi-": ["-mcpu=cortex-m0", "-mthumb", "--specs=nosys.specs",
                            "-Wl,-e,main", "-nostartfiles"],
         "avr-": ["-mmcu=atmega328p"]}


def build(prefix, folder, share=DIVIDES, event="", irq="", main="plan();"):
    """A program that divides in its main loop at least."""
    if shutil.which(prefix + "gcc") is None:
        pytest.skip("needs %sgcc" % (prefix,))
    source, elf = folder / "program.c", folder / "program.elf"
    source.write_text(PROGRAM % dict(
        share=share, event=event, irq=irq, main=main,
        kept='__attribute__((used, noinline))'))
    subprocess.run([prefix + "gcc", "-Os", *TOOLS[prefix], str(source),
                    "-o", str(elf)], check=True)
    return elf


@pytest.mark.parametrize("prefix", TOOLS)
class TestFindDivisions:
    def test_main_loop_may_divide(self, prefix, tmp_path):
        assert irq_division.find_divisions(prefix, build(prefix, tmp_path)) == []

    def test_handler_may_not(self, prefix, tmp_path):
        found = irq_division.find_divisions(
            prefix, build(prefix, tmp_path, irq="plan();"))
        # plan() jumps to share() or has it within itself
        handler = "armcm_timer_irq" if prefix.startswith("arm") else "__vector_1"
        assert found and all(way.split(" > ")[-1].startswith("__")
                             for way in found)
        assert any(way.startswith((handler, "armcm_timer_irq")) for way in found)

    def test_event_of_a_timer_may_not(self, prefix, tmp_path, monkeypatch):
        monkeypatch.setattr(irq_division, "list_starts",
                            lambda: frozenset({"look_event"}))
        found = irq_division.find_divisions(
            prefix, build(prefix, tmp_path, event="plan();"))
        assert found and found[0].startswith("look_event > ")

    def test_multiplication_is_no_division(self, prefix, tmp_path):
        elf = build(prefix, tmp_path, share="return value * divider;",
                    irq="plan();", event="plan();")
        assert irq_division.find_divisions(prefix, elf) == []


def test_address_is_taken(tmp_path, monkeypatch):
    """Of an ARM program: a function that nobody calls by its name."""
    monkeypatch.setattr(irq_division, "list_starts", frozenset)
    found = irq_division.find_divisions(
        "arm-none-eabi-", build("arm-none-eabi-", tmp_path, event="plan();"))
    assert found and found[0].startswith("look_event > ")


def test_sources_name_their_events():
    """What interrupts run is found in the sources as they are written today."""
    starts = irq_division.list_starts()
    assert {"armcm_timer_irq", "stepper_edge_event", "phased_event", "value_event",
            "stop_on_trigger", "usart_irq", "apply_value", "pet_event",
            "is_ready"} <= starts
