# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of a finished simulated job, for the terminal and the report."""
import math

from klippy.simulator.progress import format_duration

FILAMENT_DENSITY = 1.24         # g/cm^3, PLA


def collect(machine, printer, result, wall):
    """[(label, text)] of everything worth knowing; wall: s."""
    virtual = machine.world.monotonic()
    rows = [("Print time", format_duration(result.print_duration)),
            ("Total time", format_duration(result.total_duration)),
            ("Filament", format_filament(result.filament_used))]
    if result.final_position is not None:
        rows.append(("End position",
                     "X%.4f Y%.4f Z%.4f" % result.final_position))
    rows += _collect_steps(machine)
    rows += _collect_links(machine)
    if result.min_margin is not None:
        rows.append(("Least queue margin", "%.3f s" % result.min_margin))
    sdcard = printer.lookup_object("virtual_sdcard", None)
    if sdcard is not None and sdcard.error_policy.skipped_lines:
        rows.append(("Skipped lines", str(sdcard.error_policy.skipped_lines)))
    rows += [("Stalls", str(result.stalls)),
             ("Late mcu events", str(count_late(machine))),
             ("Simulated time", format_duration(virtual)),
             ("Wall time", "%.1f s" % wall),
             ("Speed-up", "%.0fx" % (virtual / max(wall, 1e-9)))]
    return rows


def count_late(machine):
    """Timers that ran late on any mcu."""
    return sum(mcu.late_events for mcu in machine.mcus.values())


def format_filament(length):
    """Length in m and mass in g of 1.75 mm PLA, for a length in mm."""
    volume = length * math.pi * (1.75 / 2.0) ** 2
    return "%.2f m (%.1f g)" % (length / 1000.0,
                                volume * FILAMENT_DENSITY / 1000.0)


def _collect_steps(machine):
    counts = machine.get_total_steps()
    if not counts:
        return []
    text = ", ".join("%s %s" % (name.replace("stepper_", ""), f"{n:,}")
                     for name, n in counts.items())
    return [("Steps", text)]


def _collect_links(machine):
    rows = []
    for name, mcu in machine.mcus.items():
        link = mcu.link
        text = "%s bytes to it, %s back" % (f"{link.bytes_to_mcu:,}",
                                            f"{link.bytes_from_mcu:,}")
        rows.append(("mcu" if name == "mcu" else "mcu " + name, text))
    return rows


def format_rows(result, rows):
    """Text block for the terminal."""
    head = "Done." if result.is_ok else "FAILED: " + result.message
    width = max(len(label) for label, _ in rows)
    return "\n".join(["", head, *("  %-*s  %s" % (width, label, text)
                                  for label, text in rows)])
