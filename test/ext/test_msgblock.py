# SPDX-License-Identifier: GPL-3.0-or-later
"""Framing and integers against a slow model, and on damaged streams."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from linkpeers import slow_block, slow_crc, slow_int

from klippy_ext import msgblock

payloads = st.binary(max_size=59)


def test_crc_check_value():
    # the published check value of this CRC (CRC-16/MCRF4XX)
    assert msgblock.crc16(b"123456789") == 0x6F91


@given(st.binary(max_size=80))
def test_crc_against_model(data):
    assert msgblock.crc16(data) == slow_crc(data)


@pytest.mark.parametrize("value", [
    0, -1, 95, 96, -32, -33, 12287, 12288, -4096, -4097, 1572863, 1572864,
    -524288, -524289, 201326591, 201326592, -67108864, -67108865,
    2**31 - 1, -2**31, 2**32 - 1])
def test_int_at_range_ends(value):
    data = msgblock.encode_int(value)
    assert data == slow_int(value)
    assert msgblock.decode_int(data) == (value & 0xFFFFFFFF, len(data))


@given(st.integers(-2**31, 2**32 - 1), st.binary(max_size=3))
def test_int_against_model(value, rest):
    data = msgblock.encode_int(value)
    assert data == slow_int(value)
    assert msgblock.decode_int(data + rest) == (value & 0xFFFFFFFF, len(data))


@given(st.binary(max_size=9), st.integers(-2, 10))
def test_decode_any_bytes(data, pos):
    try:
        _, end = msgblock.decode_int(data, pos)
    except ValueError:
        return
    assert 0 <= pos < end <= len(data) and end - pos <= 5
    assert not data[end - 1] & 0x80 and all(b & 0x80 for b in data[pos:end - 1])


@pytest.mark.parametrize("data", [b"", b"\x80", b"\xff\xff", b"\x80" * 5 + b"\0"])
def test_decode_cut_short(data):
    with pytest.raises(ValueError, match="integer"):
        msgblock.decode_int(data)


@given(payloads, st.integers(0, 40))
def test_block_against_model(payload, seq):
    block = msgblock.make_block(payload, seq)
    assert block == slow_block(seq, payload)
    assert msgblock.check_block(block) == len(block)
    for end in range(len(block)):
        assert msgblock.check_block(block[:end]) == 0


def test_block_too_long():
    with pytest.raises(ValueError, match="at most 59 payload bytes, not 60"):
        msgblock.make_block(b"x" * 60, 0)


@given(st.lists(payloads, max_size=6), st.binary(max_size=5))
def test_split_undamaged(parts, tail):
    stream = b"".join(slow_block(i, p) for i, p in enumerate(parts))
    tail = bytes(b for b in tail[:1] if 5 <= b <= 64)
    blocks, skipped, rest = msgblock.split_blocks(stream + tail)
    assert blocks == list(enumerate(parts)) and not skipped and rest == tail


@given(payloads, payloads, st.data())
def test_damage_is_found_and_left_behind(first, second, data):
    """One wrong bit never gets through, and what follows is not lost."""
    block = bytearray(slow_block(1, first))
    at = data.draw(st.integers(0, len(block) - 1))
    block[at] ^= 1 << data.draw(st.integers(0, 7))
    # enough good blocks to get past a length byte that has grown
    follow = slow_block(2, second) + slow_block(3, b"") * 20
    blocks, skipped, _ = msgblock.split_blocks(bytes(block) + follow)
    assert (1, first) not in blocks
    assert skipped and blocks[-1] == (3, b"")


@given(st.binary(max_size=300))
def test_any_bytes_make_progress(data):
    pos = 0
    while pos < len(data):
        found = msgblock.check_block(data[pos:])
        if not found:
            break
        assert pos + abs(found) <= len(data)
        if found > 0:
            assert data[pos:pos + found] == slow_block(
                data[pos + 1], data[pos + 2:pos + found - 3])
        pos += abs(found)
