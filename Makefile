# SPDX-License-Identifier: GPL-3.0-or-later
.DEFAULT_GOAL := firmware

include src/firmware.mk
