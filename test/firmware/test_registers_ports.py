# SPDX-License-Identifier: GPL-3.0-or-later
"""Our register headers of LPC176x and SAM against the makers' CMSIS-SVD files.

As test_registers.py: skipped without the Python package cmsis-svd 0.4.  Each
field of each struct lies where the file has a register of that name.
"""

import importlib.util
import pathlib
import re
import subprocess
import xml.etree.ElementTree as ElementTree

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SPEC = importlib.util.find_spec("cmsis_svd")
DATA = SPEC and pathlib.Path(SPEC.origin).parent / "data"

pytestmark = pytest.mark.skipif(
    not SPEC, reason="needs the facts of: pip install cmsis-svd==0.4")

LPC_STRUCTS = {
    "syscon": "SYSCON", "pinconnect": "PINCONNECT", "gpio": "GPIO", "uart": "UART1",
    "can": "CAN1", "canaf": "CANAF", "ssp": "SSP0", "i2c": "I2C0", "pwm": "PWM1",
    "wdt": "WDT", "adc": "ADC"}
SAM_STRUCTS = {
    "pmc": "PMC", "efc": "EFC0", "pio": "PIOA", "adc": "ADC", "pwm": "PWM",
    "usart": "USART0", "twi": "TWI0", "wdt": "WDT"}
SAM3_STRUCTS = {**SAM_STRUCTS, "uart": "UART", "spi": "SPI0"}
SAM4_STRUCTS = {**SAM_STRUCTS, "uart": "UART0", "spi": "SPI"}
# header with structs, with addresses, file of facts, peripherals of our structs
CASES = [("lpc176x/periph.h", "lpc176x/periph.h", "NXP/LPC176x5x_v0.2", LPC_STRUCTS),
         ("atsam/periph.h", "atsam/sam3x.h", "Atmel/ATSAM3X8E", SAM3_STRUCTS),
         ("atsam/periph.h", "atsam/sam4s.h", "Atmel/ATSAM4S8C", SAM4_STRUCTS),
         ("atsam/udp.h", "atsam/sam4s.h", "Atmel/ATSAM4S8C", {"udp": "UDP"}),
         ("atsam/usbhs.h", "atsam/sam3x.h", "Atmel/ATSAM3X8E", {"usbhs": "UOTGHS"})]
# Ours -> theirs; fields that the files lack or have elsewhere by mistake
NAMES = {"MR0_3": "MR", "MR4_6": "MR", "channels": "CMR0", "ABCDSR": "AB",
         "TX": "TFI",         "USBHS": "UOTGHS"}
# A SAM3X has neither a second PLL nor pull-downs, a SAM4S no UTMI clock
ODD = {("uart", "ICR"), ("pwm", "CR"), ("pmc", "PLLBR"), ("pmc", "UCKR"),
       ("pio", "PPDDR"), ("pio", "PPDER"), ("pio", "PPDSR")}
# Not in these files: the AFEC; in one with a wrong address: USB of the LPC176x
UNKNOWN = {"afec", "usb"}


def read_number(element, tag):
    return int(element.findtext(tag), 0)


class Facts:
    """Peripherals, interrupts and registers of one chip."""

    def __init__(self, name):
        root = ElementTree.parse(DATA / (name + ".svd")).getroot()
        self.peripherals = {p.findtext("name"): p for p in root.iter("peripheral")}
        self.irqs = {}
        for irq in root.iter("interrupt"):
            self.irqs.setdefault(read_number(irq, "value"), set()).add(
                irq.findtext("name"))

    def find_base(self, name):
        found = self.peripherals.get(name)
        return None if found is None else read_number(found, "baseAddress")

    def list_registers(self, name):
        """{offset: names} of a peripheral, arrays spread out."""
        peripheral = self.peripherals[name]
        origin = peripheral.get("derivedFrom")
        found = {}
        for register in self.peripherals[origin or name].iter("register"):
            offset, text = read_number(register, "addressOffset"), \
                register.findtext("name")
            count = int(register.findtext("dim") or 1)
            step = int(register.findtext("dimIncrement") or "4", 0)
            for i in range(count):
                found.setdefault(offset + i * step, set()).add(
                    re.sub(r"\[?%s\]?|^(PMC|CKGR)_", "", text))
        return found


def run_program(header, body, folder):
    """Output of a program made of lines that see the header."""
    source = ('#include <stddef.h>\n#include <stdio.h>\n#include "%s"\n'
              "int main(void) {%s}" % (header, body))
    program = folder / "program"
    subprocess.run(["cc", "-w", "-x", "c", "-I", str(ROOT / "lib"), "-o",
                    str(program), "-"], input=source, text=True, check=True)
    return subprocess.run([program], capture_output=True, text=True,
                          check=True).stdout


def read_header(header):
    text = (ROOT / "lib" / header).read_text()
    return re.sub(r"/\*.*?\*/", "", text, flags=re.S)


@pytest.mark.parametrize("header, chip, name, structs", CASES)
def test_fields_lie_where_registers_are(header, chip, name, structs, tmp_path):
    facts, wrong, n_fields = Facts(name), [], 0
    bodies = dict(re.findall(r"struct (\w+)_regs \{(.*?)\n\};",
                             read_header(header), re.S))
    assert set(bodies) - UNKNOWN == set(structs)
    for ours in structs:
        body = bodies[ours]
        fields = re.findall(r"(\w+)(?:\[\d+\])?\s*[,;]", body)
        lines = "".join('printf("%%s %%zu\\n", "%s", offsetof(struct %s_regs, %s));'
                        % (field, ours, field) for field in fields
                        if not field.startswith("reserved"))
        registers = facts.list_registers(structs[ours])
        for line in run_program(header, lines, tmp_path).splitlines():
            field, offset = line.split()
            theirs = registers.get(int(offset), set())
            n_fields += 1
            if (ours, field) not in ODD and not any(
                    t.replace("_", "").startswith(
                        NAMES.get(field, field).replace("_", "")) for t in theirs):
                wrong.append((ours, field, hex(int(offset)), theirs))
    assert not wrong and n_fields >= 12


@pytest.mark.parametrize("header, chip, name, structs", CASES)
def test_addresses_and_interrupts(header, chip, name, structs, tmp_path):
    facts, wrong = Facts(name), []
    macros = re.findall(r"#define (\w+_(?:BASE|IRQ|ID)) ", read_header(chip))
    lines = "".join('printf("%%s %%lu\\n", "%s", (unsigned long)(%s));' % (m, m)
                    for m in macros)
    for line in run_program(chip, lines, tmp_path).splitlines():
        macro, number = line.split()
        ours, _, kind = macro.rpartition("_")
        ours = NAMES.get(ours, ours)
        if kind == "BASE" and facts.find_base(ours) != int(number):
            wrong.append((macro, hex(int(number)), facts.find_base(ours)))
        if kind in ("IRQ", "ID") and ours not in facts.irqs.get(int(number), ()):
            wrong.append((macro, number, facts.irqs.get(int(number))))
    assert not wrong and len(macros) > 15


def test_lpc_power_bits(tmp_path):
    """Bits of PCONP by the fields' names."""
    facts = Facts("NXP/LPC176x5x_v0.2")
    register = next(r for r in facts.peripherals["SYSCON"].iter("register")
                    if r.findtext("name") == "PCONP")
    theirs = {}
    for field in register.iter("field"):
        high, low = re.findall(r"\d+", field.findtext("bitRange") or "") or (
            field.findtext("bitOffset"), field.findtext("bitOffset"))
        theirs[field.findtext("name")] = int(low)
    ours = dict(re.findall(r"#define (\w+)_POWER (\d+)",
                           read_header("lpc176x/periph.h")))
    assert len(ours) > 10
    assert all(theirs["PC" + name] == int(bit) for name, bit in ours.items())
