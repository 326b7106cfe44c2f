#!/bin/sh
# Makes the project's virtual environment, or finds it up to date.
#
# AFFETTO_VENV    where it stands (.venv)
# AFFETTO_EXTRAS  the optional dependencies to install with it (dev)
# AFFETTO_PYTHON  the interpreter to make it with (the newest fit one)
set -eu
cd "$(dirname "$0")/.."
unset PYTHONPATH PYTHONHOME
: "${HOME:=/}" "${AFFETTO_PYTHON:=}" "${AFFETTO_VENV:=.venv}"
: "${AFFETTO_EXTRAS=dev}"
export HOME AFFETTO_PYTHON AFFETTO_VENV AFFETTO_EXTRAS

own=$AFFETTO_VENV/bin/python
if "$own" -I tools/setup_env.py is-current 2>/dev/null; then
    exec "$own" -I tools/setup_env.py check-libraries
fi
fit=$(sh tools/find_python.sh)
python=$(printf '%s\n' "$fit" | sed -n '1s/^[^ ]* //p')
exec "$python" -I tools/setup_env.py install
