"use strict";
document.documentElement.classList.add("scripted");

// The contents: open beside a wide page, a menu above a narrow one.
const contents = document.getElementById("contents");
const narrow = matchMedia("(max-width: 64rem)");
const fold = () => (contents.open = !narrow.matches);
fold();
narrow.addEventListener("change", fold);
contents.addEventListener("click", (event) => {
  if (narrow.matches && event.target.closest("a")) contents.open = false;
});
const inView = new Map();
const watcher = new IntersectionObserver((entries) => {
  for (const entry of entries) inView.set(entry.target.id, entry.isIntersecting);
  const current = [...inView.keys()].find((id) => inView.get(id));
  for (const link of contents.querySelectorAll("a")) {
    if (link.hash === `#${current}`) link.setAttribute("aria-current", "true");
    else link.removeAttribute("aria-current");
  }
}, { rootMargin: "-20% 0px -60% 0px" });
for (const section of document.querySelectorAll("main > section")) {
  inView.set(section.id, false);
  watcher.observe(section);
}

// Tables and pictures: each stands in the page once, packed; every link to a table saves the same file.
const tables = new Map();
for (const block of document.querySelectorAll("script.table, script.svg")) unpack(block);

async function unpack(block) {
  const { table, picture } = block.dataset;
  const packed = new Blob([Uint8Array.from(atob(block.textContent), (letter) => letter.charCodeAt(0))]);
  const bytes = new Response(packed.stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
  const type = picture ? "image/svg+xml" : "text/csv;charset=utf-8";
  if (table) tables.set(table, bytes);
  const url = URL.createObjectURL(new Blob([await bytes], { type }));
  if (picture) document.querySelector(`img[data-picture="${picture}"]`).src = url;
  else for (const link of document.querySelectorAll(`a.file[data-table="${table}"]`)) link.href = url;
}

// Pictures: a button around each enlarges it.
for (const picture of document.querySelectorAll(".picture")) {
  const button = document.createElement("button");
  button.type = "button";
  button.setAttribute("aria-pressed", "false");
  button.title = "Enlarge, or make small again";
  button.append(picture.firstElementChild);
  picture.append(button);
  button.addEventListener("click", () => button.setAttribute("aria-pressed", picture.classList.toggle("large")));
}

// Coefficients: a button copies the table, its cells divided by tabs.
for (const button of document.querySelectorAll("button.copy")) {
  button.addEventListener("click", async () => {
    const table = button.closest("details").querySelector("table");
    const lines = [...table.rows].map((row) => [...row.cells].map((cell) => cell.textContent).join("\t"));
    await navigator.clipboard.writeText(lines.join("\n"));
    button.nextElementSibling.value = "Copied.";
  });
}

// On paper all that is folded stands open.
let folded = [];
addEventListener("beforeprint", () => {
  folded = [...document.querySelectorAll("details:not([open]):not(.zoom)")];
  for (const each of folded) each.open = true;
});
addEventListener("afterprint", () => folded.forEach((each) => (each.open = false)));

// The ledger: the address holds the filter, #ledger?verdict=differs&q=words, so that a link can set it. Without one it
// shows what differs.
const form = document.getElementById("filter");
const body = document.querySelector("#claims tbody");
const rows = [...body.rows];
const words = new Map(rows.map((row) => [row, wordsOf(row).toLowerCase()]));
const choices = ["verdict", "touches", "kind", "chapter"];
const names = [...choices, "q"];

function wordsOf(row) {
  const texts = [...row.querySelectorAll("[data-label]")].map((cell) => cell.textContent);
  return [...texts, row.querySelector("[data-source]").dataset.source].join("\n");
}

function show() {
  const asked = form.q.value.toLowerCase().split(/\s+/).filter(Boolean);
  let count = 0;
  for (const row of rows) {
    const shown =
      choices.every((name) => !form[name].value || form[name].value === row.dataset[name]) &&
      asked.every((word) => words.get(row).includes(word));
    row.hidden = !shown;
    count += shown;
  }
  document.getElementById("count").value = `${count} of ${rows.length} rows`;
}

function fromAddress() {
  const [place, query] = location.hash.split("?");
  if (place !== "#ledger" || query === undefined) return;
  const asked = new URLSearchParams(query);
  for (const name of names) form[name].value = asked.get(name) ?? "";
  for (const select of form.querySelectorAll("select")) if (select.selectedIndex < 0) select.value = "";
  show();
  document.getElementById("ledger").scrollIntoView();
}

function toAddress() {
  const asked = new URLSearchParams(names.filter((name) => form[name].value).map((name) => [name, form[name].value]));
  history.replaceState(null, "", `#ledger?${asked}`);
  show();
}

form.hidden = false;
if (rows.some((row) => row.dataset.verdict === "differs")) form.verdict.value = "differs";
form.addEventListener("input", toAddress);
form.addEventListener("submit", (event) => event.preventDefault());
form.addEventListener("reset", (event) => {
  event.preventDefault();
  for (const name of names) form[name].value = "";
  toAddress();
});
addEventListener("hashchange", fromAddress);

// A column's head sorts: up, down, and back to the order of the thesis.
const heads = [...document.querySelectorAll("#claims thead th")];
const order = new Intl.Collator("en", { numeric: true });
heads.forEach((head, column) => {
  const numeric = "numeric" in head.dataset;
  const key = (row) => {
    const cell = row.cells[column];
    return numeric ? parseFloat(cell.dataset.value ?? "NaN") : cell.textContent.trim();
  };
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = head.textContent;
  head.replaceChildren(button);
  button.addEventListener("click", () => {
    const turn = { ascending: "descending", descending: null }[head.getAttribute("aria-sort")];
    const direction = turn === undefined ? "ascending" : turn;
    for (const other of heads) other.removeAttribute("aria-sort");
    if (direction) head.setAttribute("aria-sort", direction);
    const sign = direction === "descending" ? -1 : 1;
    const empty = (value) => value === "" || Number.isNaN(value);
    const sorted = [...rows];
    if (direction) {
      sorted.sort((a, b) => {
        const [first, second] = [key(a), key(b)];
        if (empty(first) || empty(second)) return empty(first) - empty(second); // these last, either way
        return sign * (numeric ? first - second : order.compare(first, second));
      });
    }
    body.append(...sorted);
  });
});

show();
fromAddress();
