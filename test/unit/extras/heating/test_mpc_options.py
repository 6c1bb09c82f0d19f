# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fan takes away may be written as all that is lost, or as what is added."""
import pytest

from klippy.extras.mpc_options import parse_transfers


@pytest.mark.parametrize("text", ["0, 0.02, 0.03", "0.065, 0.085, 0.095"])
def test_differences_to_the_fan_when_off_count(text):
    assert parse_transfers(text) == pytest.approx((0.0, 0.02, 0.03))


def test_less_than_without_a_fan_is_none():
    assert parse_transfers("0.05, 0.04, 0.06") == pytest.approx((0.0, 0.0, 0.01))
    assert parse_transfers("") == ()


@pytest.mark.parametrize("text", ["0, -0.1", "0, nan", "much"])
def test_what_is_no_loss_is_refused(text):
    with pytest.raises(ValueError):
        parse_transfers(text)
