"use strict";
document.documentElement.classList.add("scripted");

// Data: each table stands in the page once, packed, and every link to it saves the same file.
for (const block of document.querySelectorAll("script.table")) unpack(block);

async function unpack(block) {
  const packed = new Blob([Uint8Array.from(atob(block.textContent), (letter) => letter.charCodeAt(0))]);
  const bytes = await new Response(packed.stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
  const url = URL.createObjectURL(new Blob([bytes], { type: "text/csv;charset=utf-8" }));
  for (const link of document.querySelectorAll("a.file")) {
    if (link.dataset.table === block.dataset.table) link.href = url;
  }
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

// The ledger: the address holds the filter, #ledger?verdict=differs&q=words, so that a link can set it.
const form = document.getElementById("filter");
const body = document.querySelector("#claims tbody");
const rows = [...body.rows];
const words = new Map(rows.map((row) => [row, [...row.cells].map((cell) => cell.textContent).join("\n").toLowerCase()]));
const names = ["verdict", "kind", "chapter", "q"];

function show() {
  const asked = form.q.value.toLowerCase().split(/\s+/).filter(Boolean);
  let count = 0;
  for (const row of rows) {
    const shown =
      ["verdict", "kind", "chapter"].every((name) => !form[name].value || form[name].value === row.dataset[name]) &&
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
  history.replaceState(null, "", `#ledger${asked.size ? "?" : ""}${asked}`);
  show();
}

form.hidden = false;
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
