# SPDX-License-Identifier: GPL-3.0-or-later
"""A deterministic world of virtual mcus and its time.

Everything runs inside advance(), in the thread that calls it; C events
without the GIL.  The same seed and the same calls give the same bytes on
every link.  See docs/internals/virtual_world.md.
"""

import os
import struct
import weakref

cimport cython
from cpython.ref cimport PyObject
from libc.stdint cimport int32_t, int64_t, uint8_t, uint32_t, uint64_t
from libc.stdlib cimport free, malloc
from libc.string cimport memcpy, memset

from klippy_ext.c_vworld cimport (
    VLINK_FROM_MCU,
    VLINK_TO_MCU,
    VWORLD_ERROR,
    VWORLD_HOST,
    VWORLD_LIMIT,
    VWORLD_TICKER,
    vedge,
    vlink_cut,
    vlink_faults,
    vlink_record,
    vlink_set_faults,
    vmcu_clock_at,
    vmcu_options,
    vmcu_reset,
    vmcu_set_ppm,
    vmcu_time_at,
    voutput_read_duty,
    vpins_bind_switch,
    vpins_new_log,
    vpins_tap,
    vpins_watch_output,
    vpins_watch_step,
    vstep,
    vworld_add_mcu,
    vworld_add_ticker,
    vworld_event,
    vworld_free,
    vworld_get_clock,
    vworld_get_error,
    vworld_get_now,
    vworld_get_stats,
    vworld_get_ticker,
    vworld_limit_slice,
    vworld_make_seed,
    vworld_new,
    vworld_run,
    vworld_stats,
)

# Mcus that share a switch follow each other this closely (s).
SWITCH_SLICE = 20e-6
DIRECTIONS = {VLINK_TO_MCU: "to_mcu", VLINK_FROM_MCU: "from_mcu"}
FAULTS = ("flip", "drop", "insert", "double", "jitter_to", "jitter_from")
RECORD_HEAD = struct.Struct("=dBI")
# What an mcu is told when no device answers its address.
NO_DEVICE = -6


cdef class VirtualWorld(HostClock):
    """Virtual mcus, their links, and tickers, on one virtual clock."""

    def __cinit__(self, seed=0):
        self.world = vworld_new(<uint64_t>(seed & 0xffffffffffffffff))
        if self.world is NULL:
            raise MemoryError()
        self.clock = vworld_get_clock(self.world)
        self.mcus = []
        self.tickers = []
        self.queues = []
        self.devices = []

    def __dealloc__(self):
        vworld_free(self.world)

    cdef vworld *check_idle(self) except NULL:
        if self.is_running:
            raise RuntimeError("advance() was called from inside advance()")
        return self.world

    def add_mcu(self, name, library, *, double freq=0., double ppm=0.,
                double baud=250000., double latency=0.0002, seed=0):
        """Power up an mcu now.

        library: path of a shared object with vmcu_get_ops().
        freq: Hz, 0 for what the firmware says.  ppm: error of its crystal.
        baud, latency (s): of its link.
        seed: of the link's faults; not 0: also starts the clock at a random
        32 bit count.
        Raises OSError if the library cannot be used.
        """
        cdef vworld *world = self.check_idle()
        cdef VirtualMcu mcu = VirtualMcu.__new__(VirtualMcu)
        cdef vmcu_options options
        own_seed = vworld_make_seed(world) ^ (seed & 0xffffffffffffffff)
        name_bytes, path = name.encode(), os.fsencode(library)
        options.name, options.library = name_bytes, path
        options.freq, options.ppm = freq, ppm
        options.baud, options.latency = baud, latency
        options.seed = own_seed
        options.start_clock = vworld_make_seed(world) >> 32 if seed else 0
        mcu.mcu = vworld_add_mcu(world, &options)
        if mcu.mcu is NULL:
            raise OSError(vworld_get_error(world).decode())
        mcu.world = self
        mcu.name = name
        mcu.spi_devices, mcu.i2c_devices = [], {}
        mcu.link = VirtualLink.__new__(VirtualLink)
        mcu.link.world = self
        mcu.link.link = &mcu.mcu.link
        self.mcus.append(mcu.name)
        return mcu

    def add_ticker(self, double period, callback):
        """Call callback(now) every `period` s, from inside advance().

        What it raises comes out of advance().
        """
        if not 0. < period < float("inf"):
            raise ValueError("a ticker needs a period above 0, not %r" % (period,))
        if vworld_add_ticker(self.world, period) < 0:
            raise MemoryError()
        self.tickers.append(callback)

    def advance(self, double limit):
        """Let events happen until `limit` (s) or until the host has input.

        Returns the time it then is.  A limit in the past changes nothing.
        Raises RuntimeError if an mcu cannot go on.
        """
        cdef vworld *world = self.check_idle()
        cdef vworld_event event
        self.is_running = True
        try:
            while True:
                with nogil:
                    event = vworld_run(world, limit)
                if self.failure is not None:
                    failure, self.failure = self.failure, None
                    raise failure
                if event == VWORLD_TICKER:
                    self.tickers[vworld_get_ticker(world)](
                        vworld_get_now(world))
                elif event == VWORLD_ERROR:
                    raise RuntimeError(vworld_get_error(world).decode())
                elif event == VWORLD_LIMIT or event == VWORLD_HOST:
                    return vworld_get_now(world)
        finally:
            self.is_running = False

    def note_queue(self, queue):
        """Let take_ready() ask this serial queue."""
        self.queues = [ref for ref in self.queues if ref() is not None]
        self.queues.append(weakref.ref(queue))

    def take_ready(self):
        """Ready callbacks of the serial queues that have input, in order."""
        ready = []
        for ref in self.queues:
            queue = ref()
            callback = None if queue is None else queue.get_ready_callback()
            if callback is not None:
                ready.append(callback)
        return ready

    def run_length(self):
        """How much has happened: {name: number}; time in s."""
        cdef vworld_stats stats
        vworld_get_stats(self.world, &stats)
        return {"time": vworld_get_now(self.world), "mcus": len(self.mcus),
                "events": stats.n_events, "slices": stats.n_slices,
                "mcu_runs": stats.n_runs}


@cython.no_gc_clear
cdef class VirtualLink:
    """The cable between an mcu and the host."""

    @property
    def bytes_to_mcu(self):
        """Bytes that the mcu was given."""
        return self.link.lanes[<int>VLINK_TO_MCU].n_bytes

    @property
    def bytes_from_mcu(self):
        """Bytes that the host was given."""
        return self.link.lanes[<int>VLINK_FROM_MCU].n_bytes

    def cut(self):
        """Lose everything, also what is on the way, until restore()."""
        vlink_cut(self.link, 1)

    def restore(self):
        """Mend the cable."""
        vlink_cut(self.link, 0)

    def set_faults(self, **rates):
        """Set the probabilities a byte, 0 for those not named.

        flip: a bit changes; drop: it is lost; insert: a random byte comes
        before it; double: it comes twice.  jitter_to, jitter_from: s, up to
        which bytes are late at random on their way to, from the mcu.
        """
        cdef vlink_faults faults
        unknown = set(rates).difference(FAULTS)
        if unknown:
            raise TypeError("faults are %s, not %s"
                            % (", ".join(FAULTS), ", ".join(sorted(unknown))))
        faults.flip = rates.get("flip", 0.)
        faults.drop = rates.get("drop", 0.)
        faults.insert = rates.get("insert", 0.)
        faults.twice = rates.get("double", 0.)
        faults.jitter[VLINK_TO_MCU] = rates.get("jitter_to", 0.)
        faults.jitter[VLINK_FROM_MCU] = rates.get("jitter_from", 0.)
        vlink_set_faults(self.link, &faults)

    def record(self, bint on=True):
        """Start or stop keeping all delivered bytes."""
        vlink_record(self.link, on)

    def take(self):
        """What was recorded since the last take.

        Returns [(time in s, "to_mcu" or "from_mcu", bytes)] in order of
        delivery.  Raises MemoryError if some could not be kept.
        """
        cdef bytes packed
        if self.link.record.is_full:
            raise MemoryError("the link's record does not fit into memory")
        packed = b""
        if self.link.record.used:
            packed = self.link.record.buf[:self.link.record.used]
        self.link.record.used = 0
        pos, entries = 0, []
        while pos < len(packed):
            time, direction, length = RECORD_HEAD.unpack_from(packed, pos)
            pos += RECORD_HEAD.size
            entries.append(
                (time, DIRECTIONS[direction], packed[pos:pos + length]))
            pos += length
        return entries


cdef void serve_spi(void *ctx, uint32_t bus, uint8_t *buf,
                    uint32_t length) noexcept with gil:
    """The firmware transfers bytes over SPI; errors come out of advance()."""
    cdef VirtualMcu mcu = <VirtualMcu>ctx
    try:
        answer = mcu.exchange_spi(bus, (<char *>buf)[:length])
        memset(buf, 0xff, length)
        memcpy(buf, <char *>answer, min(<uint32_t>len(answer), length))
    except Exception as e:
        mcu.world.failure = e


cdef int32_t serve_i2c(void *ctx, uint32_t bus, uint8_t address, const uint8_t *wr,
                       uint32_t wr_len, uint8_t *rd, uint32_t rd_len) noexcept with gil:
    """The firmware talks to an I2C device; errors come out of advance()."""
    cdef VirtualMcu mcu = <VirtualMcu>ctx
    try:
        answer = mcu.exchange_i2c(bus, address, (<const char *>wr)[:wr_len], rd_len)
        if answer is None:
            return NO_DEVICE
        memcpy(rd, <char *>answer, min(<uint32_t>len(answer), rd_len))
        return 0
    except Exception as e:
        mcu.world.failure = e
    return NO_DEVICE


@cython.no_gc_clear
cdef class VirtualMcu:
    """One powered micro-controller and what is connected to its pins."""

    cdef int check_pin(self, int pin) except -1:
        if not 0 <= pin < <int64_t>self.mcu.pins.n_pins:
            raise ValueError(
                "mcu '%s' has pins 0 to %d, not %d"
                % (self.name, self.mcu.pins.n_pins - 1, pin))
        return pin

    @property
    def freq(self):
        """Nominal clock frequency in Hz."""
        return self.mcu.freq

    @property
    def late_events(self):
        """Timers that ran later than scheduled."""
        return self.mcu.n_late

    @property
    def max_late_ticks(self):
        """Worst lateness of a timer."""
        return self.mcu.max_late

    @property
    def reset_count(self):
        """Power cycles after the first power-up."""
        return self.mcu.n_resets

    @property
    def rx_dropped(self):
        """Bytes that came faster than the firmware took them."""
        return self.mcu.rx_dropped

    def clock_at(self, double time):
        """The mcu's clock (64 bit ticks) at a time of the world (s)."""
        return vmcu_clock_at(self.mcu, time)

    def time_at(self, uint64_t clock):
        """Time of the world (s) at a clock since the last power-up."""
        return vmcu_time_at(self.mcu, clock)

    def set_ppm(self, double ppm):
        """Have the crystal run off by so much from now on, as when it warms up."""
        self.world.check_idle()
        vmcu_set_ppm(self.mcu, vworld_get_now(self.world.world), ppm)

    def find_pin(self, name):
        """Number of a pin by its name in the firmware; KeyError if unknown."""
        text = name.encode()
        pin = self.mcu.ops.find_pin(text) if self.mcu.ops is not NULL else -1
        if pin < 0:
            raise KeyError(name)
        return pin

    def set_adc(self, int pin, double fraction):
        """Set an analog input, 0..1 of the reference voltage."""
        self.check_pin(pin)
        fraction = min(max(fraction, 0.), 1.)
        self.mcu.pins.pins[pin].analog = <int>(fraction * 65535. + .5)

    def set_input(self, int pin, level):
        """Drive a digital input; None to let it float."""
        self.check_pin(pin)
        self.mcu.pins.pins[pin].has_input = level is not None
        self.mcu.pins.pins[pin].input = <uint8_t>bool(level)

    def watch_stepper(self, int step_pin, int dir_pin, *,
                      bint invert_step=False, bint invert_dir=False,
                      bint both_edges=False):
        """Count the steps at a step and a direction pin from now on."""
        cdef StepTrace trace = StepTrace.__new__(StepTrace)
        self.check_pin(step_pin)
        self.check_pin(dir_pin)
        trace.step = vpins_watch_step(
            &self.mcu.pins, step_pin, dir_pin, invert_step, invert_dir,
            both_edges)
        if trace.step is NULL:
            raise MemoryError()
        trace.owner = self
        return trace

    def watch_output(self, int pin, *, bint invert=False):
        """Measure how long an output is on, from now on."""
        cdef OutputTrace trace = OutputTrace.__new__(OutputTrace)
        self.check_pin(pin)
        trace.output = vpins_watch_output(
            &self.mcu.pins, pin, invert, self.get_clock())
        if trace.output is NULL:
            raise MemoryError()
        trace.owner = self
        return trace

    def watch_edges(self, pins):
        """Keep every change of some outputs, in order, from now on."""
        cdef EdgeTrace trace = EdgeTrace.__new__(EdgeTrace)
        for pin in pins:
            self.check_pin(pin)
        trace.log = vpins_new_log(&self.mcu.pins)
        if trace.log is NULL:
            raise MemoryError()
        for pin in pins:
            if vpins_tap(&self.mcu.pins, trace.log, pin):
                raise MemoryError()
        trace.owner = self
        return trace

    cdef int attach_buses(self) except -1:
        self.mcu.bus.ctx = <void *><PyObject *>self
        self.mcu.bus.spi, self.mcu.bus.i2c = serve_spi, serve_i2c
        # the mcu calls it for as long as the world lives
        self.world.devices.append(self)
        return 0

    def add_spi_device(self, int bus, int cs_pin, exchange, *,
                       bint cs_active_high=False):
        """Connect a device to an SPI bus.

        exchange(bytes) -> bytes is called for what is transferred while its chip
        select is active.  What it raises comes out of advance().
        """
        self.check_pin(cs_pin)
        self.spi_devices.append((bus, cs_pin, cs_active_high, exchange))
        self.attach_buses()

    cdef bytes exchange_spi(self, int bus, bytes data):
        for device_bus, cs_pin, level, exchange in self.spi_devices:
            if device_bus == bus and self.mcu.pins.pins[<int>cs_pin].level == level:
                return exchange(data)
        return b""

    def add_i2c_device(self, int bus, int address, exchange):
        """Connect a device to an I2C bus.

        exchange(written: bytes, read_len) -> bytes, or None for no acknowledge.
        What it raises comes out of advance().
        """
        self.i2c_devices[bus, address] = exchange
        self.attach_buses()

    cdef bytes exchange_i2c(self, int bus, int address, bytes written, int read_len):
        exchange = self.i2c_devices.get((bus, address))
        return None if exchange is None else exchange(written, read_len)

    def get_clock(self):
        """The mcu's clock now."""
        return max(self.clock_at(vworld_get_now(self.world.world)),
                   self.mcu.done_clock)

    def bind_switch(self, int pin, traces, coeffs, double threshold, *,
                    bint above=False, bint invert=False):
        """Connect a switch that closes by the position of steppers.

        The input reads 1 (invert: 0) while the sum of coeff * position is
        below (above: above) the threshold.  traces may be of any mcu.
        """
        cdef int count = len(traces), ret
        cdef vstep **steps
        cdef double *factors
        self.check_pin(pin)
        if len(coeffs) != count:
            raise ValueError("%d traces need as many coefficients, not %d"
                             % (count, len(coeffs)))
        steps = <vstep **>malloc((count + 1) * sizeof(vstep *))
        factors = <double *>malloc((count + 1) * sizeof(double))
        try:
            if steps is NULL or factors is NULL:
                raise MemoryError()
            for i in range(count):
                steps[i] = (<StepTrace?>traces[i]).step
                factors[i] = coeffs[i]
            ret = vpins_bind_switch(
                &self.mcu.pins, pin, steps, factors, count, threshold, above,
                invert)
        finally:
            free(steps)
            free(factors)
        if ret:
            raise MemoryError()
        if any((<StepTrace>trace).owner is not self for trace in traces):
            vworld_limit_slice(self.world.world, SWITCH_SLICE)

    def reset(self):
        """Switch power off and on again, now."""
        self.world.check_idle()
        if vmcu_reset(self.mcu, vworld_get_now(self.world.world)):
            raise RuntimeError((<bytes>self.mcu.error).decode())


@cython.no_gc_clear
cdef class StepTrace:
    """Steps that a stepper was told to make."""

    @property
    def position(self):
        """Steps up minus steps down."""
        return self.step.position

    @property
    def total(self):
        """Steps up plus steps down."""
        return self.step.n_steps

    @property
    def both_edges(self):
        """Whether both edges of the step pin are steps; may be changed."""
        return bool(self.step.both_edges)

    @both_edges.setter
    def both_edges(self, bint value):
        self.step.both_edges = value

    def record(self, bint on=True):
        """Start or stop keeping every step."""
        self.step.is_recording = on

    def take(self):
        """What was recorded since the last take: pairs of int64, the mcu's
        clock and +1 or -1.  Raises MemoryError if some could not be kept."""
        cdef bytes steps = b""
        if self.step.is_full:
            raise MemoryError("the steps' record does not fit into memory")
        if self.step.used:
            steps = (<char *>self.step.record)[
                :self.step.used * sizeof(int64_t)]
        self.step.used = 0
        return steps


@cython.no_gc_clear
cdef class OutputTrace:
    """How long an output is on."""

    @property
    def level(self):
        """Share of the time it is on, as set now: 0 or 1 for a gpio."""
        fraction = self.output.fraction
        return int(fraction) if fraction in (0., 1.) else fraction

    def read_duty(self):
        """Mean on-fraction since the last read."""
        cdef VirtualMcu mcu = self.owner
        cdef uint64_t clock = mcu.get_clock()
        return voutput_read_duty(self.output, mcu.mcu.pins.epoch + clock)


@cython.no_gc_clear
cdef class EdgeTrace:
    """Changes of outputs, one after the other."""

    def take(self):
        """[(clock, pin, fraction)] since the last take.

        clock: ticks since the last power-up; fraction: 0.0 or 1.0 for a gpio, the
        duty of a hardware pwm.  Raises MemoryError if some could not be kept.
        """
        cdef vedge *edge
        if self.log.is_full:
            raise MemoryError("the record of edges does not fit into memory")
        edges = []
        for i in range(self.log.used):
            edge = &self.log.edges[i]
            edges.append((edge.clock, edge.pin, edge.fraction))
        self.log.used = 0
        return edges
