#!/usr/bin/env bash
# Runs a command in a throwaway virtual machine with real SocketCAN interfaces, vcan0 and vcan1, for machines whose own
# kernel has no CAN:
#
#   .ci/vcan.sh [-f FILE[:PLACE]]... [-t SECONDS] -- COMMAND [ARGUMENT...]
#
#   -f  takes a file along (to /bin/NAME unless a place is given), with the libraries that a program needs
#   -t  gives up after so many seconds (300)
#
# Prints what the command prints and ends as it ends; 124: out of time, 125: the machine did not come up.
# Needs qemu-system-x86, busybox-static, can-utils and cpio of Debian. The kernel is a Debian package too, which is only
# unpacked, into $VCAN_CACHE. One processor executes one instruction in each nanosecond of the guest's time, and time leaps
# where it has nothing to do: threads come on time in there however busy this machine is, and each run is like the last.
set -euo pipefail

limit=300
files=()
while [ $# -gt 0 ]; do
    case $1 in
        -f) files+=("$2"); shift 2 ;;
        -t) limit=$2; shift 2 ;;
        --) shift; break ;;
        *) sed -n '2,14s/^# \{0,1\}//p' "$0" >&2; exit 125 ;;
    esac
done
cache=${VCAN_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/flqr-vcan}

# The plain kernel: Debian's cloud kernel has no CAN.
if ! ls "$cache"/boot/vmlinuz-* >/dev/null 2>&1; then
    package=$(apt-cache depends linux-image-amd64 | sed -n 's/^ *Depends: \(linux-image-[0-9][^ ]*\)$/\1/p' | head -n 1)
    [ -n "$package" ] || { echo "vcan: no kernel package known: run apt-get update" >&2; exit 125; }
    mkdir -p "$cache"
    (cd "$cache" && apt-get -qq -o APT::Sandbox::User="$(id -un)" download "$package")
    dpkg-deb --fsys-tarfile "$cache/$package"_*.deb | tar -x -C "$cache" --wildcards \
        './boot/vmlinuz-*' './lib/modules/*/kernel/drivers/net/can/*' './lib/modules/*/kernel/net/can/*'
    rm -f "$cache"/*.deb
fi
kernel=$(ls "$cache"/boot/vmlinuz-* | head -n 1)

work=$(mktemp -d)
qemu=
trap '[ -z "$qemu" ] || kill "$qemu" 2>/dev/null || true; rm -rf "$work"' EXIT
root=$work/root
mkdir -p "$root"/{bin,dev,proc,sys,tmp,run,modules,lib64}
put() { # put FILE PLACE
    mkdir -p "$root/$(dirname "$2")"
    cp -L "$1" "$root/$2"
    { ldd "$1" 2>/dev/null || true; } | sed -n 's|^[^/]*\(/[^ ]*\).*|\1|p' | while read -r library; do
        [ -e "$root$library" ] || { mkdir -p "$root$(dirname "$library")"; cp -L "$library" "$root$library"; }
    done
}
put "$(command -v busybox)" bin/busybox
for tool in candump cansend cangen canplayer slcand; do put "$(command -v "$tool")" "bin/$tool"; done
for file in "${files[@]}"; do
    source=${file%%:*}
    place=/bin/$(basename "$source")
    [ "$file" = "$source" ] || place=${file#*:}
    put "$source" "$place"
done
for module in can can-raw can-dev vcan slcan; do
    find "$cache/lib/modules" -name "$module.ko*" -exec cp {} "$root/modules/" \;
done
printf '%q ' "$@" > "$root/command"
cat > "$root/init" <<'INIT'
#!/bin/busybox sh
/bin/busybox --install -s /bin
export PATH=/bin HOME=/tmp TERM=dumb
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev
mkdir -p /dev/pts /dev/shm; mount -t devpts pts /dev/pts; mount -t tmpfs tmp /tmp
for module in can can-raw can-dev vcan slcan; do insmod /modules/$module.ko; done
ip link set lo up
for name in vcan0 vcan1; do ip link add $name type vcan && ip link set $name up; done
stty -F /dev/ttyS1 raw -echo 115200
echo VCAN-UP
cd /tmp
sh /command </dev/null >/dev/ttyS1 2>&1
status=$?
sleep 0.2
echo "VCAN-STATUS $status"
poweroff -f
INIT
chmod 755 "$root/init"
(cd "$root" && find . | cpio -o -H newc 2>/dev/null | gzip -1) > "$work/initrd.gz"

: > "$work/console"
: > "$work/out"
qemu-system-x86_64 -nodefaults -no-user-config -display none -no-reboot -m 512 -smp 1 -cpu max \
    -accel tcg,thread=single -icount shift=0,sleep=off -rtc clock=vm \
    -kernel "$kernel" -initrd "$work/initrd.gz" -append 'console=ttyS0,115200 quiet panic=-1 mitigations=off' \
    -serial "file:$work/console" -serial "file:$work/out" </dev/null 2>"$work/errors" &
qemu=$!
waited=0
while kill -0 "$qemu" 2>/dev/null; do
    [ "$waited" -lt $((limit * 5)) ] || { cat "$work/out"; echo "vcan: no result within $limit s" >&2; exit 124; }
    sleep 0.2
    waited=$((waited + 1))
done
qemu=
cat "$work/out"
status=$(tr -d '\r' < "$work/console" | sed -n 's/^VCAN-STATUS \([0-9]*\)$/\1/p')
[ -n "$status" ] || { cat "$work/errors"; tail -n 20 "$work/console"; echo "vcan: the machine gave no result"; exit 125; } >&2
exit "$status"
