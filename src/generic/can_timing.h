/* SPDX-License-Identifier: GPL-3.0-or-later
 * Bit times of CAN: how many quanta a bit of CONFIG_CANBUS_FREQUENCY has at a
 * clock, and where it is sampled: near 7/8.
 */
#ifndef GENERIC_CAN_TIMING_H
#define GENERIC_CAN_TIMING_H

#define CAN_FITS(HZ, N) ((HZ) % (CONFIG_CANBUS_FREQUENCY * (N)) == 0)

/* Quanta of a bit; 0: the clock is no multiple of any */
#define CAN_QUANTA(HZ) (CAN_FITS(HZ, 16) ? 16u : CAN_FITS(HZ, 18) ? 18u \
    : CAN_FITS(HZ, 17) ? 17u : CAN_FITS(HZ, 15) ? 15u \
    : CAN_FITS(HZ, 14) ? 14u : CAN_FITS(HZ, 20) ? 20u \
    : CAN_FITS(HZ, 8) ? 8u : CAN_FITS(HZ, 10) ? 10u \
    : CAN_FITS(HZ, 12) ? 12u : CAN_FITS(HZ, 9) ? 9u : 0u)
#define CAN_PRESCALER(HZ) ((HZ) / CONFIG_CANBUS_FREQUENCY / CAN_QUANTA(HZ))

/* Behind the sample point, before it (without the first one) */
#define CAN_SEGMENT2(HZ) ((CAN_QUANTA(HZ) + 4u) / 8u)
#define CAN_SEGMENT1(HZ) (CAN_QUANTA(HZ) - 1u - CAN_SEGMENT2(HZ))

#endif
