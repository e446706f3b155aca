"""Pages in headless Chromium, without a network; in real time, for a machine that is busy needs longer."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update",
)  # fmt: skip
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed (Debian package chromium)")
LARGEST = 1.5e6
"""Bytes of a page."""
PATIENCE = 120_000
"""Milliseconds that a page may take."""


@contextmanager
def launched() -> Iterator[Browser]:
    """A browser; one at a time in a process."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        yield chromium
        chromium.close()


@contextmanager
def opened(page: Path, *, width: int = 400, dark: bool = False, query: str = "") -> Iterator[Page]:
    """A file in a window of that width that has no network."""
    with launched() as chromium:
        context = chromium.new_context(
            viewport={"width": width, "height": 3000}, color_scheme="dark" if dark else "light", offline=True
        )
        context.set_default_timeout(PATIENCE)
        window = context.new_page()
        window.goto(page.as_uri() + query)
        yield window


def measured(page: Path, *, width: int = 400, dark: bool = False) -> dict[str, Any]:
    """What a window of that width shows of a page once all of its plots are drawn.

    ``width`` of the content, tags of elements that stand out to the right (``wide``), ``frames`` for plots, ``drawn``
    ones, contrast of the text (``ink``, ``paper`` as CSS colours), right ``ends`` of the drawings, and `barriers`.
    """
    with opened(page, width=width, dark=dark) as window:
        window.wait_for_function("[...document.querySelectorAll('[data-plot]')].every(p => p.dataset.drawn)")
        window.wait_for_timeout(300)
        found = barriers(window)
        seen = window.evaluate(
            """() => {
            const d = document, plots = [...d.querySelectorAll("[data-plot]")];
            return {
              width: d.documentElement.scrollWidth, frames: plots.length,
              drawn: plots.filter(p => p.querySelector("div")?.shadowRoot?.querySelector("canvas, div")).length,
              ends: plots.map(p => p.firstElementChild.getBoundingClientRect().right),
              wide: [...d.querySelectorAll("main *")].filter(e => e.getBoundingClientRect().right > innerWidth + .5)
                .map(e => e.tagName + "." + e.className),
              ink: getComputedStyle(d.body).color, paper: getComputedStyle(d.body).backgroundColor
            }}"""
        )
        return seen | {"barriers": found}


def barriers(window: Page) -> list[str]:
    """What axe-core finds in a page that keeps people from reading it: rule and places, a line each."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
    found = axe.Axe().run(window).response["violations"]
    return [f"{v['id']}: {', '.join(str(n['target']) for n in v['nodes'][:5])}" for v in found]


def assert_readable(page: Path, *, width: int = 400, dark: bool = False) -> dict[str, Any]:
    """Small, drawn whole, nothing cut or scrolled sideways, ink that stands out from the paper; what was measured."""
    assert page.stat().st_size < LARGEST
    seen = measured(page, width=width, dark=dark)
    assert seen["width"] <= width
    assert seen["wide"] == []
    assert seen["barriers"] == []
    assert seen["drawn"] == seen["frames"]
    assert max(seen["ends"], default=0) <= width + 0.5
    ink, paper = (sum(map(int, re.findall(r"\d+", seen[side])[:3])) for side in ("ink", "paper"))
    assert (ink - paper > 350) if dark else (paper - ink > 350)
    return seen
