# SPDX-License-Identifier: GPL-3.0-or-later
"""All sections, explored once for all tests of this folder."""
import pytest

from klippy.schema.catalog import read_catalog


@pytest.fixture(scope="session")
def catalog():
    return read_catalog()
