/* SPDX-License-Identifier: GPL-3.0-or-later
 * The USB OTG core as a full-speed device: RM0090, 34.16 (F4); RM0410, 41.15
 * (F7); RM0433, 60.14 (H7).
 */
#ifndef STM32_OTG_H
#define STM32_OTG_H

#include <stdint.h>

struct otg_regs {
    volatile uint32_t GOTGCTL, GOTGINT, GAHBCFG, GUSBCFG, GRSTCTL, GINTSTS;
    volatile uint32_t GINTMSK, GRXSTSR, GRXSTSP, GRXFSIZ, DIEPTXF0, HNPTXSTS;
    volatile uint32_t reserved0[2], GCCFG, CID, reserved1[48], HPTXFSIZ;
    volatile uint32_t DIEPTXF[8];
};
#define OTG_GOTGCTL_BVALOEN (1u << 6)
#define OTG_GOTGCTL_BVALOVAL (1u << 7)
#define OTG_GAHBCFG_GINT (1u << 0)
#define OTG_GUSBCFG_PHYSEL (1u << 6)
#define OTG_GUSBCFG_TRDT(N) ((uint32_t)(N) << 10)
#define OTG_GUSBCFG_FDMOD (1u << 30)
#define OTG_GRSTCTL_CSRST (1u << 0)
#define OTG_GRSTCTL_RXFFLSH (1u << 4)
#define OTG_GRSTCTL_TXFFLSH (1u << 5)
#define OTG_GRSTCTL_TXFNUM(N) ((uint32_t)(N) << 6)
#define OTG_GRSTCTL_ALL_TX OTG_GRSTCTL_TXFNUM(16)
#define OTG_GRSTCTL_AHBIDL (1u << 31)
#define OTG_GINT_RXFLVL (1u << 4)
#define OTG_GINT_USBRST (1u << 12)
#define OTG_GINT_IEPINT (1u << 18)
#define OTG_RXSTS_EP(S) ((S) & 15u)
#define OTG_RXSTS_COUNT(S) (((S) >> 4) & 0x7ffu)
#define OTG_RXSTS_KIND(S) (((S) >> 17) & 15u)
enum { OTG_RX_OUT = 2, OTG_RX_OUT_DONE = 3, OTG_RX_SETUP_DONE = 4,
       OTG_RX_SETUP = 6 };
#define OTG_FIFO(START, WORDS) ((uint32_t)(WORDS) << 16 | (uint32_t)(START))
#define OTG_GCCFG_PWRDWN (1u << 16)     /* the transceiver is on */
#define OTG_GCCFG_NOVBUSSENS (1u << 21) /* F2, F401, F405, F407, F429 */
#define OTG_GCCFG_VBDEN (1u << 21)      /* the others */

struct otg_endpoint {
    volatile uint32_t CTL, reserved0, INT, reserved1, TSIZ, DMA, TXFSTS;
    volatile uint32_t reserved2;
};
struct otg_device_regs {
    volatile uint32_t DCFG, DCTL, DSTS, reserved0, DIEPMSK, DOEPMSK, DAINT;
    volatile uint32_t DAINTMSK, reserved1[5], DIEPEMPMSK, reserved2[50];
    struct otg_endpoint IN[16], OUT[16];
};
#define OTG_DCFG_FULL_SPEED 3u
#define OTG_DCFG_ADDRESS(A) ((uint32_t)(A) << 4)
#define OTG_DCFG_ADDRESS_MASK (0x7fu << 4)
#define OTG_DCTL_SDIS (1u << 1)
#define OTG_EPCTL_EP0_64 0u
#define OTG_EPCTL_ACTIVE (1u << 15)
#define OTG_EPCTL_BULK (2u << 18)
#define OTG_EPCTL_INTERRUPT (3u << 18)
#define OTG_EPCTL_STALL (1u << 21)
#define OTG_EPCTL_FIFO(N) ((uint32_t)(N) << 22)
#define OTG_EPCTL_CNAK (1u << 26)
#define OTG_EPCTL_SNAK (1u << 27)
#define OTG_EPCTL_DATA0 (1u << 28)
#define OTG_EPCTL_DISABLE (1u << 30)
#define OTG_EPCTL_ENABLE (1u << 31)
#define OTG_EPINT_XFRC (1u << 0)
#define OTG_EPINT_EPDISD (1u << 1)
#define OTG_TSIZ_PACKET (1u << 19)
#define OTG_TSIZ_SETUPS (3u << 29)

#define OTG_DEVICE_OFFSET 0x800
#define OTG_PCGCCTL_OFFSET 0xe00
#define OTG_FIFO_OFFSET(EP) (0x1000u + 0x1000u * (EP))

#endif
