# SPDX-License-Identifier: GPL-3.0-or-later
"""Our register headers of STM32 against the makers' CMSIS-SVD files.

Those come with the Python package cmsis-svd 0.4 (800 MB unpacked), which
nothing else needs: without it these tests are skipped.  `make nightly` installs it.
"""

import importlib.util
import pathlib
import re
import subprocess
import xml.etree.ElementTree as ElementTree

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SPEC = importlib.util.find_spec("cmsis_svd")
DATA = SPEC and pathlib.Path(SPEC.origin).parent / "data" / "STMicro"

pytestmark = pytest.mark.skipif(
    not SPEC, reason="needs the facts of: pip install cmsis-svd==0.4")

# header, file of facts, further macros
CASES = [
    ("f0.h", "STM32F0xx", ""), ("f0.h", "STM32F072x", ""),
    ("f1.h", "STM32F103xx", ""), ("f2f4f7.h", "STM32F20x", ""),
    ("f2f4f7.h", "STM32F40x", ""), ("f2f4f7.h", "STM32F446x", ""),
    ("g4l4.h", "STM32L4x6", "-DCONFIG_MACH_STM32L4=1")]
# Fields of RCC that the files do not name after the peripheral
ODD_FIELDS = ("ADCEN", "SPI4ENR", "SP3EN", "USBRST", "OTGFSEN")
# Interrupts that the files name after one of several that share them
SHARED_IRQS = {"USB": "CAN1_RX0"}
# Ours -> theirs
NAMES = {"USART4": "UART4", "USART5": "UART5", "GPIO": "GPIOA",
         "OTG_FS": "OTG_FS_GLOBAL"}


def run_compiler(options, text):
    return subprocess.run(["cc", "-w", "-I", str(ROOT / "lib"), *options, "-"],
                          input=text, capture_output=True, text=True,
                          check=True).stdout


def read_macros(header, define, folder):
    """{name: number} of the macros X_BASE, X_GATE and X_IRQ of a header."""
    include = '#include "stm32/%s"\n' % (header,)
    options = ["-x", "c"] + define.split()
    names = re.findall(r"#define (\w+_(?:BASE|GATE|IRQ)) ",
                       run_compiler(options + ["-E", "-dM"], include))
    lines = "".join('printf("%%s %%lu\\n", "%s", (unsigned long)(%s));' % (n, n)
                    for n in names)
    program = folder / "macros"
    run_compiler(options + ["-o", str(program)],
                 include + "#include <stdio.h>\nint main(void) {" + lines + "}")
    out = subprocess.run([program], capture_output=True, text=True, check=True)
    return {name: int(number) for name, number in
            (line.split() for line in out.stdout.splitlines())}


def read_number(element, tag):
    return int(element.findtext(tag), 0)


class Facts:
    """Peripherals, interrupts and the registers of RCC of one chip."""

    def __init__(self, name):
        root = ElementTree.parse(DATA / (name + ".svd")).getroot()
        peripherals = list(root.iter("peripheral"))
        self.bases = {p.findtext("name"): read_number(p, "baseAddress")
                      for p in peripherals}
        self.irqs = {}
        for irq in root.iter("interrupt"):
            self.irqs.setdefault(read_number(irq, "value"), set()).add(
                irq.findtext("name"))
        rcc = next(p for p in peripherals if p.findtext("name") == "RCC")
        self.rcc = {read_number(r, "addressOffset"): r
                    for r in rcc.iter("register")}

    def find_gate(self, number):
        """Name of the field of RCC that a gate means."""
        register = self.rcc[number >> 5]
        return next((f.findtext("name") for f in register.iter("field")
                     if read_number(f, "bitOffset") == number & 31), None)


@pytest.mark.parametrize("header, name, define", CASES)
def test_addresses_gates_and_interrupts(header, name, define, tmp_path):
    facts, wrong = Facts(name), []
    for macro, number in read_macros(header, define, tmp_path).items():
        ours, _, kind = macro.rpartition("_")
        theirs = NAMES.get(ours, ours)
        if theirs not in facts.bases:
            theirs = "ADC" if ours == "ADC1" and "ADC" in facts.bases else None
        if not theirs:
            continue
        if kind == "BASE" and facts.bases[theirs] != number:
            wrong.append((macro, hex(number), hex(facts.bases[theirs])))
        if kind == "IRQ" and not any(
                n.startswith((theirs.replace("_GLOBAL", ""),
                              SHARED_IRQS.get(ours, theirs)))
                for n in facts.irqs.get(number, ())):
            wrong.append((macro, number, facts.irqs.get(number)))
        if kind == "GATE" and facts.find_gate(number) not in (
                theirs + "EN", theirs.replace("GPIO", "IOP") + "EN", *ODD_FIELDS):
            wrong.append((macro, number, facts.find_gate(number)))
    assert not wrong


@pytest.mark.parametrize("header, name, define", CASES)
def test_layout_of_rcc(header, name, define):
    facts = Facts(name)
    theirs = {offset: r.findtext("name") for offset, r in facts.rcc.items()}
    text = (ROOT / "lib" / "stm32" / header).read_text()
    body = re.search(r"struct rcc_regs \{(.*?)\}", text, re.S)[1]
    offset, wrong = 0, []
    for field, count in re.findall(r"(\w+)(?:\[(\d+)\])?\s*[,;]", body):
        if not field.startswith("reserved") and theirs.get(offset) != field:
            wrong.append((hex(offset), field, theirs.get(offset)))
        offset += 4 * int(count or 1)
    assert not wrong
