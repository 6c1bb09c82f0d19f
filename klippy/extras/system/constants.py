# SPDX-License-Identifier: GPL-3.0-or-later
"""[constants]: values for references of the config, `${constants.name}`."""


def load_config(config):
    """Take all options as known; warn about those that nothing refers to."""
    names = config.get_prefix_options("")
    referenced = config.fileconfig.referenced
    pconfig = config.get_printer().lookup_object("configfile")
    for name in names:
        config.get(name)
        if (config.get_name(), name) not in referenced:
            pconfig.runtime_warning("Constant '%s' is unused" % (name,))
    return {}
