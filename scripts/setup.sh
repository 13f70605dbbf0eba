#!/bin/sh
# Make the environment in $VENV (default .venv) and install isethdr with its renderer, sweeps and tests.
set -eu
VENV=${VENV:-.venv}

python=
for candidate in python3 python3.13 python3.12 python3.11 python3.14; do
    if command -v "$candidate" >/dev/null && "$candidate" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 15))'; then
        python=$candidate
        break
    fi
done
if [ -z "$python" ]; then
    echo "isethdr needs Python 3.11 to 3.14 and found none; install it, for example: apt-get install python3 python3-venv" >&2
    exit 1
fi

if [ ! -x "$VENV/bin/python" ]; then
    if ! "$python" -m venv "$VENV"; then
        rm -rf "$VENV"
        if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
            apt-get update -qq && apt-get install -y -qq python3-venv
            "$python" -m venv "$VENV"
        else
            echo "Python's venv module is missing; ask for it with: apt-get install python3-venv" >&2
            exit 1
        fi
    fi
fi
"$VENV/bin/python" -m pip install --quiet --disable-pip-version-check --no-compile \
    -c constraints.txt -e '.[all,test]'
# pip would compile the modules one by one, and a quarter of them are tests of libraries; errors are
# ignored, because files that do not compile are not modules of isethdr
"$VENV/bin/python" -m compileall -qq -j 0 -x '/tests?/' "$VENV"/lib/python*/site-packages || :
VENV=$VENV sh scripts/llvm.sh
"$VENV/bin/isethdr" doctor
