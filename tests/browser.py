"""Pages in headless Chromium, without a network."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--hide-scrollbars",
)  # fmt: skip
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed (Debian package chromium)")
LARGEST = 1.5e6
"""Bytes of a page."""


def measured(page: Path, folder: Path, *, width: int = 400, dark: bool = False) -> dict[str, Any]:
    """What a window of that width shows of a page once all of its plots are drawn.

    ``width`` of the content, tags of elements that stand out to the right (``wide``), ``frames`` for plots, ``drawn``
    ones, contrast of the text (``ink``, ``paper`` as CSS colours), and ``ends``: right ends of the drawings.
    """
    frame = folder / "frame.html"
    out = "document.getElementById('out')"
    script = f"""
    let w = f.contentWindow, d = f.contentDocument;
    const settle = () => {{
      const plots = [...d.querySelectorAll("[data-plot]")];
      if (plots.some(p => !p.dataset.drawn)) return setTimeout(settle, 200);
      setTimeout(() => {{ {out}.textContent = JSON.stringify({{
        width: d.documentElement.scrollWidth, frames: plots.length,
        drawn: plots.filter(p => p.querySelector("div")?.shadowRoot?.querySelector("canvas, div")).length,
        ends: plots.map(p => p.firstElementChild.getBoundingClientRect().right),
        wide: [...d.querySelectorAll("main *")].filter(e => e.getBoundingClientRect().right > {width} + .5)
          .map(e => e.tagName + "." + e.className),
        ink: w.getComputedStyle(d.body).color, paper: w.getComputedStyle(d.body).backgroundColor
      }}) }}, 300);
    }}; setTimeout(settle, 300);"""
    frame.write_text(
        f'<iframe src="{page.as_uri()}" style="border:0;width:{width}px;height:3000px"></iframe><pre id="out"></pre>'
        f'<script>const f = document.querySelector("iframe"); f.addEventListener("load", () => {{{script}}});</script>',
        encoding="utf-8",
    )
    command = [
        str(CHROMIUM), *FLAGS, "--host-resolver-rules=MAP * ~NOTFOUND", "--allow-file-access-from-files",
        f"--blink-settings=preferredColorScheme={0 if dark else 1}", f"--user-data-dir={folder / 'profile'}",
        "--window-size=1200,3100", "--virtual-time-budget=20000", "--dump-dom", frame.as_uri(),
    ]  # fmt: skip
    dom = subprocess.run(command, capture_output=True, text=True, timeout=180, check=True).stdout
    said = re.search(r'<pre id="out">(.*?)</pre>', dom, re.DOTALL)
    assert said is not None
    assert said[1], "the page did not draw all of its plots"
    return json.loads(html.unescape(said[1]))


def assert_readable(page: Path, folder: Path, *, width: int = 400, dark: bool = False) -> dict[str, Any]:
    """Small, drawn whole, nothing cut or scrolled sideways, ink that stands out from the paper; what was measured."""
    assert page.stat().st_size < LARGEST
    seen = measured(page, folder, width=width, dark=dark)
    assert seen["width"] <= width
    assert seen["wide"] == []
    assert seen["drawn"] == seen["frames"]
    assert max(seen["ends"], default=0) <= width + 0.5
    ink, paper = (sum(map(int, re.findall(r"\d+", seen[side])[:3])) for side in ("ink", "paper"))
    assert (ink - paper > 350) if dark else (paper - ink > 350)
    return seen
