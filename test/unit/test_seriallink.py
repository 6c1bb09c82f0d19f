# SPDX-License-Identifier: GPL-3.0-or-later
"""What is no way to an mcu is told in words."""
import os

import pytest

from klippy import seriallink


@pytest.mark.parametrize(("path", "reason"), [
    ("/dev/null", "it is no serial port"),
    ("/etc/", "it is no serial port"),
    ("/dev/ttyNOWHERE", "it does not exist; is the board connected and powered"),
])
def test_uart(path, reason):
    with pytest.raises(seriallink.error, match=reason):
        seriallink.open_uart(path, 250000)


@pytest.mark.parametrize("baud", [-1, 10**12])
def test_impossible_speed(baud):
    leader, follower = os.openpty()
    try:
        with pytest.raises(seriallink.error, match="at %d baud" % (baud,)):
            seriallink.open_uart(os.ttyname(follower), baud)
    finally:
        os.close(leader)
        os.close(follower)


def test_file_is_no_pipe(tmp_path):
    path = tmp_path / "klipper.serial"
    path.write_text("kept")
    with pytest.raises(seriallink.error, match="it is no serial port, but a file"):
        seriallink.open_pipe(str(path))
    assert path.read_text() == "kept"
    with pytest.raises(seriallink.error, match="it is no serial port"):
        seriallink.open_pipe(str(tmp_path))


def test_pseudo_terminal_is_opened():
    leader, follower = os.openpty()
    link = seriallink.open_pipe(os.ttyname(follower))
    os.write(link.fileno(), b"x")
    assert os.read(leader, 1) == b"x"
    link.close()
    link.close()
    os.close(leader)
    os.close(follower)
