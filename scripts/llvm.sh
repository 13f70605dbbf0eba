#!/bin/sh
# Install libLLVM 19, with which the renderer's vectorised variant compiles its kernels. If it
# cannot be installed, print a note and succeed. Root uses apt-get install; other users unpack the
# same packages below $VENV/lib/llvm, where the renderer searches.
set -u
VENV=${VENV:-.venv}
PACKAGES="libllvm19 libz3-4 libedit2 libbsd0 libmd0 libxml2 libicu72"

present() {
    [ -n "${DRJIT_LIBLLVM_PATH:-}" ] || ls "$VENV"/lib/llvm/libLLVM*.so* >/dev/null 2>&1 ||
        ldconfig -p 2>/dev/null | grep -Eq 'libLLVM[-.](so\.)?(1[7-9]|2[0-9])'
}

present && exit 0
if command -v apt-get >/dev/null; then
    if [ "$(id -u)" = 0 ]; then
        echo "installing libllvm19 for the renderer"
        apt-get update -qq && apt-get install -y -qq libllvm19 >/dev/null && exit 0
    fi
    echo "unpacking libllvm19 below $VENV/lib/llvm"
    work=$(mktemp -d)
    (cd "$work" && for package in $PACKAGES; do apt-get download -qq "$package" 2>/dev/null; done
     for deb in *.deb; do [ -e "$deb" ] && dpkg -x "$deb" root; done)
    mkdir -p "$VENV/lib/llvm"
    find "$work" -name '*.so*' -exec cp -P {} "$VENV/lib/llvm/" \; 2>/dev/null
    rm -rf "$work"
    present && exit 0
    rmdir "$VENV/lib/llvm" 2>/dev/null
fi
echo "no LLVM 17 or newer found: the renderer falls back to its scalar variant, about 15 times slower and up to five times as noisy; install libllvm19 to change that" >&2
exit 0
