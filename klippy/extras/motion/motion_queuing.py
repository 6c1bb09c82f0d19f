# SPDX-License-Identifier: GPL-3.0-or-later
"""Printer object motion_queuing: hands out the motion queue."""
from klippy.motionqueue import MotionQueue


def load_config(config):
    return MotionQueue(config)
