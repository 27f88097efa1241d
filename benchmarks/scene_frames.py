"""What a picture of the scene takes: draw calls, triangles, textures, see-through layers, passes, and time.

``python -m benchmarks.scene_frames``: the samples as pages open them, looked at from near and far, drawn by Chromium's
software rasteriser. What WebGL is asked to do is counted in the page itself; the time of a picture is processor time of
all of Chromium, which the load of the machine changes little. Two sizes of the picture tell what goes with pixels from
what does not.

The frame rate of a laptop is *estimated*, not measured. Assumed are integrated graphics of 2017, Intel UHD Graphics
620: 3.0 GPixel/s and 384 GFLOPS at most, 1 GHz (https://topcpu.net/en/cpu-c/uhd-graphics-620-vs-hd-graphics-620), what
pixels and triangles take of them as said below, and that the page's own calls take as long as here. All of it is added
up, as if nothing ran beside anything else.
"""

import argparse
import contextlib
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Browser, Page

from benchmarks.console.answers import SESSION
from benchmarks.console.apart import Apart, served_apart
from benchmarks.console.page import chromium
from benchmarks.timing import machine

SIZES = ((320, 200), (640, 400))
"""Of the picture, width and height [px]: four times the pixels."""
SCREEN = (1920, 1080)
"""For which the frame rate is estimated."""
WANTED = 30.0
"""Frames a second on it."""
PIXEL_RATE, FLOPS, CLOCK = 3.0e9, 384e9, 1.0e9
"""Of those graphics, as published: pixels, operations and clocks a second, at most."""
SHARE = 0.4
"""Assumed: of pixels and operations so much is had."""
LAYERS, OPERATIONS = 3.0, 400.0
"""Assumed: so often a pixel is drawn (sky, ground, a thing before it), with so many operations each time. Sky and
ground are unlit and take far less; a lit pixel of the rover may take more."""
CLOCKS = 10.0
"""Assumed: of a triangle. The graphics set one up in a clock or two where nothing else holds them up."""
TURNS = 6
"""Pictures that are timed, by turning the view with the mouse."""
OUT = 25
"""Turns of the mouse's wheel until the view is far."""
READY = 180_000
"""Longest wait for the first picture of a scene [ms]."""

COUNTING = """() => {
  if (window.drawnFrames) return;
  const frames = (window.drawnFrames = []);
  const held = { textures: 0, buffers: 0 };
  let now = null, screen = true, blend = false, last = null;
  const proto = WebGL2RenderingContext.prototype;
  const wrap = (name, before) => {
    const own = proto[name];
    proto[name] = function (...given) { before.call(this, ...given); return own.apply(this, given); };
  };
  const corners = (mode, count) => (mode === 4 ? count / 3 : mode === 5 || mode === 6 ? Math.max(count - 2, 0) : 0);
  const drawn = (gl, mode, count, instances) => {
    last = gl;
    if (!now) return;
    now.calls += 1;
    now.triangles += corners(mode, count) * instances;
    if (blend) now.seeThrough += 1;
    if (!screen) now.aside += 1;
  };
  wrap("drawElements", function (mode, count) { drawn(this, mode, count, 1); });
  wrap("drawArrays", function (mode, _, count) { drawn(this, mode, count, 1); });
  wrap("drawElementsInstanced", function (mode, count, _, __, times) { drawn(this, mode, count, times); });
  wrap("drawArraysInstanced", function (mode, _, count, times) { drawn(this, mode, count, times); });
  wrap("enable", function (what) { if (what === this.BLEND) blend = true; });
  wrap("disable", function (what) { if (what === this.BLEND) blend = false; });
  wrap("bindFramebuffer", function (_, buffer) {
    screen = buffer === null;
    if (now && !screen) now.passes += 1;
  });
  const texel = { 0x8058: 4, 0x8c43: 4, 0x8814: 16, 0x881a: 8, 0x8229: 1, 0x822b: 2, 0x8c3a: 4 };
  wrap("texStorage2D", function (_, levels, kind, width, height) {
    held.textures += width * height * (texel[kind] ?? 4) * (levels > 1 ? 4 / 3 : 1);
  });
  wrap("texImage2D", function (...given) {
    if (given.length < 9) return;
    held.textures += given[3] * given[4] * (texel[given[2]] ?? 4);
  });
  wrap("bufferData", function (_, content) {
    held.buffers += typeof content === "number" ? content : (content?.byteLength ?? 0);
  });
  const own = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (then) => own((at) => {
    const outer = now;
    now ??= { calls: 0, triangles: 0, seeThrough: 0, aside: 0, passes: 0, asked: 0 };
    const begin = performance.now();
    then(at);
    if (outer) return;
    const one = now;
    now = null;
    if (!one.calls || !last) return;
    one.asked = performance.now() - begin;
    // until its last pixel is there: pictures don't wait for each other
    last.readPixels(0, 0, 1, 1, last.RGBA, last.UNSIGNED_BYTE, new Uint8Array(4));
    frames.push({ ...one, ...held });
  });
}"""


@dataclass(frozen=True)
class Situation:
    """What is looked at. view: what the page is told to show; far: from as far as the wheel turns the view away."""

    name: str
    sample: str
    view: dict[str, Any]
    far: bool = False


SITUATIONS = (
    Situation("page", "rock-step", {"show_ghost": False}),
    Situation("page, far", "rock-step", {"show_ghost": False}, far=True),
    Situation("ghost and swept leg", "rock-step", {"show_ghost": True, "scrub": 0.5, "shown": {"swept": True}}),
    Situation("walk with its ghost", "rock-walk", {"show_ghost": True, "scrub": 0.5}),
    Situation("refused step", "refused-step", {}),
)


@dataclass(frozen=True)
class Drawn:
    """A picture, the median of several. asked: for the page's own calls, the least of several by the clock [s].

    took: processor time of all of Chromium [s].
    """

    calls: int
    see_through: int
    passes: int
    triangles: int
    textures: int
    buffers: int
    asked: float
    took: float


def pictures(browser: Browser, served: Apart, situation: Situation, size: tuple[int, int]) -> Drawn:
    """The scene alone in a window, turned by the mouse."""
    page = browser.new_page(viewport={"width": size[0], "height": size[1]})
    page.add_init_script(f"({COUNTING})()")
    page.goto(f"{served.url}/scene/?fixedDpr=1&websocket={served.line('/scene?page=frames')}")
    page.wait_for_function("() => window.drawnFrames?.some((one) => one.triangles > 50000)", timeout=READY)
    settle(page)
    page.mouse.move(size[0] / 2, size[1] / 2)
    if situation.far:
        for _ in range(OUT):
            page.mouse.wheel(0, 400)
            page.wait_for_timeout(50)
        settle(page)
    before, begin = page.evaluate("() => drawnFrames.length"), processor_seconds()
    page.mouse.down()
    while page.evaluate("() => drawnFrames.length") < before + TURNS:
        for step in (3, -3):
            page.mouse.move(size[0] / 2 + step, size[1] / 2)
            page.wait_for_timeout(30)
    page.mouse.up()
    spent = processor_seconds() - begin
    frames = page.evaluate("(from) => drawnFrames.slice(from)", before)
    page.close()

    def middle(name: str) -> float:
        return float(np.median([one[name] for one in frames]))

    return Drawn(
        calls=int(middle("calls")),
        see_through=int(middle("seeThrough")),
        passes=int(middle("passes")),
        triangles=int(middle("triangles")),
        textures=int(middle("textures")),
        buffers=int(middle("buffers")),
        asked=1e-3 * min(one["asked"] for one in frames),
        took=spent / len(frames),
    )


def processor_seconds() -> float:
    """What all processes of Chromium that this one started have used."""
    told = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has ended
            name, _, rest = path.read_text().partition("(")[2].rpartition(")")
            told[int(path.parent.name)] = name, rest.split()
    spent = 0
    for name, fields in told.values():
        number, above = int(fields[1]), 0
        while number in told and number != os.getpid() and above < 20:
            number, above = int(told[number][1][1]), above + 1
        if number == os.getpid() and "chrom" in name:
            spent += int(fields[11]) + int(fields[12])
    return spent / os.sysconf("SC_CLK_TCK")


def settle(page: Page) -> None:
    """Until no picture was drawn for two seconds, a minute at most."""
    count = -1
    for _ in range(30):
        now = page.evaluate("() => drawnFrames.length")
        if now == count:
            return
        count = now
        page.wait_for_timeout(2000)


def parts(small: Drawn, large: Drawn) -> tuple[float, float]:
    """Of the software rasteriser's time: what goes with pixels [s for one], and what does not [s]."""
    pixels = [float(width * height) for width, height in SIZES]
    each = (large.took - small.took) / (pixels[1] - pixels[0])
    return each, small.took - each * pixels[0]


def estimated(drawn: Drawn) -> float:
    """Seconds of a picture of SCREEN's size on the graphics that the head of this module assumes."""
    pixels = LAYERS * SCREEN[0] * SCREEN[1]
    shading = pixels * max(OPERATIONS / (SHARE * FLOPS), 1.0 / (SHARE * PIXEL_RATE))
    return drawn.asked + shading + drawn.triangles * CLOCKS / CLOCK


def rows(situations: Sequence[Situation]) -> Iterator[tuple[Situation, Drawn, Drawn]]:
    """Of each, the small picture and the large one."""
    with chromium() as browser:
        for sample in dict.fromkeys(one.sample for one in situations):
            with served_apart(rover=False, sample=sample) as served, served.client() as client:
                for situation in (one for one in situations if one.sample == sample):
                    headers = {"FootFall-Page": "frames"}
                    client.put(f"{SESSION}/view", json=situation.view, headers=headers).raise_for_status()
                    small, large = (pictures(browser, served, situation, size) for size in SIZES)
                    yield situation, small, large


HEADS = (
    *("calls", "blended", "passes", "triangles", "textures", "buffers"),
    *("small", "large", "rest", "Mpx", "asked", "estimated"),
)


def main() -> int:
    """Prints them. Returns 1 where fewer than WANTED frames a second are estimated."""
    parser = argparse.ArgumentParser(description="what pictures of the scene take")
    parser.add_argument("--only", action="append", choices=[one.name for one in SITUATIONS], help="a situation")
    chosen = parser.parse_args().only
    about = machine()
    print(f"{about['processor']}, {about['cores']} cores; software rasteriser at {SIZES[0]} and {SIZES[1]} px")
    print(" " * 22 + "".join(f"{one:>10}" for one in HEADS))
    slowest = 0.0
    for situation, small, large in rows([one for one in SITUATIONS if chosen is None or one.name in chosen]):
        each, rest = parts(small, large)
        slowest = max(slowest, estimated(large))
        counts = [f"{one:>10}" for one in (large.calls, large.see_through, large.passes, large.triangles)]
        held = [f"{one / 1e6:>z7.2f} MB" for one in (large.textures, large.buffers)]
        times = [f"{1e3 * one:>z7.1f} ms" for one in (small.took, large.took, rest, 1e6 * each, large.asked)]
        rate = f"{1 / estimated(large):>z8.0f}/s"
        print(f"{situation.name:<22}" + "".join([*counts, *held, *times, rate]), flush=True)
    print(f"estimated for {SCREEN[0]} × {SCREEN[1]}: at least {1 / slowest:z.0f} frames a second, {WANTED:z.0f} wanted")
    return 0 if slowest <= 1 / WANTED else 1


if __name__ == "__main__":
    sys.exit(main())
