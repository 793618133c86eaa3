/* What a sample costs on a Cortex-M4F: instructions, as QEMU counts them with -icount shift=0.
 *
 * One instruction is then a nanosecond of the board's time, whatever it is on a real one, and a tick
 * of SysTick, at 25 MHz, 40 of them. */
#include <stdint.h>
#include <stdio.h>

#define SYST_CSR (*(volatile uint32_t *)0xE000E010)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018)
#define TICK 40

extern double board_run(uint32_t which, uint32_t samples);

static const char *const names[] = {
    "noise alone", "drift, f64", "drift, f32", "attitude of six axes, f64", "attitude of nine axes, f64",
};

/* Loops of two instructions, by which the ticks are known. */
static void known(uint32_t loops)
{
    __asm volatile("1: subs %0, %0, #1\n bne 1b" : "+r"(loops) : : "cc");
}

static double last;

static uint32_t ticks(uint32_t which, uint32_t samples)
{
    SYST_RVR = 0xFFFFFF;
    SYST_CVR = 0;
    SYST_CSR = 5;
    if (which == 99) known(samples);
    else last = board_run(which, samples);
    uint32_t left = SYST_CVR;
    SYST_CSR = 0;
    return 0xFFFFFF - left;
}

int main(void)
{
    /* From the 2000th sample on, past the start. */
    const uint32_t from = 2000, n = 1000;
    uint32_t loops = ticks(99, 1000000);
    printf("known: %lu instructions of 2000000\n", (unsigned long)loops * TICK);
    uint32_t noise = 0;
    for (uint32_t which = 0; which < 5; which++) {
        uint32_t each = (ticks(which, from + n) - ticks(which, from)) * TICK / n;
        if (which == 0) noise = each;
        printf("%-26s %6lu instructions a sample\n", names[which], (unsigned long)(which ? each - noise : each));
    }
    return last == last ? 0 : 1;
}
