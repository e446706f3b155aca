"use strict";
// Shows what the routes answer; nothing is computed here.
const pick = id => document.getElementById(id);
const make = (tag, values = {}, ...inside) => { const e = Object.assign(document.createElement(tag), values); e.append(...inside); return e; };
const say = text => { pick("said").textContent = text; };
async function ask(path, options) {
  const answer = await fetch(path, options);
  const data = await answer.json().catch(() => ({ error: `the server answered ${answer.status}` }));
  if (!answer.ok) throw new Error(data.error);
  return data;
}
const post = (path, data) => ask(path, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(data) });
const chosen = () => models.find(m => m.name === pick("model").value);
const whole = () => [`${chosen().name}${pick("preset").value ? ":" + pick("preset").value : ""}`, ...pick("effects").value.split("+").map(e => e.trim()).filter(Boolean)].join("+");
const logs = new Map();

function presets() {
  pick("preset").replaceChildren(...chosen().presets.map(p => new Option(p, p)));
  for (const log of logs.values()) { log.offer(); log.propose(false); }
}
pick("model").addEventListener("change", presets);

async function add(file) {
  const form = new FormData();
  form.append("file", file);
  try {
    const log = await ask("logs", { method: "POST", body: form });
    show(log);
    say(`${log.name}: ${log.columns.length} columns`);
  } catch (wrong) { say(wrong.message); pick("logs").append(make("p", { className: "error", textContent: wrong.message })); }
}

function show(log) {
  const role = make("select", {}, new Option("fit", "runs"), new Option("hold out, to judge", "holdout"),
    new Option("reference: without what is missing", "reference"), new Option("leave out", ""));
  role.setAttribute("aria-label", `use of ${log.name}`);
  const rows = make("tbody"), error = make("p", { className: "error" }), found = make("pre"), picture = make("iframe", { title: `channels of ${log.name}` });
  error.setAttribute("role", "alert"); found.tabIndex = 0;
  let sent = Promise.resolve();  // one mapping after the other: the last one counts, and a job waits for it
  const cells = log.columns.map(column => {
    const name = make("select"), unit = make("input", { size: 8, value: column.unit });
    name.setAttribute("aria-label", `what column ${column.name} is`);
    unit.setAttribute("aria-label", `unit of column ${column.name}`);
    const cell = { column, name, unit, own: false };
    for (const input of [name, unit]) input.addEventListener("change", () => { cell.own = true; preview(); });
    rows.append(make("tr", {}, make("td", { textContent: column.name }), make("td", {}, name), make("td", {}, unit)));
    return cell;
  });
  const head = make("thead", {}, make("tr", {}, ...["column", "is", "unit"].map(t => make("th", { textContent: t, scope: "col" }))));
  const guess = make("button", { type: "button", textContent: "Propose a mapping" }), guessed = make("p", { className: "soft" });
  async function propose(all) {  // of its own accord it leaves alone what a person has chosen
    const model = chosen().name;
    try {
      const guesses = await ask(`logs/${encodeURIComponent(log.name)}/proposal?model=${model}`);
      if (model !== chosen().name) return;
      for (const { column, name, unit, own } of cells) {
        const [, to, in_] = /^(\S+)(?: \[(.*)\])?$/.exec(guesses[column.name] ?? "") ?? [];
        if (!to || (own && !all)) continue;
        name.value = to; unit.value = in_ ?? unit.value;
        guessed.textContent = "Filled in from names, units and correlations: correct what is not so.";
      }
      preview();
    } catch (wrong) { error.textContent = wrong.message; }
  }
  guess.addEventListener("click", () => propose(true));
  const offer = () => {
    for (const { column, name } of cells) {
      const before = name.value, known = ["time", ...chosen().variables.map(v => v.name)];
      name.replaceChildren(new Option("as it is called", ""), ...known.map(v => new Option(v, v)));
      name.value = known.includes(before) ? before : "";
    }
  };
  function preview() { sent = sent.then(send); }
  async function send() {
    const mapping = {};
    for (const { column, name, unit } of cells)
      if (name.value || unit.value !== column.unit) mapping[column.name] = (name.value || column.name) + (unit.value ? ` [${unit.value}]` : "");
    try {
      const seen = await post(`logs/${encodeURIComponent(log.name)}/map`, mapping);
      error.textContent = "";
      found.textContent = [seen.summary, ...seen.notes].join("\n");
      shown.hidden = false;
      picture.src = `logs/${encodeURIComponent(log.name)}/picture?at=${performance.now()}`;
      say(`${log.name}: ${Object.entries(seen.channels).map(([n, u]) => `${n} in ${u}`).join(", ")}`);
    } catch (wrong) { error.textContent = wrong.message; found.textContent = ""; shown.hidden = true; }
  }
  logs.set(log.name, { role, offer, propose, mapped: () => sent });
  offer();
  const shown = make("div", { hidden: true }, make("h4", { textContent: "What it shows, and cannot show" }), found, picture);
  pick("logs").append(make("div", { className: "log" }, make("h3", { textContent: log.name }), role, " ", guess, guessed,
    make("table", {}, head, rows), error, shown));
  propose(false);
}

const drop = pick("drop");
for (const kind of ["dragover", "dragleave", "drop"])
  drop.addEventListener(kind, event => { event.preventDefault(); drop.classList.toggle("over", kind === "dragover"); });
drop.addEventListener("drop", event => { for (const file of event.dataTransfer.files) add(file); });
pick("files").addEventListener("change", async event => { for (const file of event.target.files) await add(file); event.target.value = ""; });

for (const verb of ["identify", "diagnose"])
  pick(verb).addEventListener("click", async () => {
    const named = use => [...logs].filter(([, log]) => log.role.value === use).map(([name]) => name);
    await Promise.all([...logs.values()].map(log => log.mapped()));
    try { show_job(await post("jobs", { verb, model: whole(), runs: named("runs"), holdout: named("holdout"), reference: named("reference") })); }
    catch (wrong) { say(wrong.message); }
  });

function show_job(job) {
  const steps = make("ol"), answer = make("pre"), files = make("p"), state = make("p");
  const cancel = make("button", { type: "button", textContent: "Cancel" });
  answer.hidden = true; answer.tabIndex = 0;
  cancel.setAttribute("aria-label", `Cancel number ${job.number}`);
  cancel.addEventListener("click", () => post(`jobs/${job.number}/cancel`, {}));
  pick("jobs").prepend(make("div", { className: "job", id: `job-${job.number}` },
    make("h3", { textContent: `${job.number}: ${job.verb} ${job.model}` }), state, cancel, steps, answer, files));
  say(`${job.verb} started`);
  const follow = async () => {
    const now = (await ask("jobs"))[job.number];
    for (const step of now.steps.slice(steps.children.length)) { steps.append(make("li", { textContent: step })); say(step); }
    state.textContent = now.state;
    if (now.state === "stopping") { cancel.disabled = true; state.textContent = "stopping; what was found is being kept"; }
    if (["running", "stopping"].includes(now.state)) return setTimeout(follow, 300);
    cancel.disabled = true;
    say(`${job.verb} ${now.state}`);
    answer.hidden = !(now.answer ?? now.error);
    answer.textContent = now.answer ?? now.error ?? "";
    if (now.error) answer.className = "error";
    for (const file of now.files) files.append(make("a", { href: `jobs/${job.number}/${file}`, textContent: file, ...(file.endsWith(".html") ? { target: "_blank" } : { download: file }) }), " ");
    for (const e of now.errors ?? []) {
      pick("none").hidden = true; pick("compare").hidden = false;
      pick("compare").tBodies[0].append(make("tr", {}, ...[now.number, now.verb, now.model, e.role, e.channel, e.rmse].map(t => make("td", { textContent: t }))));
    }
  };
  follow();
}
presets();
