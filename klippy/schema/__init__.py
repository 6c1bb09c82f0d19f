# SPDX-License-Identifier: GPL-3.0-or-later
"""What the modules declare: options with types and ranges, commands with parameters.

Nothing is listed twice: the sections' own loaders are run and watched (recorder,
explore), their findings put together (merge), and written as JSON Schema
(jsonform) or as a reference (markdown).
"""
