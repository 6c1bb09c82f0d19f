# SPDX-License-Identifier: GPL-3.0-or-later
"""Which board is meant: found in /dev and /sys, or listed."""

import pytest

from klippy.errors import PrinterError
from klippy.flash import devices, touch


@pytest.fixture
def root(tmp_path):
    (tmp_path / "dev/serial/by-id").mkdir(parents=True)
    (tmp_path / "sys/bus/usb/devices").mkdir(parents=True)
    return tmp_path


def add_port(root, name, by_id=None):
    port = root / "dev" / name
    port.write_text("")
    if by_id:
        (root / "dev/serial/by-id" / by_id).symlink_to(port)


def add_usb(root, name, usb_id):
    folder = root / "sys/bus/usb/devices" / name
    folder.mkdir()
    vendor, product = usb_id.split(":")
    (folder / "idVendor").write_text(vendor + "\n")
    (folder / "idProduct").write_text(product + "\n")


def choose(root, family, mcu=""):
    return devices.choose(family, mcu, str(root)).path


def test_nothing_is_there(root):
    with pytest.raises(PrinterError, match="No board found for atmega2560"):
        choose(root, "avr", "atmega2560")


def test_one_port_is_taken_by_its_lasting_name(root):
    add_port(root, "ttyUSB0", "usb-1a86_USB_Serial-if00-port0")
    add_port(root, "ttyACM0", "usb-Klipper_rp2040_E661-if00")
    assert choose(root, "avr").endswith("usb-1a86_USB_Serial-if00-port0")
    assert choose(root, "rp2040", "rp2040").endswith("usb-Klipper_rp2040_E661-if00")


def test_the_chip_comes_before_its_family(root):
    add_port(root, "ttyACM0", "usb-Klipper_stm32f446xx_12-if00")
    add_port(root, "ttyACM1", "usb-Klipper_stm32g0b1xx_34-if00")
    assert choose(root, "stm32", "stm32g0b1xx").endswith("g0b1xx_34-if00")
    with pytest.raises(PrinterError) as caught:
        choose(root, "stm32", "stm32h743xx")
    assert "choose one" in str(caught.value)
    assert str(caught.value).count("FLASH_DEVICE=") == 2


def test_a_boot_loader_comes_first(root):
    add_port(root, "ttyACM0", "usb-Klipper_stm32f446xx_12-if00")
    add_usb(root, "1-1", "0483:df11")
    add_usb(root, "1-2", "1d6b:0002")
    assert choose(root, "stm32", "stm32f446xx") == "0483:df11"
    assert [d.family for d in devices.list_boot_loaders(str(root))] == ["stm32"]


def test_ports_without_a_name_count(root):
    add_port(root, "ttyUSB3")
    assert choose(root, "avr") == str(root / "dev/ttyUSB3")


def test_waits_for_the_boot_loader(root, monkeypatch):
    add_port(root, "ttyACM0", "usb-Klipper_stm32f446xx_12-if00")
    before = devices.list_all(str(root))
    pauses = []

    def sleep(seconds):
        pauses.append(seconds)
        if len(pauses) == 3:
            add_usb(root, "1-1", "0483:df11")

    monkeypatch.setattr(touch, "sleep", sleep)
    found = touch.wait_for_change(before, "stm32", str(root))
    assert found.path == "0483:df11" and len(pauses) == 4
    with pytest.raises(PrinterError, match="press its reset"):
        touch.wait_for_change(devices.list_all(str(root)), "stm32", str(root))


def test_a_port_that_comes_back_is_the_boot_loader(root, monkeypatch):
    link = root / "dev/serial/by-id/usb-Arduino_Leonardo-if00"
    add_port(root, "ttyACM0", link.name)
    before = devices.list_all(str(root))
    steps = iter([link.unlink, (root / "dev/ttyACM0").unlink,
                  lambda: add_port(root, "ttyACM0", link.name), lambda: None])
    monkeypatch.setattr(touch, "sleep", lambda seconds: next(steps)())
    found = touch.wait_for_change(before, "avr", str(root))
    assert found.path == str(link)


def test_touch_needs_a_port(tmp_path):
    with pytest.raises(PrinterError, match="Cannot open"):
        touch.touch(str(tmp_path / "none"))
