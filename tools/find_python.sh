#!/bin/sh
# Prints the interpreters that can carry the project, newest version first, one
# line each: "<version> <command>". Every candidate is run rather than looked
# up, because a version manager's shim may stand on the path and yet refuse.
#
# AFFETTO_PYTHON=<command> considers that one alone.

probe='
import ensurepip, platform, ssl, sys, sysconfig, venv, zlib
if platform.python_implementation() != "CPython":
    sys.exit(1)
if sysconfig.get_config_var("Py_GIL_DISABLED"):
    sys.exit(1)
print("%d.%d" % sys.version_info[:2])
'
versions="3.13 3.12 3.11"
found=

try() { # try <wanted version> <command>
    answer=$("$2" -I -c "$probe" 2>/dev/null </dev/null) || return 1
    [ "$answer" = "$1" ] || return 1
    found=yes
    echo "$1 $2"
}

for version in $versions; do
    if [ -n "$AFFETTO_PYTHON" ]; then
        try "$version" "$AFFETTO_PYTHON" && break
        continue
    fi
    for candidate in \
        "python$version" \
        "${PYENV_ROOT:-$HOME/.pyenv}/versions/$version"*/bin/python \
        "${XDG_DATA_HOME:-$HOME/.local/share}/uv/python/cpython-$version"*/bin/python3 \
        "/usr/local/bin/python$version" \
        "/usr/bin/python$version" \
        python3 python; do
        try "$version" "$candidate" && break
    done
done

if [ -z "$found" ]; then
    if [ -n "$AFFETTO_PYTHON" ]; then
        what="AFFETTO_PYTHON=$AFFETTO_PYTHON is no fit Python"
    else
        what="no fit Python found"
    fi
    echo "setup: error: $what: needed is CPython 3.13, 3.12 or 3.11" \
        "with venv and pip (on Debian and Ubuntu: apt install python3-venv);" \
        "AFFETTO_PYTHON=<path> names one that stands elsewhere" >&2
    exit 1
fi
