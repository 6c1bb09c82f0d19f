# SPDX-License-Identifier: GPL-3.0-or-later
include src/armcm/rules.mk
include src/flash.mk
