# SPDX-License-Identifier: GPL-3.0-or-later
"""Sections whose part of the firmware is missing: out of use, or no start, and why."""
import json
import logging
import re

import pytest
import reduced_firmware
from bench import Bench, Machine

import klippy.extras
from klippy import msgproto
from klippy.errors import CommandError
from klippy.mcu import absence, features
from klippy.simulator import firmware

ROW = """
import klippy.mcu
from klippy.mcu import absence
%s

class Thing:
    def __init__(self, config):
        self.printer = config.get_printer()
        self.mcu = klippy.mcu.get(self.printer, config.get("on", "mcu"))
        self.texts = config.getlist("texts", sep=";")
        self.name = config.get_name().split()[-1]
        self.part = absence.find_part(self.mcu)
        self.mcu.add_config_cmd("debug_nop")
        self.mcu.register_config_callback(self._build)
        self.mcu.register_post_init_callback(self._note_init)
        self.is_set_up = False
        gcode = self.printer.lookup_object("gcode")
        gcode.register_mux_command("USE", "THING", self.name, self.cmd_USE)
        if self.name == "a":
            gcode.register_command("USE_A", self.cmd_USE)

    def _build(self):
        self.mcu.create_oid()
        self.mcu.request_move_queue_slot()
        self.mcu.add_config_cmd("debug_ping data=0102")
        for text in self.texts:
            self.mcu.lookup_command(text)

    def _note_init(self):
        self.is_set_up = True

    def cmd_USE(self, gcmd):
        gcmd.respond_info("used")


def load_config_prefix(config):
    return Thing(config)
"""
CONFIG = "[mcu]\nserial: /dev/none\n\n"
NEOPIXEL = "neopixel_send oid=%c"


@pytest.fixture
def make_bench(tmp_path, monkeypatch):
    """make_bench(config): a Bench that has the sections [bearable x] and [needed x]."""
    folder = tmp_path / "extras"
    folder.mkdir()
    (folder / "bearable.py").write_text(ROW % "MAY_LACK_FIRMWARE = True")
    (folder / "needed.py").write_text(ROW % "")
    monkeypatch.setattr(klippy.extras, "__path__",
                        [*klippy.extras.__path__, str(folder)])
    logging.disable(logging.NOTSET)

    def make(config, machine=None):
        return Bench(tmp_path, monkeypatch, CONFIG + config, machine)
    yield make
    import sys
    for name in ("bearable", "needed"):
        sys.modules.pop("klippy.extras." + name, None)


def list_formats(option):
    """Commands of an option, as the simulator's firmware and the sources have them."""
    names = [name for name, clauses in features.read_table()["commands"].items()
             if [option] in clauses or option == "WANT_SPI" and name == "spi_set_bus"]
    path = firmware.find_firmware().replace("klipper.so", "klipper.dict")
    with open(path, encoding="utf-8") as file:
        known = {text.split()[0]: text for text in json.load(file)["commands"]}
    return [known.get(name, name + " oid=%c") for name in names]


def use(it, command="USE THING=a"):
    it.printer.lookup_object("gcode").run_script(command)


def get_warnings(it):
    status = it.printer.lookup_object("configfile").get_status(0.)
    return [warning["message"] for warning in status["warnings"]]


@pytest.mark.parametrize("option", reduced_firmware.list_options())
def test_each_option_that_is_left_out(make_bench, monkeypatch, option):
    """Bearable: ready, told, its commands say why.  Needed: no start, and why."""
    reduced_firmware.patch(
        monkeypatch, lambda table: reduced_firmware.remove(table, {option}),
        range(10))
    texts = "texts: %s\n" % ("; ".join(list_formats(option)),)
    prompt = features.read_table()["options"][option]
    said = []

    def watch(config, objects):
        config.get_printer().lookup_object("gcode").register_output_handler(said.append)

    def check_ready(it):
        assert it.state == "ready", it.message
        [warning] = get_warnings(it)
        assert warning.startswith("[bearable a] at ") and "printer.cfg:4 " in warning
        assert "firmware of mcu 'mcu' lacks the command '" in warning
        assert "'%s' (%s)" % (prompt, option) in warning and "flash" in warning
        assert [text for text in said if option in text] == ["// Warning: " + warning]
        for command in ("USE THING=a", "USE_A"):
            with pytest.raises(CommandError, match=re.escape(warning)):
                use(it, command)
        use(it, "USE THING=b")
        assert it.printer.lookup_object("bearable b").is_set_up
        assert not it.printer.lookup_object("bearable a").is_set_up

    sections = "[bearable a]\n%s[bearable b]\ntexts: debug_nop\n" % (texts,)
    assert make_bench(sections).run(check_ready, watch) == "exit"

    def check_refused(it):
        assert it.state == "error"
        assert it.message.startswith("The printer cannot run without [needed a] at ")
        assert "'%s' (%s)" % (prompt, option) in it.message

    make_bench("[needed a]\n" + texts).run(check_refused)


def remove_neopixel(table):
    return reduced_firmware.remove(table, {"WANT_NEOPIXEL"})


def test_nothing_of_the_part_is_sent(make_bench, monkeypatch):
    """Nor does it keep room in the move queue; what others have is there."""
    reduced_firmware.patch(monkeypatch, remove_neopixel)
    it = make_bench("[bearable a]\ntexts: %s\n[bearable b]\ntexts: debug_nop\n"
                    % (NEOPIXEL,))

    def body(it):
        phase = it.mcu._config
        assert phase.config_cmds[1:-1] == ["debug_nop", "debug_ping data=0102"]
        assert phase.move_slots == 1
        assert not absence.is_absent(it.mcu)
        lacking, whole = (it.printer.lookup_object("bearable " + name).part
                          for name in "ab")
        assert absence.is_absent(lacking) and not absence.is_absent(whole)
        absence.raise_if_absent(whole)
        for check in (absence.raise_if_absent, absence.raise_if_lacking):
            with pytest.raises(CommandError, match="neopixel"):
                check(lacking)
    it.run(body)


def test_restart_of_the_host_keeps_the_configuration(make_bench, monkeypatch):
    reduced_firmware.patch(monkeypatch, remove_neopixel, range(9))
    it = make_bench("[bearable a]\ntexts: %s\n" % (NEOPIXEL,))
    for _ in range(2):
        assert it.run(lambda it: use(it, "STATUS")) == "exit"
        assert it.state == "ready" and it.printer.run_result == "exit"


def test_other_form_of_a_command(make_bench, monkeypatch):
    """Its remedy is firmware of this version, not another option."""
    def change(table):
        table["commands"]["neopixel_send oid=%c twice=%c"] = table["commands"].pop(
            NEOPIXEL)
        return table
    reduced_firmware.patch(monkeypatch, change)
    it = make_bench("[bearable a]\ntexts: %s\n" % (NEOPIXEL,))

    def body(it):
        [warning] = get_warnings(it)
        assert ("has another form of the command 'neopixel_send'" in warning
                and "twice=%c" in warning and "build the firmware of this version"
                in warning and "WANT_" not in warning)
    it.run(body)


def test_wider_fields_and_longer_responses_serve():
    parser = msgproto.MessageParser()
    parser.process_identify(json.dumps({
        "commands": {"wide oid=%c value=%u": 4, "narrow oid=%c value=%hu": 5,
                     "swapped value=%u oid=%c": 6, "text oid=%c value=%*s": 7},
        "responses": {"state value=%hu more=%c oid=%c": 8, "short oid=%c": 9},
        "config": {}}).encode(), decompress=False)
    assert parser.lookup_command("wide oid=%c value=%hu").encode([1, 2]) == b"\4\1\2"
    for other in ("narrow oid=%c value=%u", "swapped oid=%c value=%u",
                  "text oid=%c value=%u", "wide oid=%c value=%*s", "wide oid=%c"):
        with pytest.raises(msgproto.MissingError, match="mismatch") as info:
            parser.lookup_command(other)
        assert info.value.is_other and info.value.kind == "command"
    assert parser.lookup_command("state oid=%c value=%hu").msgid == 8
    for other in ("short oid=%c value=%c", "state oid=%c value=%*s"):
        with pytest.raises(msgproto.MissingError, match="mismatch") as info:
            parser.lookup_command(other)
        assert info.value.kind == "response"


def test_constants_and_names():
    parser = msgproto.MessageParser()
    parser.process_identify(json.dumps({
        "commands": {"set_bus oid=%c spi_bus=%u": 4, "set_kind oid=%c kind=%c": 5,
                     "set_pin oid=%c cs_pin=%u data=%*s": 6},
        "responses": {}, "config": {},
        "enumerations": {"kind": {"a": 0, "b": 1}, "pin": {"PA0": 0}}}).encode(),
        decompress=False)
    with pytest.raises(msgproto.MissingError) as info:
        parser.get_constant_float("ADC_MAX")
    assert "'Analog inputs (heaters, thermistors)' (WANT_ADC)" in features.explain(
        "m", info.value)
    with pytest.raises(msgproto.MissingError) as info:
        parser.check_text("set_bus oid=1 spi_bus=spi1")
    assert "WANT_SPI" in features.explain("m", info.value)
    with pytest.raises(msgproto.UnknownNameError, match="'c' is no kind .* a, b"):
        parser.check_text("set_kind oid=1 kind=c")
    for good in ("set_kind oid=1 kind=b", "set_kind oid=1 kind=7",
                 "set_bus oid=1 spi_bus=2", "set_pin oid=1 cs_pin=later data=ff"):
        parser.check_text(good)
    for bad in ("unknown oid=1", "set_kind oid=1"):
        with pytest.raises(msgproto.MissingError):
            parser.check_text(bad)


def test_unknown_name_is_an_error_of_the_config(make_bench):
    """Firmware that has the feature and not that name: no degrading."""
    def make(config, objects):
        mcu = config.get_printer().lookup_object("mcu")
        mcu.add_config_cmd("config_thermocouple oid=0 spi_oid=1"
                           " thermocouple_type=MAX99999")
    it = make_bench("")

    def body(it):
        assert it.state == "error"
        assert "'MAX99999' is no thermocouple_type" in it.message
        assert "MAX31855" in it.message and "mcu 'mcu'" in it.message
    it.run(body, make)


def test_parts_that_serve_several_sections(make_bench, monkeypatch):
    """Bearable only if all can bear it, and then the commands of all say so."""
    class Loading:
        name, may_lack = "x", True
    users = [("first", True), ("second", True)]

    def make(config, objects):
        from klippy.printer import LoadedSection
        printer = config.get_printer()
        mcu, loading = printer.lookup_object("mcu"), printer.loader.loading
        for name, may_lack in users:
            loading.append(LoadedSection(name, may_lack))
            if name == "first":
                part = absence.make_part(mcu)
                part.register_config_callback(lambda: mcu.lookup_command("nowhere"))
            absence.add_user(part)
            printer.lookup_object("gcode").register_command(
                name.upper(), lambda gcmd: None)
            loading.pop()
        objects.part = part

    def body(it):
        assert it.state == "ready"
        for name in ("FIRST", "SECOND"):
            with pytest.raises(CommandError, match=r"\[first\] and \[second\] cannot"):
                use(it, name)
        assert len(it.objects.part.users) == 2
    make_bench("").run(body, make)
    users[1] = ("second", False)

    def body(it):
        assert it.state == "error" and "[first] and [second]" in it.message
    make_bench("").run(body, make)


def test_less_than_the_section(make_bench):
    """What an option lacks leaves the commands of its section alone."""
    def make(config, objects):
        from klippy.printer import LoadedSection
        printer = config.get_printer()
        mcu, loading = printer.lookup_object("mcu"), printer.loader.loading
        loading.append(LoadedSection("cooler", True))
        part = absence.make_part(mcu, "option 'counter'", may_lack=True)
        part.register_config_callback(lambda: mcu.lookup_command("nowhere"))
        printer.lookup_object("gcode").register_command("COOL", lambda gcmd: None)
        loading.pop()

    def body(it):
        use(it, "COOL")
        [warning] = get_warnings(it)
        assert warning.startswith("option 'counter' of [cooler] cannot be used")
        assert "'make menuconfig' and 'make'" in warning
    make_bench("").run(body, make)


def test_what_is_looked_up_later(make_bench, monkeypatch):
    """An error outside of the configuration says as much."""
    reduced_firmware.patch(monkeypatch, lambda table: reduced_firmware.remove(
        table, {"WANT_HARD_PWM"}))

    def body(it):
        assert it.state == "ready"
        for look in (lambda: it.mcu.lookup_command("queue_pwm_out oid=%c clock=%u"),
                     lambda: it.mcu.get_constant_float("PWM_MAX"),
                     lambda: it.mcu.lookup_query_command("set_pwm_out", "uptime")):
            with pytest.raises(msgproto.error, match="^The firmware of mcu 'mcu' lacks"
                               r" the .* with 'Hardware pwm' \(WANT_HARD_PWM\)"):
                look()
    make_bench("").run(body)


def test_board_that_comes_later_and_lacks_what_is_needed(make_bench, monkeypatch):
    """It is there, and not used; the printer goes on without it, as before."""
    machine = Machine({"mcu": 0., "aux": 0.})
    machine.mcus["aux"].link.cut()
    reduced_firmware.patch(monkeypatch, remove_neopixel, range(1, 20))
    it = make_bench("[needed a]\non: aux\ntexts: %s\n\n[mcu aux]\nserial: /dev/none\n"
                    "is_non_critical: True\n" % (NEOPIXEL,), machine)

    def body(it):
        assert it.state == "ready"
        said = []
        it.printer.lookup_object("gcode").register_output_handler(said.append)
        machine.mcus["aux"].link.restore()
        it.pause(3.)
        assert it.state == "ready" and not get_warnings(it)
        assert it.printer.lookup_object("mcu aux").non_critical_disconnected
        [text] = [text for text in said if "WANT_NEOPIXEL" in text]
        assert "Mcu 'aux' cannot be used: The printer cannot run without" in text
    it.run(body)


def test_board_that_comes_later(make_bench, monkeypatch):
    """Absent at the start, it is told of when it is there, and only once."""
    machine = Machine({"mcu": 0., "aux": 0.})
    machine.mcus["aux"].link.cut()
    reduced_firmware.patch(monkeypatch, remove_neopixel, range(1, 20))
    it = make_bench("[bearable a]\non: aux\ntexts: %s\n\n[mcu aux]\nserial: /dev/none\n"
                    "is_non_critical: True\n" % (NEOPIXEL,), machine)

    def body(it):
        assert it.state == "ready" and not get_warnings(it)
        use(it)
        said = []
        it.printer.lookup_object("gcode").register_output_handler(said.append)
        for _ in range(2):
            machine.mcus["aux"].link.restore()
            it.pause(3.)
            [warning] = get_warnings(it)
            with pytest.raises(CommandError, match="WANT_NEOPIXEL"):
                use(it)
            machine.mcus["aux"].link.cut()
            it.pause(8.)
        assert sum("WANT_NEOPIXEL" in text and "Warning" in text
                   for text in said) == 1
    it.run(body)
