#!/usr/bin/env bash
# The filters on a Cortex-M4F in QEMU give the bits that they give on this machine.
# run.sh LIBRARY_OF_THE_BOARD LIBRARY_OF_THIS_MACHINE
set -euo pipefail
here=$(dirname "$(realpath "$0")")
board=$(realpath "$1")
host=$(realpath "$2")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

common=(-O2 -ffp-contract=off -Wl,--gc-sections -I "$here/../include")
cortex=(-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 --specs=rdimon.specs -nostartfiles
    -T "$here/mps2.ld" -Wl,--no-warn-execstack -Wl,--no-warn-rwx-segments)

for source in "$here/../examples/drift.c" "$here/attitude.c"; do
    arm-none-eabi-gcc "${common[@]}" "${cortex[@]}" "$here/startup.c" "$source" "$board" -lm -o "$work/elf"
    gcc "${common[@]}" "$source" "$host" -lm -o "$work/program"
    arm-none-eabi-size "$work/elf" | tail -1
    on_board=$(timeout 300 qemu-system-arm -machine mps2-an386 -display none -serial null -monitor none \
        -semihosting-config enable=on,target=native -kernel "$work/elf" 2>&1)
    on_host=$("$work/program")
    echo "$on_board"
    if [ "$on_board" != "$on_host" ]; then
        printf 'this machine says otherwise:\n%s\n' "$on_host" >&2
        exit 1
    fi
done
