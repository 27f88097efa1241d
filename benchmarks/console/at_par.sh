#!/bin/sh
# Chromium ($CHROMIUM) with the priority of other programs. As root it would take more of the processor for drawing
# (nice -8) than it may for any operator, and what else runs would wait for that.
if [ "$(id -u)" = 0 ] && command -v setpriv > /dev/null; then
    exec setpriv --inh-caps -sys_nice --bounding-set -sys_nice "$CHROMIUM" "$@"
fi
exec "$CHROMIUM" "$@"
