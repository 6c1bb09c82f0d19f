# SPDX-License-Identifier: GPL-3.0-or-later
"""An analog input, sampled by the mcu and reported at fixed times."""

from klippy.mcu import absence

MAX_REPORT_BYTES = 48
QUERY_FORMATS = (
    "query_analog_in oid=%c clock=%u sample_ticks=%u sample_count=%c rest_ticks=%u"
    " bytes_per_report=%c min_value=%hu max_value=%hu range_check_count=%c",
    "query_analog_in oid=%c clock=%u sample_ticks=%u sample_count=%c rest_ticks=%u"
    " min_value=%hu max_value=%hu range_check_count=%c")
STATE_FORMATS = ("analog_in_state oid=%c next_clock=%u values=%*s",
                 "analog_in_state oid=%c next_clock=%u value=%hu")


class MCU_adc:
    """Reads one pin; values are fractions (0..1) of the reference voltage."""

    def __init__(self, mcu, pin_params):
        self._mcu = mcu
        self._pin = pin_params["pin"]
        self._oid = None
        self._sample_time = self._report_time = 0.
        self._sample_count = self._batch_num = self._range_check_count = 0
        self._minval, self._maxval = 0., 1.
        self._report_clock = 0
        self._inv_max_adc = 0.
        self._callback = None
        self._last_state = (0., 0.)
        self.part = absence.find_part(mcu)
        self.part.register_config_callback(self._build_config)
        absence.watch(mcu, self._handle_loss, None)

    def get_mcu(self):
        """The MCU of this pin."""
        return self._mcu

    def setup_adc_sample(self, report_time, sample_time, sample_count=1, batch_num=1,
                         minval=0., maxval=1., range_check_count=0):
        """Set up periodic sampling, in s; sums of sample_count samples.

        The mcu shuts down after range_check_count reports outside minval..maxval.
        batch_num reports are sent in one message where the firmware can.
        """
        self._report_time = report_time
        self._sample_time, self._sample_count = sample_time, sample_count
        self._batch_num = batch_num
        self._minval, self._maxval = minval, maxval
        self._range_check_count = range_check_count

    def setup_minmax(self, sample_time, sample_count, minval=0., maxval=1.,
                     range_check_count=0):
        """Older way to set up sampling; the report time comes separately."""
        self.setup_adc_sample(self._report_time, sample_time, sample_count, 1,
                              minval, maxval, range_check_count)

    def setup_adc_callback(self, callback, old_callback=None):
        """Call callback([(read_time, value), ...]) with every report.

        The older form setup_adc_callback(report_time, callback) gets
        (read_time, value) one by one.  Runs in the response thread.
        """
        if old_callback is None:
            self._callback = callback
            return
        self._report_time = callback
        self._callback = lambda samples: [old_callback(t, v) for t, v in samples]

    def get_last_value(self):
        """The last reading as (value, read_time); read_time is a print_time."""
        return self._last_state

    def _handle_loss(self):
        self._last_state = (0., 0.)

    def _build_config(self):
        if not self._sample_count:
            return
        mcu = self._mcu
        self._oid = mcu.create_oid()
        mcu.add_config_cmd("config_analog_in oid=%d pin=%s" % (self._oid, self._pin))
        scale = self._sample_count * mcu.get_constant_float("ADC_MAX")
        self._inv_max_adc = 1. / scale
        self._report_clock = mcu.seconds_to_clock(self._report_time)
        self._add_query(scale)

    def _add_query(self, scale):
        mcu = self._mcu
        has_batch = mcu.try_lookup_command(QUERY_FORMATS[0]) is not None
        clock = mcu.get_query_slot(self._oid)
        min_value = max(0, min(0xffff, int(self._minval * scale)))
        max_value = max(0, min(0xffff, int(-(-self._maxval * scale // 1))))
        batch = ""
        if has_batch:
            per_report = 2 * min(self._batch_num, MAX_REPORT_BYTES // 2)
            batch = " bytes_per_report=%d" % (per_report,)
        mcu.add_config_cmd(
            "query_analog_in oid=%d clock=%d sample_ticks=%d sample_count=%d"
            " rest_ticks=%d%s min_value=%d max_value=%d range_check_count=%d"
            % (self._oid, clock, mcu.seconds_to_clock(self._sample_time),
               self._sample_count, self._report_clock, batch, min_value, max_value,
               self._range_check_count), is_init=True)
        mcu.register_serial_response(
            self._handle_batch if has_batch else self._handle_single,
            STATE_FORMATS[0 if has_batch else 1], self._oid)

    def _handle_batch(self, params):
        data = params["values"]
        values = [data[i] | (data[i + 1] << 8) for i in range(0, len(data), 2)]
        self._note_values(params["next_clock"], values)

    def _handle_single(self, params):
        self._note_values(params["next_clock"], [params["value"]])

    def _note_values(self, next_clock32, values):
        mcu = self._mcu
        next_clock = mcu.clock32_to_clock64(next_clock32)
        first = next_clock - self._report_clock * len(values)
        samples = [(mcu.clock_to_print_time(first + i * self._report_clock),
                    value * self._inv_max_adc) for i, value in enumerate(values)]
        if samples:
            self._last_state = (samples[-1][1], samples[-1][0])
            if self._callback is not None:
                self._callback(samples)
