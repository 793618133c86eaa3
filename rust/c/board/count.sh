#!/usr/bin/env bash
# What a sample costs on a Cortex-M4F, in instructions that QEMU counts: count.sh LIBRARY_OF_THE_BOARD
set -euo pipefail
here=$(dirname "$(realpath "$0")")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

arm-none-eabi-gcc -O2 -ffp-contract=off -Wl,--gc-sections \
    -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 --specs=rdimon.specs -nostartfiles \
    -T "$here/mps2.ld" -Wl,--no-warn-execstack -Wl,--no-warn-rwx-segments \
    "$here/startup.c" "$here/count.c" "$1" -lm -o "$work/elf"
timeout 600 qemu-system-arm -machine mps2-an386 -icount shift=0 -display none -serial null -monitor none \
    -semihosting-config enable=on,target=native -kernel "$work/elf"
