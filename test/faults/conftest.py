# SPDX-License-Identifier: GPL-3.0-or-later
"""What the fault tests share."""

import pathlib
import sys

import pytest
from daemon_run import Host

# The model that judges steps
sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "klippy"))


@pytest.fixture
def make_host(tmp_path, caplog):
    """make_host(config, options) gives a Host; no exception may escape in it."""
    hosts = []

    def make(config, options=()):
        hosts.append(Host(tmp_path, config, options))
        return hosts[-1]
    yield make
    escaped = [r for r in caplog.get_records("call") if r.exc_info is not None]
    assert not escaped, escaped
