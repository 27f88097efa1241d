#!/bin/sh
# Chromium ($CHROMIUM) with the priority of other programs. As root it would take more of the processor for drawing
# (nice -8) than it may for any operator, and what else runs would wait for that. For windows that nobody looks at it
# would take less (nice 5), so that a page of theirs hardly gets on beside anything else. And without the two pages of
# its address bar, which nobody sees and which every window would load.
without="PMProcessPriorityPolicy,WebUIOmniboxPopup,WebUIOmniboxAimPopup,WebUIOmniboxFullPopup"
for one; do
    shift
    case "$one" in --disable-features=*) one="$one,$without" ;; esac
    set -- "$@" "$one"
done
if [ "$(id -u)" = 0 ] && command -v setpriv > /dev/null; then
    exec setpriv --inh-caps -sys_nice --bounding-set -sys_nice "$CHROMIUM" "$@"
fi
exec "$CHROMIUM" "$@"
