# SPDX-License-Identifier: GPL-3.0-or-later
"""Our register headers of the SAM D21 against the maker's CMSIS-SVD file.

It comes with the Python package cmsis-svd 0.4: without it these tests are skipped.
"""

import importlib.util
import pathlib
import re
import subprocess
import xml.etree.ElementTree as ElementTree

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SPEC = importlib.util.find_spec("cmsis_svd")
FILE = SPEC and (pathlib.Path(SPEC.origin).parent / "data" / "Atmel"
                 / "ATSAMD21G18A.svd")
HEAD = '#include <stddef.h>\n#include <stdio.h>\n#include "atsamd/d21.h"\n'

pytestmark = pytest.mark.skipif(
    not SPEC, reason="needs the facts of: pip install cmsis-svd==0.4")

# Structure, peripheral, cluster
STRUCTS = [("port_regs", "PORT", None), ("sercom_regs", "SERCOM0", "I2CM"),
           ("sercom_regs", "SERCOM0", "SPI"), ("sercom_regs", "SERCOM0", "USART"),
           ("tcc_regs", "TCC0", None), ("adc_regs", "ADC", None),
           ("usb_regs", "USB", "DEVICE")]
# Ours -> theirs: fields that are an array, part of a union, or at each endpoint
FIELDS = {"PMUX": "PMUX0_", "PINCFG": "PINCFG0_", "BAUD16": "BAUD", "BAUD8": "BAUD",
          "DATA16": "DATA", "DATA8": "DATA", "EP": "EPCFG"}
# Registers of other modes of the unit
ELSEWHERE = {"CTRLC", "EVCTRL", "ADDR", "QOSCTRL", "BAUD", "SYNCBUSY", "RXPL"}
BASES = {"ADC0": "ADC", "CLOCK_TC": "TC4"}


def run_c(lines, folder):
    """{name: number} that a C program prints: lines of (name, expression)."""
    program = folder / "facts"
    text = HEAD + "int main(void) {" + "".join(
        'printf("%%s %%lu\\n", "%s", (unsigned long)(%s));' % line
        for line in lines) + "}"
    subprocess.run(["cc", "-w", "-I", str(ROOT / "lib"), "-x", "c", "-o",
                    str(program), "-"], input=text, text=True, check=True)
    out = subprocess.run([program], capture_output=True, text=True, check=True)
    return {name: int(number) for name, number in
            (line.split() for line in out.stdout.splitlines())}


def read_number(element, tag):
    return int(element.findtext(tag), 0)


@pytest.fixture(scope="module")
def facts():
    """{name: element} of the peripherals."""
    return {p.findtext("name"): p
            for p in ElementTree.parse(FILE).getroot().iter("peripheral")}


def list_registers(peripheral, cluster=None):
    """{name without %s: offset} of a peripheral or one cluster of it."""
    place = peripheral.find("registers")
    if cluster:
        place = next(c for c in place.findall("cluster")
                     if c.findtext("name") == cluster)
    return {r.findtext("name").replace("%s", ""): read_number(r, "addressOffset")
            for r in place.findall("register")}


def read_text():
    return "".join((ROOT / "lib/atsamd" / name).read_text()
                   for name in ("d21.h", "blocks.h"))


def test_addresses_of_registers(facts, tmp_path):
    macros = re.findall(r"#define (\w+) SAMD_REG\d+\((\w+)_BASE", read_text())
    assert len(macros) > 20
    ours = run_c([(name, "&" + name) for name, _ in macros], tmp_path)
    wrong = []
    for name, base in macros:
        peripheral = facts[BASES.get(base, base)]
        cluster = "COUNT32" if base == "CLOCK_TC" else None
        source = facts["TC3"] if cluster else peripheral
        theirs = list_registers(source, cluster)
        register = name.split("_", 1)[1].removesuffix("_ID")
        expected = read_number(peripheral, "baseAddress") + theirs.get(register, -1)
        if ours[name] != expected:
            wrong.append((name, hex(ours[name]), hex(expected)))
    assert not wrong


@pytest.mark.parametrize("struct, peripheral, cluster", STRUCTS)
def test_layout_of_structures(struct, peripheral, cluster, facts, tmp_path):
    body = re.search(r"struct %s \{(.*?)\n\};" % (struct,), read_text(), re.S)[1]
    names = set(re.findall(r"\b([A-Z][A-Z0-9_]*)\b(?=[\[,;])", body))
    ours = run_c([(n, "offsetof(struct %s, %s)" % (struct, n)) for n in names],
                 tmp_path)
    theirs = list_registers(facts[peripheral], cluster)
    wrong, n_right = [], 0
    for name, offset in ours.items():
        known = theirs.get(FIELDS.get(name, name))
        n_right += known == offset
        if known != offset and not (known is None and name in ELSEWHERE):
            wrong.append((name, hex(offset), known))
    assert not wrong and n_right > 8


def test_units_gates_and_interrupts(facts, tmp_path):
    """Bases, bits of PM's masks, interrupts of the sercoms, ADC, USB and TCC."""
    masks = {(read_number(r, "addressOffset"), read_number(f, "bitOffset")):
             f.findtext("name") for r in facts["PM"].iter("register")
             for f in r.iter("field")}
    lines = []
    for i, (base, gate, irq) in enumerate(re.findall(
            r"X\((0x\w+), (GATE_APBC\(\d+\)), \d+, (\d+)\)", read_text())):
        lines += [("SERCOM%d_BASE" % i, base), ("SERCOM%d_GATE" % i, gate),
                  ("SERCOM%d_IRQ" % i, irq)]
    lines += [(n, n) for n in ("ADC0_BASE", "ADC0_GATE", "USB_BASE", "USB_GATE",
                               "USB_IRQ", "TCC0_GATE", "TCC1_GATE", "TCC2_GATE")]
    assert len(lines) == 26
    for name, number in run_c(lines, tmp_path).items():
        unit, kind = name.split("_")
        unit = BASES.get(unit, unit)
        if kind == "BASE":
            assert number == read_number(facts[unit], "baseAddress"), name
        elif kind == "GATE":
            assert masks[number >> 5, number & 31] == unit, name
        else:
            assert number == read_number(facts[unit].find("interrupt"), "value"), name
