# SPDX-License-Identifier: GPL-3.0-or-later
"""QUERY_ADC: last value of any analog pin that something registered."""

from klippy.mcu import absence


class QueryADC:
    """Registry of analog pins by name."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.adc = {}
        self.printer.lookup_object("gcode").register_command(
            "QUERY_ADC", self.cmd_QUERY_ADC, desc=self.cmd_QUERY_ADC_help)

    def register_adc(self, name, mcu_adc):
        """Make mcu_adc known under a name for QUERY_ADC."""
        self.adc[name] = mcu_adc

    cmd_QUERY_ADC_help = "Report the last value of an analog pin"

    def cmd_QUERY_ADC(self, gcmd):
        name = gcmd.get("NAME", None)
        if name not in self.adc:
            names = ", ".join('"%s"' % n for n in self.adc)
            gcmd.respond_info("Available ADC objects: %s" % (names or "none"))
            return
        absence.raise_if_lacking(getattr(self.adc[name], "part", None))
        value, sample_time = self.adc[name].get_last_value()
        answer = 'ADC object "%s" has value %.6f (timestamp %.3f)' % (
            name, value, sample_time)
        pullup = gcmd.get_float("PULLUP", None, above=0.0)
        if pullup is not None:
            value = min(max(value, 1e-5), 1.0 - 1e-5)
            answer += "\n resistance %.3f (with %.0f pullup)" % (
                pullup * value / (1.0 - value), pullup)
        gcmd.respond_info(answer)


def register(config, name, mcu_adc):
    """Register an analog pin, loading query_adc when it is not there."""
    config.get_printer().load_object(config, "query_adc").register_adc(
        name.split()[-1], mcu_adc)


def load_config(config):
    return QueryADC(config)
