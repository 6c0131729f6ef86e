// Programs of a machine: made of data, and the loops around them.
"use strict";
const FORMAT = 1;
const OPERATIONS = $operations;
const STATUSES = $statuses;
const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
const MOST_LETTERS = 400000, MOST_BYTES = 4e6;

// A packed program as a function of inputs p and the coordinates of a state s, with results in o; it returns the last one.
// The program is data: letters of the table above and numbers; nothing else of it becomes source code.
function compile({ code, references, numbers }, inputs, states) {
  if (code.length > MOST_LETTERS) throw new Error("the program is too long");
  const names = (word, count) => Array.from({ length: count }, (_, k) => `${word}[${k}]`);
  const kept = [...names("p", inputs), ...names("s", states)], stack = [], lines = [];
  let place = 0;
  const count = () => {
    for (let value = 0, size = 1; ; size *= 32) {
      const digit = LETTERS.indexOf(references.charAt(place++) || "?");
      if (digit < 0) throw new Error("a reference is damaged");
      value += (digit % 32) * size;
      if (digit < 32) return value;
    }
  };
  const literal = (number) => {
    const value = { inf: Infinity, "-inf": -Infinity, nan: NaN }[number] ?? number;
    if (typeof value !== "number") throw new Error("a number is damaged");
    return value < 0 || Object.is(value, -0) ? `(${Object.is(value, -0) ? "-0" : value})` : String(value);
  };
  for (const letter of code) {
    if (letter === "#") { stack.push(literal(numbers[count()])); continue; }
    if (letter === "@") {
      const [name] = kept.splice(count(), 1);
      if (name === undefined) throw new Error("a reference is damaged");
      kept.unshift(name); stack.push(name);
      continue;
    }
    const form = OPERATIONS[letter.toLowerCase().charCodeAt(0) - 97];
    const arity = form ? new Set(form.match(/\{\d\}/g)).size : 0;
    if (!form || stack.length < arity) throw new Error("an operation is damaged");
    const operands = stack.splice(-arity);
    const name = `v${lines.length}`;
    lines.push(`const ${name} = ${form.replace(/\{(\d)\}/g, (_, k) => operands[k])};`);
    stack.push(name);
    if (letter < "a") kept.unshift(name);
  }
  const results = stack.slice(0, -1).map((value, k) => `o[${k}] = ${value};`);
  return new Function("p", "o", "s", `"use strict";\n${lines.join("\n")}\n${results.join("\n")}\nreturn ${stack.at(-1)};`);
}

// The content of an address: a compressed text.
async function inflated(text) {
  const bytes = Uint8Array.from(atob(text.replace(/-/g, "+").replace(/_/g, "/")), (c) => c.charCodeAt(0));
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw")).getReader();
  const parts = [];
  for (let size = 0; ;) {
    const { done, value } = await reader.read();
    if (done) break;
    size += value.length;
    if (size > MOST_BYTES) throw new Error("it is too large");
    parts.push(value);
  }
  return JSON.parse(await new Blob(parts).text());
}

// A machine with its programs as functions.
function functionsOf({ format, data, packed }) {
  if (format !== FORMAT) throw new Error("it is of another version of kinetostat");
  const programs = {};
  for (const [name, program] of Object.entries(packed)) {
    programs[name] = compile(program, data.inputs.length, data.rest && ["step", "loaded"].includes(name) ? data.rest.states : 0);
  }
  return { data, programs };
}

// Coordinates of the state of rest, by Newton's method.
function restOf(point, rest, programs) {
  let next = new Float64Array(rest.states + 1), state = new Float64Array(rest.states + 1);
  programs.first(point, next);
  for (let step = 0; step < rest.steps && next[rest.states] > rest.away ** 2; step++) {
    [state, next] = [next, state];
    programs.step(point, next, state);
  }
  return next;
}

// The pose at which the actuators stand as wanted, from a pose nearby; undefined where Newton's method finds none.
function poseOf(wanted, start, { actuators, length, forward }, programs) {
  const n = actuators.length, out = new Float64Array(n * (1 + start.length)), trial = new Float64Array(out.length);
  const off = (values) => actuators.map(({ si }, k) => {
    const gap = wanted[k] - values[k];
    return si === "m" ? gap / length : Math.atan2(Math.sin(gap), Math.cos(gap));
  });
  const size = (gaps) => gaps.reduce((most, gap) => (Math.abs(gap) <= most ? most : Math.abs(gap)), 0);
  let at = [...start], status = programs.slopes(at, out), left = status === 0 ? size(off(out)) : Infinity;
  for (let step = 0; step < forward.steps && status === 0 && left > 0; step++) {
    const rows = actuators.map(({ si }, i) => at.slice(0, n).map((_, j) => out[n + i * start.length + j] / (si === "m" ? length : 1)));
    const change = solve(rows, off(out));
    if (!change) return undefined;
    let nearer = false, next;
    for (let share = 1; !nearer && share > forward.shortest; share *= 0.25) {
      next = at.map((value, j) => (j < n ? value + share * change[j] : value));
      nearer = programs.slopes(next, trial) === 0 && size(off(trial)) < left;
    }
    if (!nearer) break;
    at = next;
    status = programs.slopes(at, out);
    left = size(off(out));
  }
  return status === 0 && left <= forward.closed ? at : undefined;
}

function solve(rows, right) {
  const n = right.length, table = rows.map((row, i) => [...row, right[i]]);
  for (let k = 0; k < n; k++) {
    const pivot = table.slice(k).reduce((best, row, i) => (Math.abs(row[k]) > Math.abs(table[best][k]) ? k + i : best), k);
    if (!(Math.abs(table[pivot][k]) > 0)) return undefined;
    [table[k], table[pivot]] = [table[pivot], table[k]];
    for (let i = k + 1; i < n; i++) {
      const share = table[i][k] / table[k][k];
      for (let j = k; j <= n; j++) table[i][j] -= share * table[k][j];
    }
  }
  const answer = new Array(n);
  for (let k = n - 1; k >= 0; k--) {
    answer[k] = (table[k][n] - table[k].slice(k + 1, n).reduce((sum, value, j) => sum + value * answer[k + 1 + j], 0)) / table[k][k];
  }
  return answer;
}
