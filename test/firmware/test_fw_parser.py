# SPDX-License-Identifier: GPL-3.0-or-later
"""The parser, command by command of the dictionary: what each must refuse."""

import pytest
from simboard import SimBoard, decode_int, encode_int, frame

# What a command may name, made by configure_buses()
SPI, I2C, FILTER, TRIGGER, TRSYNC = 1, 2, 3, 4, 5
REFERENCES = {"spi_oid": SPI, "i2c_oid": I2C, "bus_oid": SPI, "trsync_oid": TRSYNC,
              "sos_filter_oid": FILTER, "trigger_analog_oid": TRIGGER}
# What must not be 0
VALUES = {"gain_channel": 1, "num_channels": 4, "button_count": 2, "sample_count": 1,
          "bytes_per_report": 2, "count": 1, "max_sections": 1, "bit_time": 100,
          "retransmit_count": 1}
FREE = 9  # an oid that nothing has


def configure_buses(board):
    board.send("allocate_oids", count=20)
    board.send("config_spi", oid=SPI, pin=3, cs_active_high=0)
    board.send("config_i2c", oid=I2C)
    board.send("config_sos_filter", oid=FILTER, max_sections=1)
    board.send("config_trigger_analog", oid=TRIGGER, sos_filter_oid=FILTER)
    board.send("config_trsync", oid=TRSYNC)
    assert board.find_shutdown() is None


def make_values(form, oid=FREE):
    values = {}
    for name, kind in form.params:
        default = b"" if kind.endswith("s") else 0
        values[name] = REFERENCES.get(name, VALUES.get(name, default))
    if "oid" in values:
        values["oid"] = oid
    return values


def list_commands(board, prefix=""):
    names = [text.split()[0] for text in board.dictionary["commands"]]
    found = [board.commands[name] for name in names if name.startswith(prefix)]
    assert len(found) > 20
    return found


@pytest.fixture
def fresh(simulator_so):
    """Make a board with some buses, as often as it is called; the one before ends."""
    first = SimBoard(simulator_so)
    dictionary = first.identify()
    boards = []

    def make():
        while boards:
            boards.pop().close()
        board = SimBoard(simulator_so)
        boards.append(board)
        for kind in ("commands", "responses", "output"):
            board.use_formats(dictionary[kind])
        board.dictionary, board.strings = dictionary, first.strings
        configure_buses(board)
        return board
    return make


def test_each_object_once_and_in_time(fresh):
    """No object has the number of another, or comes after finalize_config."""
    board = fresh()
    for form in list_commands(board, "config_"):
        if not any(name == "oid" for name, _ in form.params):
            continue
        board = fresh()
        board.send(form.name, **make_values(form))
        assert board.find_shutdown() is None, form.name
        board.send(form.name, **make_values(form))
        assert board.find_shutdown() == "Can't assign oid", form.name
        board = fresh()
        board.send("finalize_config", crc=1)
        board.send(form.name, **make_values(form))
        assert board.find_shutdown() == "Already finalized", form.name


@pytest.mark.parametrize("oid", [FREE, 20, 200])
def test_each_command_wants_its_object(fresh, oid):
    for form in list_commands(fresh()):
        if form.params[:1] != [["oid", "%c"]] or form.name.startswith("config_"):
            continue
        board = fresh()
        board.send(form.name, **make_values(form, oid))
        assert board.find_shutdown() == "Invalid oid type", form.name


def test_each_command_wants_the_right_kind(fresh):
    for form in list_commands(fresh()):
        if form.params[:1] != [["oid", "%c"]] or form.name.startswith("config_"):
            continue
        other = SPI if "trsync" in form.name else TRSYNC
        board = fresh()
        board.send(form.name, **make_values(form, other))
        assert board.find_shutdown() == "Invalid oid type", form.name


IN_SHUTDOWN = {"clear_shutdown", "debug_nop", "debug_ping", "debug_read",
               "debug_write", "emergency_stop", "get_clock", "get_config",
               "get_uptime", "identify", "reset"}


def test_each_command_in_shutdown(fresh):
    """All but a few are answered with the reason, and do nothing."""
    board = fresh()
    board.send("emergency_stop")
    reason = board.list_messages("shutdown")[0]["static_string_id"]
    for form in list_commands(board):
        if form.name in ("clear_shutdown", "emergency_stop"):
            continue
        n, n_edges = len(board.messages), len(board.edges)
        board.send(form.name, **make_values(form))
        answers = [(m["#name"], m.get("static_string_id"))
                   for m in board.messages[n:]]
        refused = answers == [("is_shutdown", reason)]
        assert refused == (form.name not in IN_SHUTDOWN), (form.name, answers)
        assert board.edges[n_edges:] == []


def test_each_message_cut_short(fresh):
    """Wherever a block ends too early: the message does not run."""
    for form in list_commands(fresh()):
        payload = form.encode(make_values(form))
        if len(payload) < 2:
            continue
        for size in range(1, len(payload)):
            if size == 1 and not payload[0] & 0x80 and not form.params:
                continue
            board = fresh()
            n_edges = len(board.edges)
            board.send_block(payload[:size])
            assert board.find_shutdown() == "Command parser error", form.name
            assert board.edges[n_edges:] == []


def test_each_integer_too_long(fresh):
    """Six bytes are too many, whatever they say."""
    for form in list_commands(fresh()):
        values = make_values(form)
        for i, (_, kind) in enumerate(form.params):
            payload = encode_int(form.msg_id)
            for j, (name, other) in enumerate(form.params):
                if j == i:
                    payload += b"\x80\x80\x80\x80\x80\x01"
                elif other.endswith("s"):
                    payload += b"\0"
                else:
                    payload += encode_int(values[name])
            board = fresh()
            board.send_block(payload[:59])
            assert board.find_shutdown() == "Command parser error", (
                form.name, kind)


@pytest.mark.parametrize("data, value", [
    (b"\x00", 0), (b"\x5f", 95), (b"\x60", -32), (b"\x7f", -1),
    (b"\x80\x60", 96), (b"\xff\x5f", -33), (b"\xe0\x00", -4096),
    (b"\x80\x80\x80\x80\x00", 0), (b"\x8f\xff\xff\xff\x7f", 2**32 - 1),
    (b"\xff\xff\xff\xff\x7f", -1), (b"\xf8\x80\x80\x80\x00", -2**31),
    (b"\x87\xff\xff\xff\x7f", 2**31 - 1), (b"\x80\x80\x80\x80\x85\x00", None),
])
def test_integers_of_any_length(board, data, value):
    ids = {name: encode_int(board.commands[name].msg_id)
           for name in ("debug_write", "debug_read")}
    board.send_block(ids["debug_write"] + b"\x02\x04" + data)
    if value is None:
        assert board.find_shutdown() == "Command parser error"
        return
    assert board.query("debug_read", "debug_result", order=2,
                       addr=4)["val"] == value % 2**32


@pytest.mark.parametrize("size", [0, 1, 55])
def test_bytes_that_fill_a_block_exactly(board, size):
    data = bytes(range(size))
    assert board.query("debug_ping", "pong", data=data)["data"] == data


@pytest.mark.parametrize("said, sent", [(1, 0), (2, 1), (56, 55), (95, 55)])
def test_one_byte_less_than_was_said(board, said, sent):
    ping = encode_int(board.commands["debug_ping"].msg_id)
    board.send_block(ping + encode_int(said) + bytes(sent))
    assert board.find_shutdown() == "Command parser error"


def test_bytes_that_are_said_to_be_without_end(board):
    ping = encode_int(board.commands["debug_ping"].msg_id)
    board.send_block(ping + encode_int(-1) + bytes(20))
    assert board.find_shutdown() == "Command parser error"


def test_shortest_and_longest_block(board):
    n, nop = len(board.blocks), encode_int(board.commands["debug_nop"].msg_id)
    board.send_block(b"")
    board.send_block(nop * (59 // len(nop)))
    assert [block[1] & 15 for _, block in board.blocks[n:]] == [
        (board.seq - 1) & 15, board.seq & 15]
    assert all(len(block) == 5 for _, block in board.blocks[n:])
    assert board.find_shutdown() is None


def test_end_marks_within_a_block(board):
    data = b"\x7e" * 30
    assert board.query("debug_ping", "pong", data=data)["data"] == data


@pytest.mark.parametrize("n_marks", [1, 2, 5])
def test_end_marks_before_a_block_are_passed_over(board, n_marks):
    n = len(board.blocks)
    board.send_raw(b"\x7e" * n_marks)
    assert board.blocks[n:] == []
    block = frame(board.seq, board.commands["debug_nop"].encode({}))
    board.send_raw(b"\x7e" * n_marks + block)
    board.seq += 1
    assert [b[1] & 15 for _, b in board.blocks[n:]] == [board.seq & 15]


def test_another_destination_is_refused_at_once(board):
    """Whatever length it claims: the next end mark is its end."""
    n = len(board.blocks)
    board.send_raw(b"\x10\x90\x7e")
    assert [b[1] & 15 for _, b in board.blocks[n:]] == [board.seq & 15]
    board.send("get_clock")
    assert board.messages[-1]["#name"] == "clock"


def test_noise_without_an_end_then_a_good_block(board):
    """Nothing is said until an end mark comes; the block after it counts."""
    n = len(board.blocks)
    for _ in range(5):
        board.send_raw(b"\x99" * 20)
    assert board.blocks[n:] == []
    board.send_raw(b"\x7e")
    assert [block[1] & 15 for _, block in board.blocks[n:]] == [board.seq & 15]
    board.send("get_clock")
    assert board.messages[-1]["#name"] == "clock"


def test_good_blocks_right_behind_bad_ones(board):
    good = frame(board.seq, board.commands["get_clock"].encode({}))
    bad = good[:-3] + b"\0\0\x7e"
    n = len(board.messages)
    board.send_raw(bad + bad + good)
    board.seq += 1
    assert len(board.list_messages("clock", n)) == 1


def test_a_block_sent_twice_runs_once(board):
    command = board.commands["set_digital_out"].encode(dict(pin=7, value=1))
    block = frame(board.seq, command)
    n = len(board.blocks)
    board.send_raw(block)
    board.send_raw(block)
    board.seq += 1
    assert len(board.list_edges(7)) == 1
    assert [b[1] & 15 for _, b in board.blocks[n:]] == [board.seq & 15] * 2


@pytest.mark.parametrize("count, ahead", [(255, 0), (50, 0), (49, 0), (48, 0), (1, 0),
                                          (40, 10), (40, 40), (40, 41), (9, 0)])
def test_how_much_is_identified_at_once(board, simulator_so, count, ahead):
    size = 0
    while board.query("identify", "identify_response", offset=size,
                      count=40)["data"]:
        size += 40
    while not board.query("identify", "identify_response", offset=size - 1,
                          count=40)["data"]:
        size -= 1
    offset = size - ahead if ahead else 0
    answer = board.query("identify", "identify_response", offset=offset, count=count)
    assert len(answer["data"]) == min(count, 49, size - offset)
    assert answer["offset"] == offset


def test_two_byte_numbers_are_of_commands_too(board):
    names = [name for name, form in board.commands.items() if form.msg_id >= 96]
    assert "config_pwm_out" in names
    number, _ = decode_int(encode_int(board.commands["config_pwm_out"].msg_id), 0)
    assert number >= 96


# ---- What the core says of itself ----

def test_the_first_reason_counts(board):
    """Until it is cleared; then the next."""
    board.send("emergency_stop")
    board.run_for(.1)
    first = board.list_messages("shutdown")[0]
    board.send("emergency_stop")
    board.send_block(encode_int(3000))
    again = board.list_messages("shutdown")
    assert {(m["clock"], m["static_string_id"]) for m in again} == {
        (first["clock"], first["static_string_id"])}
    board.send("clear_shutdown")
    n = len(board.messages)
    board.send("finalize_config", crc=1)
    found = board.list_messages("shutdown", n)[0]
    assert board.strings[found["static_string_id"]] == "Can't finalize"
    assert found["clock"] == board.clock


def test_the_configuration_counts_its_cells(board):
    assert board.query("get_config", "config")["move_count"] == 0
    board.configure(("config_stepper", dict(
        oid=1, step_pin=1, dir_pin=2, invert_step=0, step_pulse_ticks=0)), crc=7)
    large = board.query("get_config", "config")
    assert (large["crc"], large["is_config"], large["is_shutdown"]) == (7, 1, 0)
    board.power_on(board.clock)
    board.configure(crc=8)
    small = board.query("get_config", "config")
    # of 128 kB: pieces of three pointers, and of one
    assert 5000 < large["move_count"] < 5462
    assert small["move_count"] == 16384 - 20 * 16 // 8


def test_uptime_counts_from_the_start(make_board):
    board = make_board((1 << 32) - 1000)
    assert board.query("get_uptime", "uptime")["high"] == 0
    board.run_for(.001)
    uptime = board.query("get_uptime", "uptime")
    assert uptime["high"] == 1 and uptime["clock"] == board.clock % 2**32
    again = board.query("get_uptime", "uptime")
    assert again["high"] == 1


# ---- How busy it is ----

def spend(board, ticks):
    """A task that takes about so long: a transfer by software, bit by bit."""
    board.send("spi_set_sw_bus", oid=0, miso_pin=1, mosi_pin=2, sclk_pin=3, mode=0,
               pulse_ticks=ticks // 16)


def take_stats(board):
    n = len(board.list_messages("stats"))
    while len(board.list_messages("stats")) == n:
        board.run_for(.5)
    return board.list_messages("stats")[-1]


def test_an_idle_mcu_has_no_load(board):
    take_stats(board)
    stats = take_stats(board)
    assert (stats["sum"], stats["sumsq"]) == (0, 0) and stats["count"] > 0


@pytest.mark.parametrize("ticks", [16, 160, 5000, 60000, 70000, 600000, 1200000])
def test_load_and_its_square(board, ticks):
    board.configure(("config_spi_without_cs", dict(oid=0)))
    spend(board, ticks)
    take_stats(board)
    board.send("spi_send", oid=0, data=b"\0")
    stats = take_stats(board)
    busy = stats["sum"]
    assert ticks // 2 <= busy <= 2 * ticks + 64
    if busy <= 0xffff:
        expected = -(-busy * busy // 256)
    elif busy <= 0xfffff:
        expected = busy // 256 * busy
    else:
        expected = 2**32 - 1
    assert stats["sumsq"] == expected
    later = take_stats(board)
    assert (later["sum"], later["sumsq"]) == (0, 0)


def test_load_adds_up(board):
    board.configure(("config_spi_without_cs", dict(oid=0)))
    spend(board, 5000)
    take_stats(board)
    board.send("spi_send", oid=0, data=b"\0")
    once = take_stats(board)
    for _ in range(3):
        board.send("spi_send", oid=0, data=b"\0")
        board.run_for(.01)
    thrice = take_stats(board)
    assert thrice["sum"] == 3 * once["sum"]
    assert thrice["sumsq"] == 3 * once["sumsq"]
    assert thrice["count"] == once["count"] + 2


def test_squares_do_not_wrap(board):
    board.configure(("config_spi_without_cs", dict(oid=0)))
    spend(board, 800000)
    take_stats(board)
    for _ in range(3):
        board.send("spi_send", oid=0, data=b"\0")
        board.run_for(.1)
    assert take_stats(board)["sumsq"] == 2**32 - 1
