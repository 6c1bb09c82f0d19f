# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy dump` on what batch mode wrote: every byte is told, nothing is made up."""

import json
import os
import subprocess
import sys

import machine_configs
import pytest
from batch import ROOT, run_batch
from dictionaries import DICTIONARIES, build_dictionary
from test_batch_is_live import use_own_pins

from klippy import msgproto
from klippy_ext import msgblock

JOB = "G28\nG1 X20 Y20 Z5 F6000\nM104 S50\nG1 X10 E1\n"


@pytest.fixture(scope="module")
def dictionary():
    return build_dictionary(DICTIONARIES / "simulator.dict")


@pytest.fixture(scope="module")
def output(tmp_path_factory, dictionary):
    config = use_own_pins(machine_configs.make_axes("cartesian"))
    return run_batch(config, JOB, dictionary, tmp_path_factory.mktemp("batch"))


def dump(*args, **options):
    """The finished command."""
    return subprocess.run(
        [sys.executable, "-m", "klippy", "dump", *map(str, args)], text=True,
        capture_output=True, env=dict(os.environ, PYTHONPATH=str(ROOT)), **options)


def split_file(path):
    """Payloads of a file's blocks, by their length bytes alone."""
    data, payloads = path.read_bytes(), []
    while data:
        size = data[0]
        assert data[size - 1] == 0x7e
        payloads.append((data[1] & 15, data[2:size - 3]))
        data = data[size:]
    return payloads


def encode_lines(lines, dictionary):
    parser = msgproto.MessageParser()
    parser.process_identify(dictionary.read_bytes(), decompress=False)
    return [bytes(parser.create_command(line)) for line in lines]


def test_the_text_gives_the_bytes_again(output, dictionary):
    result = dump(output, "--dict", dictionary)
    assert (result.returncode, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    names = {line.split()[0] for line in lines}
    assert {"allocate_oids", "config_stepper", "finalize_config", "queue_step",
            "queue_digital_out"} <= names
    payloads = b"".join(payload for _, payload in split_file(output))
    assert b"".join(encode_lines(lines, dictionary)) == payloads


def test_sequence_numbers(output, dictionary):
    lines = dump(output, "--dict", dictionary, "--seq").stdout.splitlines()
    found = []
    for line in lines:
        number, text = line.removeprefix("seq ").split(": ", 1)
        assert line.startswith("seq ")
        found.append((int(number, 16) & 15, text))
    texts = [text for _, text in found]
    assert texts == dump(output, "--dict", dictionary).stdout.splitlines()
    pieces = iter(zip(found, encode_lines(texts, dictionary), strict=True))
    for sequence, payload in split_file(output):
        while payload:
            (number, _), piece = next(pieces)
            assert number == sequence and payload.startswith(piece)
            payload = payload[len(piece):]


def test_damaged_file(output, dictionary, tmp_path):
    """A hole loses the blocks that it touches; all others are shown."""
    data = bytearray(output.read_bytes())
    middle = len(data) // 2
    data[middle:middle + 3] = b"\x00\xff\x7e\x7e\x55"
    path = tmp_path / "damaged"
    path.write_bytes(data[:-2])
    whole = dump(output, "--dict", dictionary).stdout.splitlines()
    result = dump(path, "--dict", dictionary)
    lines = result.stdout.splitlines()
    assert result.returncode == 1
    assert "bytes are no part of a block" in result.stderr
    assert "Traceback" not in result.stderr
    assert len(whole) - 60 < len(lines) < len(whole)
    assert lines[:20] == whole[:20] and not set(lines) - set(whole)


def test_dictionary_of_another_firmware(output, dictionary, tmp_path):
    """Messages that it does not have are told, and the status too."""
    content = json.loads(dictionary.read_text())
    name = next(key for key in content["commands"] if key.startswith("queue_step"))
    del content["commands"][name]
    other = tmp_path / "other.dict"
    other.write_text(json.dumps(content))
    result = dump(output, "--dict", other)
    assert result.returncode == 1 and "#unknown" in result.stdout
    assert "another dictionary" in result.stderr


def test_message_that_breaks_off(dictionary, tmp_path):
    """A block of an oid without the fields behind it."""
    parser = msgproto.MessageParser()
    parser.process_identify(dictionary.read_bytes(), decompress=False)
    command = bytes(parser.create_command("queue_step oid=1 interval=9 count=1 add=0"))
    path = tmp_path / "short"
    path.write_bytes(msgblock.make_block(command[:-1], 1))
    result = dump(path, "--dict", dictionary)
    assert result.returncode == 1 and command[:-1].hex() in result.stdout
    assert "another dictionary" in result.stderr


@pytest.mark.parametrize("content, reason", [
    (None, "No such file"), (b"\x78\x9c\x00\x01garbage", "dictionary"),
    (b"[1, 2]", "dictionary"),
    (b'{"commands": {"x y=%q": 3}, "responses": {}, "config": {}}', "%q")])
def test_bad_dictionary(output, tmp_path, content, reason):
    path = tmp_path / "bad.dict"
    if content is not None:
        path.write_bytes(content)
    result = dump(output, "--dict", path)
    assert (result.returncode, result.stdout) == (1, "")
    assert reason in result.stderr and result.stderr.count("\n") == 1
    assert result.stderr.startswith("klippy dump: ")


def test_missing_file(dictionary, tmp_path):
    result = dump(tmp_path / "none", "--dict", dictionary)
    assert result.returncode == 1 and "none" in result.stderr
    assert result.stderr.count("\n") == 1


def test_reader_that_goes(output, dictionary):
    """As `klippy dump ... | head -1`."""
    command = '"$0" -m klippy dump "$1" --dict "$2" | head -n 1'
    result = subprocess.run(
        ["bash", "-c", command, sys.executable, str(output), str(dictionary)],
        capture_output=True, text=True, env=dict(os.environ, PYTHONPATH=str(ROOT)))
    assert result.stdout.startswith("allocate_oids") and result.stderr == ""
