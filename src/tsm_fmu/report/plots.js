"use strict";
// Unpacks the plot library and draws each plot when it comes near the window, the others when nothing else is to do:
// a print does not wait for what its event begins.
(async () => {
  const frames = [...document.querySelectorAll("[data-plot]")];
  if (typeof DecompressionStream === "undefined") {
    for (const frame of frames) frame.textContent = "This browser is older than 2023 and cannot unpack the plots.";
    return;
  }
  const unpack = id => {
    const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), c => c.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  };
  const library = document.createElement("script");
  library.textContent = await unpack("plot-library");
  document.head.append(library);
  const items = JSON.parse(await unpack("plot-items"));
  const views = new Map();
  const parts = manager => {
    const found = (manager?.roots ?? []).map(root => root.model);
    // a layout has children, some of them with their place in a grid
    for (const part of found) found.push(...(part.children ?? []).map(child => Array.isArray(child) ? child[0] : child));
    return found;
  };
  const draw = async frame => {
    if (views.has(frame)) return;
    views.set(frame, null);
    const manager = await Bokeh.embed.embed_item(items[frame.dataset.plot], frame);
    views.set(frame, manager);
    const ink = { value: getComputedStyle(frame).getPropertyValue("--ink").trim() };
    for (const part of parts(manager)) for (const drawn of [...part.center ?? [], ...part.above ?? []]) {
      // the style's text colour does not reach these
      if (drawn.type === "LabelSet") drawn.text_color = ink;
      if (drawn.type === "ColorBar") drawn.major_label_text_color = ink.value;
    }
    frame.dataset.drawn = "yes";
    if (matchMedia("(pointer: fine)").matches)
      for (const root of manager.roots) for (const tool of root.model.toolbar?.tools ?? [])
        if (tool.type === "BoxZoomTool") tool.active = true;  // on a phone a finger scrolls the page
  };
  const near = new IntersectionObserver(seen => {
    for (const entry of seen) if (entry.isIntersecting) draw(entry.target);
  }, { rootMargin: "600px" });
  for (const frame of frames) near.observe(frame);
  const idle = window.requestIdleCallback ?? (work => setTimeout(work, 200));
  const next = async () => {
    const frame = frames.find(f => !views.has(f));
    if (frame) { await draw(frame); idle(next); }
  };
  idle(next);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", () => {
    for (const [frame, manager] of views) if (manager) { manager.clear(); frame.replaceChildren(); views.delete(frame); draw(frame); }
  });
  addEventListener("beforeprint", () => {
    document.documentElement.classList.toggle("drawn-dark", dark.matches);
    for (const frame of frames) draw(frame);
  });
  for (const button of document.querySelectorAll("[data-shows]"))
    button.addEventListener("click", () => {
      const shown = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", String(shown));
      const manager = views.get(button.closest("figure").querySelector("[data-plot]"));
      for (const part of parts(manager)) {
        for (const renderer of part.renderers ?? [])
          if (renderer.name === button.dataset.shows) renderer.visible = shown;
      }
    });
})();
