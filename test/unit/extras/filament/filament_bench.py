# SPDX-License-Identifier: GPL-3.0-or-later
"""A printer that prints files from a spool that may run empty or jam."""
import motion_bench
import motion_machine

COMMON = """
[virtual_sdcard]
path: %s
[pause_resume]
[respond]
[force_move]
"""
LINE_E = 0.8                    # mm of filament a line of 10 mm


class FilamentBench(motion_bench.MotionBench):
    """The machine with an extruder, a spool and an SD card."""

    def __init__(self, tmp_path, monkeypatch, config):
        self.folder = tmp_path
        super().__init__(tmp_path, monkeypatch,
                         motion_machine.PRINTER + COMMON % (tmp_path,) + config)

    @property
    def spool(self):
        return self.machine.filament.spools["extruder"]

    @property
    def state(self):
        return self.get("print_stats")["state"]

    def write_job(self, n_lines=100):
        """A file of so many lines of 10 mm at 20 mm/s."""
        lines = ["G28", "G90", "M83", "G1 X10 Y50 Z0.2 F6000", "G1 F1200"]
        lines += ["G1 X%d E%.3f" % (20 if i % 2 else 10, LINE_E)
                  for i in range(1, n_lines + 1)]
        (self.folder / "job.gcode").write_text("\n".join(lines) + "\n")

    def start_job(self, n_lines=100):
        self.write_job(n_lines)
        self.send("SDCARD_PRINT_FILE FILENAME=job.gcode")

    def wait_state(self, *states, seconds=120):
        """Let time pass until print_stats is in one of these states."""
        for _ in range(int(seconds / 0.1)):
            if self.state in states:
                return self.state
            self.pause(0.1)
        raise AssertionError("print_stats stays at %s" % (self.state,))

    def count(self, text):
        """Console lines that hold a text."""
        return sum(text in line for line in self.output)
