# SPDX-License-Identifier: GPL-3.0-or-later
"""The life of a printer: loading, events, states, errors, exit."""

import pytest
from virtualclock import EmptyWorld

import klippy.extras
from klippy import printer as printer_module
from klippy.errors import CommandError, ConfigError, ConfigErrors, McuError
from klippy.printer import Printer
from klippy.reactor import Reactor

GOOD = """
def load_config(config):
    config.getfloat("speed", above=0.)
    return Thing(config)
def load_config_prefix(config):
    return Thing(config)
class Thing:
    def __init__(self, config):
        self.name = config.get_name()
"""


class Core:
    """Stands for the modules of the mcus and the motion."""

    def __init__(self, name, log):
        self.name, self.log = name, log

    def add_printer_objects(self, config):
        self.log.append(self.name)
        config.getsection("printer").get("kinematics", None)


@pytest.fixture
def make(tmp_path, monkeypatch):
    """make(text, **start_args) gives a printer whose extras are in a folder."""
    folder = tmp_path / "extras"
    folder.mkdir()
    monkeypatch.setattr(klippy.extras, "__path__",
                        [str(folder), *klippy.extras.__path__])
    (folder / "thing_good.py").write_text(GOOD)
    (folder / "thing_broken.py").write_text("import module_of_nobody\n")
    (folder / "thing_syntax.py").write_text("def (:\n")
    (folder / "thing_only_prefix.py").write_text(
        "def load_config_prefix(config):\n    return 1\n")
    log = []
    monkeypatch.setattr(printer_module, "FIRST_MODULES", (Core("first", log),))
    monkeypatch.setattr(printer_module, "LAST_MODULES", (Core("last", log),))
    reactors = []

    def make_printer(text, **start_args):
        (tmp_path / "printer.cfg").write_text(text)
        reactors.append(Reactor(EmptyWorld()))
        start_args["config_file"] = str(tmp_path / "printer.cfg")
        instance = Printer(reactors[-1], None, start_args)
        instance.core_log = log
        return instance
    yield make_printer
    for reactor in reactors:
        reactor.finalize()


def run_until(printer, time=110., result="exit"):
    printer.get_reactor().register_callback(
        lambda e: printer.request_exit(result), time)
    return printer.run()


def test_events_come_in_order_and_the_state_is_ready(make):
    printer, log = make("[thing_good]\nspeed: 1\n[thing_good a]\n"), []
    for name in ("mcu_identify", "connect", "ready", "disconnect",
                 "firmware_restart", "shutdown"):
        printer.register_event_handler(
            "klippy:" + name,
            lambda name=name: log.append((name, printer.get_state_message()[1])))
    assert run_until(printer, result="firmware_restart") == "firmware_restart"
    assert log == [("mcu_identify", "startup"), ("connect", "startup"),
                   ("ready", "ready"), ("firmware_restart", "ready"),
                   ("disconnect", "ready")]
    assert printer.core_log == ["first", "last"]
    assert printer.lookup_object("thing_good a").name == "thing_good a"
    assert [n for n, _ in printer.lookup_objects("thing_good")] == [
        "thing_good", "thing_good a"]


def load_errors(printer):
    with pytest.raises(ConfigError) as info:
        printer.load()
    err = info.value
    return [str(e) for e in (err.errors if isinstance(err, ConfigErrors) else [err])]


def test_all_errors_of_a_config_are_told(make):
    errors = load_errors(make(
        "[thing_good]\nspeed: 0\n[thing_good b]\nextra: 1\n[thing_broken]\n"
        "[thing_syntax]\n[thing_god]\n[thing_only_prefix]\n"))
    assert len(errors) == 6
    texts = "\n".join(errors)
    for wanted in ("printer.cfg:2: option 'speed' in section [thing_good]: '0' must",
                   "printer.cfg:4: section [thing_good b] has no option 'extra'",
                   "printer.cfg:5: the module of section [thing_broken] cannot be"
                   " imported: it needs the Python module 'module_of_nobody'",
                   "printer.cfg:6: the module of section [thing_syntax]",
                   "printer.cfg:7: there is no section kind [thing_god]; did you mean"
                   " [thing_good]?",
                   "printer.cfg:8: section [thing_only_prefix] must have a name"):
        assert wanted in texts


def test_one_failed_section_is_told_once(make):
    printer = make("[thing_good]\nspeed: x\n")
    printer_log = []
    original = Core.add_printer_objects

    def add(self, config):
        original(self, config)
        if self.name == "last":
            printer_log.append(1)
            printer.load_object(config, "thing_good")
    try:
        Core.add_printer_objects = add
        assert len(load_errors(printer)) == 1 and printer_log
    finally:
        Core.add_printer_objects = original


def test_failed_core_gives_no_errors_about_what_it_would_read(make, monkeypatch):
    printer = make("[printer]\nkinematics: x\n[thing_good]\nspeed: 1\n[mcu]\n"
                   "serial: x\n[stepper_x]\npin: 1\n[thing_god]\n")

    def fail(self, config):
        raise ConfigError("no mcu")
    monkeypatch.setattr(Core, "add_printer_objects", fail)
    errors = load_errors(printer)
    assert len(errors) == 2 and "[thing_god]" in errors[1]
    assert errors[0].endswith("printer.cfg: no mcu")


def test_bad_config_keeps_the_printer_up_with_a_message(make):
    printer = make("[thing_god]\n")
    assert run_until(printer) == "exit"
    message, state = printer.get_state_message()
    assert state == "error" and "RESTART" in message and "thing_god" in message


def test_bad_config_ends_a_batch_run(make, tmp_path):
    (tmp_path / "job.gcode").write_text("")
    printer = make("[thing_god]\n", debuginput=str(tmp_path / "job.gcode"))
    assert printer.run() == "error_exit"


def test_restart_works_with_a_bad_config(make):
    printer = make("nonsense\n")
    gcode = printer.lookup_object("gcode")
    printer.get_reactor().register_callback(
        lambda e: gcode.run_script("RESTART"), 105.)
    assert printer.run() == "restart"


def test_objects(make):
    printer = make("")
    printer.add_object("one", 1)
    with pytest.raises(ConfigError, match="'one' exists already"):
        printer.add_object("one", 2)
    with pytest.raises(ConfigError, match="no printer object 'onne'; did you mean"):
        printer.lookup_object("onne")
    assert printer.lookup_object("onne", None) is None
    assert printer.lookup_objects("two") == []
    config = printer.lookup_object("configfile").read_main_config()
    assert printer.load_object(config, "thing_nobody", None) is None
    with pytest.raises(printer.config_error, match="no module 'thing_nobody'"):
        printer.load_object(config, "thing_nobody")
    assert printer.command_error is CommandError


def test_shutdown_calls_all_handlers_even_if_one_fails(make, caplog):
    printer, log = make(""), []

    def fail():
        raise ValueError("on purpose")
    for handler in (lambda: log.append(1), fail, lambda: log.append(2)):
        printer.register_event_handler("klippy:shutdown", handler)
    printer.register_event_handler(
        "klippy:analyze_shutdown", lambda msg, details: log.append((msg, details)))
    reactor = printer.get_reactor()
    reactor.register_callback(
        lambda e: printer.invoke_shutdown("stop now", {"mcu": "m"}), 105.)
    reactor.register_callback(lambda e: printer.invoke_shutdown("second"), 106.)
    run_until(printer)
    assert log == [1, 2, ("stop now", {"mcu": "m"})]
    message, state = printer.get_state_message()
    assert state == "shutdown" and printer.is_shutdown()
    assert message.startswith("stop now") and "FIRMWARE_RESTART" in message
    assert "second" not in message


def test_shutdown_while_connecting_stops_the_start(make):
    printer, log = make(""), []
    printer.register_event_handler(
        "klippy:connect", lambda: printer.invoke_shutdown("early"))
    printer.register_event_handler("klippy:ready", lambda: log.append("ready"))
    run_until(printer)
    assert log == [] and printer.get_state_message()[1] == "shutdown"


def test_mcu_error_is_announced_with_its_details(make):
    printer, log = make(""), []

    def fail():
        raise McuError("no answer", {"event_type": "connect"})

    def handle(message, details):
        log.append(details)
        printer.update_error_msg(message, "better text")
        printer.update_error_msg("other", "worse text")
    printer.register_event_handler("klippy:mcu_identify", fail)
    printer.register_event_handler("klippy:notify_mcu_error", handle)
    run_until(printer)
    assert log == [{"event_type": "connect"}]
    assert printer.get_state_message() == ("better text", "error")


def test_internal_error_shuts_down_and_the_printer_stays_up(make):
    printer = make("")

    def fail(eventtime):
        raise KeyError("lost")
    printer.get_reactor().register_callback(fail, 105.)
    assert run_until(printer) == "exit"
    message, state = printer.get_state_message()
    assert state == "shutdown" and "Internal error: KeyError" in message


def test_internal_error_while_loading(make, tmp_path):
    (tmp_path / "extras" / "thing_bug.py").write_text(
        "def load_config(config):\n    return 1 / 0\n")
    printer = make("[thing_bug]\n")
    assert run_until(printer) == "exit"
    message, state = printer.get_state_message()
    assert state == "shutdown" and "ZeroDivisionError" in message


def test_async_shutdown(make):
    printer = make("")
    printer.get_reactor().register_callback(
        lambda e: printer.invoke_async_shutdown("from a thread"), 105.)
    run_until(printer)
    assert printer.get_state_message()[0].startswith("from a thread")


def test_first_result_counts(make):
    printer = make("")
    printer.request_exit("restart")
    assert run_until(printer) == "restart"


class FakeLog:
    """Collects what each new log file starts with."""

    def __init__(self):
        self.info = {}

    def set_rollover_info(self, name, info):
        self.info[name] = info


def test_config_is_logged_in_each_new_file(make):
    printer = make("[thing_good]\nspeed: 1\n")
    printer.bglogger = FakeLog()
    run_until(printer)
    assert "[thing_good]\nspeed = 1" in printer.bglogger.info["config"]


def test_save_config_writes_and_restarts(make, tmp_path):
    printer = make("[thing_good]\nspeed: 1\n")
    gcode = printer.lookup_object("gcode")

    def save(eventtime):
        gcode.run_script("SAVE_CONFIG")         # nothing to save
        assert printer.run_result is None
        printer.lookup_object("configfile").set("thing_good", "speed", 2.5)
        gcode.run_script("SAVE_CONFIG")
    printer.get_reactor().register_callback(save, 105.)
    assert printer.run() == "restart"
    text = (tmp_path / "printer.cfg").read_text()
    assert "#speed: 1\n" in text and "#*# speed = 2.5\n" in text
    status = printer.lookup_object("configfile").get_status(0.)
    assert status["save_config_pending"] is False


def test_save_config_that_cannot_write_says_so(make, tmp_path):
    printer = make("[thing_good]\nspeed: 1\n")
    gcode, errors = printer.lookup_object("gcode"), []

    def save(eventtime):
        printer.lookup_object("configfile").set("thing_good", "speed", 2.5)
        (tmp_path / "printer.cfg").unlink()
        with pytest.raises(CommandError) as info:
            gcode.run_script("SAVE_CONFIG")
        errors.append(str(info.value))
    printer.get_reactor().register_callback(save, 105.)
    assert run_until(printer) == "exit"
    assert "printer.cfg" in errors[0] and "Unable to write" in errors[0]
    assert printer.lookup_object("configfile").save.is_pending
