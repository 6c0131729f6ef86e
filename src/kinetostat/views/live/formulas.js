// Programs of a machine: made of data, and the loops around them.
"use strict";
const FORMAT = 1;
// Operations by their names: the instruction of WebAssembly for a vector of two numbers, and its operands in the order in which it
// takes them. Conditions are masks. The letters of packed programs count through the names in their order.
const INSTRUCTIONS = {
  add: [[0xfd, 0xf0, 1], 0, 1], sub: [[0xfd, 0xf1, 1], 0, 1], mul: [[0xfd, 0xf2, 1], 0, 1], div: [[0xfd, 0xf3, 1], 0, 1],
  neg: [[0xfd, 0xed, 1], 0], abs: [[0xfd, 0xec, 1], 0], sqrt: [[0xfd, 0xef, 1], 0], steady: [[], 0],
  lt: [[0xfd, 0x49], 0, 1], le: [[0xfd, 0x4b], 0, 1], and: [[0xfd, 0x4e], 0, 1], where: [[0xfd, 0x52], 1, 2, 0],
  // The only one that is a call, once for each number: both operands wait in locals 0 and 1.
  atan2: [[0x21, 1, 0x21, 0, ...[0, 1].flatMap((lane) => [0x20, 0, 0xfd, 0x21, lane, 0x20, 1, 0xfd, 0x21, lane, 0x10, 0, ...(lane ? [0xfd, 0x22, 1] : [0xfd, 0x14])])], 0, 1],
};
const OPERATIONS = $operations;
const STATUSES = $statuses;
const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
const MOST_LETTERS = 400000, MOST_BYTES = 4e6;

// A packed program as its operations by their names, and its results, of which the last is a code: names or numbers. A value
// that is given, an input or a coordinate of a state, has the number of its place as its name.
function unpacked({ code, references, numbers }, given) {
  if (code.length > MOST_LETTERS) throw new Error("the program is too long");
  const kept = Array.from({ length: given }, (_, k) => `g${k}`), stack = [], rows = new Map();
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
    return value;
  };
  for (const letter of code) {
    if (letter === "#") { stack.push(literal(numbers[count()])); continue; }
    if (letter === "@") {
      const [name] = kept.splice(count(), 1);
      if (name === undefined) throw new Error("a reference is damaged");
      kept.unshift(name); stack.push(name);
      continue;
    }
    const operation = OPERATIONS[letter.toLowerCase().charCodeAt(0) - 97], arity = operation && INSTRUCTIONS[operation].length - 1;
    if (!operation || stack.length < arity) throw new Error("an operation is damaged");
    const operands = stack.splice(-arity), name = `v${rows.size}`;
    rows.set(name, { operation, operands });
    stack.push(name);
    if (letter < "a") kept.unshift(name);
  }
  return { rows, results: stack };
}

// The bytes of WebAssembly: counts, lists, and numbers of two points, which are 16 bytes apart.
function counted(value) {
  const bytes = [];
  for (; value > 127; value = Math.floor(value / 128)) bytes.push(128 + (value % 128));
  return [...bytes, value];
}
const listed = (items) => [...counted(items.length), ...items.flat()];
const section = (number, bytes) => [number, ...counted(bytes.length), ...bytes];
const word = (text) => listed([...text].map((letter) => letter.charCodeAt(0)));
const constant = (value) => [0xfd, 0x0c, ...new Uint8Array(new Float64Array([value, value]).buffer)];
const memory16 = (place) => [4, ...counted(16 * place)];
const NUMBER = 0x7c, PAIR = 0x7b;

// An unpacked program as WebAssembly for two points at once: it takes what is given from the start of the memory, and leaves
// results and the code behind it. With some results alone it does only what these need; if all are NaN on one condition,
// what they need waits for it.
function assembled({ rows, results }, wanted, given) {
  const code = results.at(-1), values = wanted.map((k) => results[k]), uses = new Map();
  for (const waiting = [code, ...values]; waiting.length;) {
    const name = waiting.pop();
    if (!rows.has(name)) continue;
    if (!uses.has(name)) waiting.push(...rows.get(name).operands);
    uses.set(name, (uses.get(name) ?? 0) + 1);
  }
  const [accepted, ...others] = new Set(values.map((value) => {
    const row = rows.get(value);
    return row?.operation === "where" && Number.isNaN(row.operands[2]) ? row.operands[0] : undefined;
  }));
  const waits = accepted !== undefined && !others.length;
  const again = [...uses.keys()].filter((name) => uses.get(name) > 1 || (waits && name === accepted));
  const locals = new Map(again.map((name, k) => [name, counted(2 + k)])), done = new Set(), body = [];
  const emit = (first) => {
    for (const tasks = [first]; tasks.length;) {
      const task = tasks.pop(), row = rows.get(task);
      if (Array.isArray(task)) for (const byte of task) body.push(byte);
      else if (typeof task === "number") tasks.push(constant(task));
      else if (!row) tasks.push([0x41, 0, 0xfd, 0, ...memory16(Number(task.slice(1)))]);
      else if (done.has(task)) tasks.push([0x20, ...locals.get(task)]);
      else {
        const [instruction, ...order] = INSTRUCTIONS[row.operation];
        if (locals.has(task)) { done.add(task); tasks.push([0x22, ...locals.get(task)]); }
        tasks.push(instruction, ...order.map((k) => row.operands[k]).reverse());
      }
    }
  };
  const store = (value, k) => { emit([0x41, 0]); emit(value); emit([0xfd, 0x0b, ...memory16(given + k)]); };
  store(code, values.length);
  if (waits) {
    emit(accepted);
    emit([0xfd, 0x53, 0x45, 0x04, 0x40]);
    values.forEach((_, k) => store(NaN, k));
    emit([0x0f, 0x0b]);
  }
  values.forEach(store);
  const text = [...listed([[...counted(2 + locals.size), PAIR]]), ...body, 0x0b];
  return new Uint8Array([
    0x00, 0x61, 0x73, 0x6d, 1, 0, 0, 0,
    ...section(1, listed([[0x60, ...listed([]), ...listed([])], [0x60, ...listed([NUMBER, NUMBER]), ...listed([NUMBER])]])),
    ...section(2, listed([[...word("m"), ...word("atan2"), 0x00, 1]])),
    ...section(3, listed([0])), ...section(5, listed([[0, ...counted(Math.ceil((given + values.length + 1) / 4096))]])),
    ...section(7, listed([[...word("run"), 0x00, 1], [...word("memory"), 0x02, 0]])),
    ...section(10, listed([[...counted(text.length), ...text]])),
  ]);
}

// A program as a function of inputs p and the coordinates of a state s, with results in o; it returns the code. Its `pair` takes
// two points, [p, s] each, and returns the first result of both.
async function compiled(program, wanted, inputs, states) {
  const module = await WebAssembly.compile(assembled(program, wanted, inputs + states));
  const { run, memory } = (await WebAssembly.instantiate(module, { m: { atan2: Math.atan2 } })).exports;
  const numbers = new Float64Array(memory.buffer), first = 2 * (inputs + states);
  const take = (lane, p, s) => {
    for (let k = 0; k < inputs; k++) numbers[2 * k + lane] = p[k];
    for (let k = 0; k < states; k++) numbers[2 * (inputs + k) + lane] = s[k];
  };
  const each = (p, o, s) => {
    take(0, p, s); take(1, p, s); run();
    for (let k = 0; k < wanted.length; k++) o[k] = numbers[first + 2 * k];
    return numbers[first + 2 * wanted.length];
  };
  each.pair = (one, other) => { take(0, ...one); take(1, ...other); run(); return [numbers[first], numbers[first + 1]]; };
  return each;
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

// A machine with its programs as functions, and `result`, which gives the function of one result alone, as maps need it.
async function functionsOf({ format, data, packed }) {
  if (format !== FORMAT) throw new Error("it is of another version of kinetostat");
  const programs = {}, alone = new Map(), inputs = data.inputs.length;
  const { springs } = data;
  const statesOf = (name) => (data.rest && ["step", "springsAtRest", "loaded"].includes(name) ? data.rest.states : 0)
    + (springs ? springs.springs * ({ quantities: springs.free, loaded: springs.loaded + springs.factor }[name] ?? 0) : 0);
  const rows = Object.fromEntries(Object.entries(packed).map(([name, program]) => [name, unpacked(program, inputs + statesOf(name))]));
  const make = (name, wanted) => compiled(rows[name], wanted, inputs, statesOf(name));
  await Promise.all(Object.entries(rows).map(async ([name, { results }]) => { programs[name] = await make(name, [...results.slice(0, -1).keys()]); }));
  const result = (name, k) => {
    const key = `${name} ${k}`;
    if (!alone.has(key)) alone.set(key, make(name, [k]));
    return alone.get(key);
  };
  return { data, programs, result };
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

// What the programs of quantities take after a point: coordinates of the state of rest, then modes over springs.
function stateOf(name, point, { rest, springs }, programs) {
  const state = name === "loaded" ? [...restOf(point, rest, programs).subarray(0, rest.states)] : [];
  for (const [program, count, massive] of springs ? { quantities: [["springs", springs.free, true]],
    loaded: [["springsAtRest", springs.loaded, true], ["springsAtRest", springs.factor, false]] }[name] : []) {
    if (!count) continue;
    const parts = new Float64Array((3 * springs.ways + 2 * springs.conditions) * springs.springs + springs.springs * (springs.springs + 1));
    programs[program](point, parts, state);
    for (const mode of modesOf(parts, springs, count, massive)) for (const part of mode) state.push(part);
  }
  return state;
}

// Modes of springs in which the least stiffness, or the most mass for it, takes part; NaN where nothing holds them.
function modesOf(parts, { ways, springs: n, conditions }, count, massive) {
  const each = Array.from({ length: n }, (_, i) => i), square = () => each.map(() => new Float64Array(n));
  const closing = 3 * ways * n, back = closing + conditions * n, triangle = (n * (n + 1)) / 2, masses = parts.length - 2 * triangle;
  const transpose = (matrix) => { for (const i of each) for (let j = 0; j < i; j++) [matrix[i][j], matrix[j][i]] = [matrix[j][i], matrix[i][j]]; };
  // A symmetric matrix without what would open a leg: T^T H + H^T T and its upper triangle.
  const overClosed = (mixed, upper) => {
    const matrix = square();
    for (let i = 0, entry = upper; i < n; i++) for (let j = i; j < n; j++, entry++) {
      let sum = upper < 0 ? Number(i === j) : parts[entry];
      for (let k = 0; mixed > 0 && k < ways * n; k += n) sum += parts[k + i] * parts[mixed + k + j] + parts[mixed + k + i] * parts[k + j];
      matrix[i][j] = matrix[j][i] = sum;
    }
    for (let side = 0; side < 2; side++) {
      for (const row of matrix) for (let c = 0; c < conditions; c++) {
        let share = 0;
        for (const j of each) share += row[j] * parts[back + j * conditions + c];
        for (const j of each) row[j] -= share * parts[closing + c * n + j];
      }
      transpose(matrix);
    }
    return matrix;
  };
  const stiff = overClosed(2 * ways * n, masses + triangle), heavy = massive ? overClosed(ways * n, masses) : overClosed(0, -1);
  for (const i of each) {
    stiff[i][i] += 1;
    for (let j = 0; j <= i; j++) {
      for (let k = 0; k < j; k++) stiff[i][j] -= stiff[i][k] * stiff[j][k];
      if (j < i) stiff[i][j] /= stiff[j][j];
    }
    if (!(stiff[i][i] > 0)) return Array.from({ length: count }, () => new Float64Array(n).fill(NaN));
    stiff[i][i] = Math.sqrt(stiff[i][i]);
  }
  for (let side = 0; side < 2; side++) {
    for (const row of heavy) for (const j of each) {
      for (let k = 0; k < j; k++) row[j] -= row[k] * stiff[j][k];
      row[j] /= stiff[j][j];
    }
    transpose(heavy);
  }
  const axes = square();
  let whole = 0;
  for (const i of each) { axes[i][i] = 1; for (const part of heavy[i]) whole += part * part; }
  for (let sweep = 0, beside = Infinity; sweep < 30 && beside > 1e-32 * whole; sweep++) {
    beside = 0;
    for (let p = 0; p < n; p++) for (let q = p + 1; q < n; q++) {
      const coupling = heavy[p][q], apart = heavy[q][q] - heavy[p][p];
      beside += coupling * coupling;
      if (coupling === 0) continue;
      const tangent = ((apart < 0 ? -2 : 2) * coupling) / (Math.abs(apart) + Math.sqrt(apart * apart + 4 * coupling * coupling));
      const cosine = 1 / Math.sqrt(1 + tangent * tangent), sine = tangent * cosine;
      const turn = (one, a, other, b) => { [one[a], other[b]] = [cosine * one[a] - sine * other[b], sine * one[a] + cosine * other[b]]; };
      for (const k of each) { turn(heavy[p], k, heavy[q], k); turn(axes[p], k, axes[q], k); }
      for (const k of each) turn(heavy[k], p, heavy[k], q);
    }
  }
  return Array.from({ length: count }, () => {
    const most = each.reduce((best, i) => (heavy[i][i] > heavy[best][best] ? i : best), 0), mode = new Float64Array(n);
    heavy[most][most] = -Infinity;
    for (let i = n - 1; i >= 0; i--) {
      mode[i] = axes[most][i];
      for (let k = i + 1; k < n; k++) mode[i] -= stiff[k][i] * mode[k];
      mode[i] /= stiff[i][i];
    }
    return mode;
  });
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
