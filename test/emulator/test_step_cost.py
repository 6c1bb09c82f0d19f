# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps cost no more than they do: ceilings a few instructions above what
`make bench-firmware` prints.  Raise one only with a reason."""

import pytest
import step_bench
import unicorn_board

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

LINES = {line.config: line for line in step_bench.LINES}
# Instructions of an interrupt with one step; ticks of one and of three motors
CEILINGS = {
    "stm32f072": (43, 44, 174),
    "stm32f070": (80, 51, 197),
    "stm32f103": (40, 33, 147),
    "stm32f407": (40, 34, 151),
    "stm32f446": (40, 34, 151),
    "stm32f765": (41, 33, 145),
    "lpc1768": (40, 33, 146),
    "sam3x8e": (40, 33, 147),
    "same70q20b": (40, 33, 145),
    "samd21g18_serial": (40, 42, 168),
    "samc21g18": (66, 53, 208),
    "rp2040_serial": (39, 5, 18),
    "rp2350": (38, 31, 140),
}
# Much like others
SLOW = {"stm32f070", "stm32f446", "stm32f765", "sam3x8e", "samc21g18", "rp2350"}


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.mark.parametrize("config", [
    pytest.param(c, marks=pytest.mark.slow if c in SLOW else ()) for c in CEILINGS])
def test_cost_of_a_step(config, adapter):
    """By itself, from entry to return; and in an endless row, all on time."""
    single, one, three = CEILINGS[config]
    bench = step_bench.Bench(LINES[config], adapter)
    least, mean = bench.measure_step()
    assert least <= single and mean <= single + 2, (least, mean)
    assert bench.survives(1, one, step_bench.PROBE_COUNT)
    assert bench.survives(3, three, step_bench.PROBE_COUNT)


@pytest.mark.parametrize("config", [c for c in CEILINGS if LINES[c].field])
def test_aim(config):
    """15 % less than what the field is known for; 40 instructions a step."""
    single, one, three = CEILINGS[config]
    field_one, field_three = LINES[config].field
    assert one <= 0.85 * field_one and three <= 0.85 * field_three
    assert single <= 40
