// The page of a machine: a picture, matrices and a map that follow the sliders. Nothing is requested.
const $ = (id) => document.getElementById(id);

function openMachine({ data, programs, result }) {
  const { inputs, actuators, quantities, parts, rest, planar, samples } = data;
  const NAMES = ["rx", "ry", "rz", "x", "y", "z"];
  const at = inputs.map((input) => input.home);
  const free = quantities.filter((quantity) => !quantity.loaded);
  const answers = new Float64Array(42), numbers = new Float64Array(free.length), loaded = new Float64Array(6 + quantities.length - free.length);
  const places = new Float64Array(actuators.length + 12 + 3 * data.drawing.points), shares = new Float64Array(6 * (parts?.length ?? 0));

  // Units that people read: a factor from SI and a word, by kind of quantity.
  const UNITS = { m: [1e3, "mm"], rad: [180 / Math.PI, "°"], "N/m": [1e-6, "N/µm"], "N·m/rad": [1e-3, "kN·m/rad"] };
  const unit = (si) => UNITS[si] ?? [1, si];
  const BLOCKS = {
    K: [[1e-3, "kN·m/rad"], [1e-3, "kN/rad"], [1e-6, "N/µm"]],
    C: [[1e6, "µrad/(N·m)"], [1e6, "µrad/N"], [1e6, "µm/N"]],
  };
  const block = (i, j) => (i < 3) + (j < 3) === 2 ? 0 : i < 3 || j < 3 ? 1 : 2;

  function shown(value, digits = 4) {
    if (Number.isNaN(value)) return "–";
    if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
    if (value === 0) return "0";
    const text = Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3
      ? value.toExponential(digits - 1).replace(/e([+-])(\d+)/, (_, sign, power) => `·10${raised(sign === "-" ? "-" + power : power)}`)
      : String(Number(value.toPrecision(digits)));
    return text.replace("-", "−");
  }
  const spaced = (name) => name.replaceAll("_", " ");
  const escaped = (text) => text.replace(/[&<>"']/g, (c) => `&#${c.codePointAt(0)};`);
  const raised = (text) => [...text].map((c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c])).join("");

  const angle = (value) => (Math.abs(value) > 1e6 ? Math.atan2(Math.sin(value), Math.cos(value)) : value);
  const prepared = (values) => values.map((value, k) => (inputs[k].si === "rad" ? angle(value) : value));
  const answer = (values) => programs.answers(prepared(values), answers);
  const number = (values) => {
    const point = prepared(values);
    return free.length ? programs.quantities(point, numbers, stateOf("quantities", point, data, programs)) : 0;
  };
  const answerAtRest = (values) => {
    const point = prepared(values);
    return programs.loaded(point, loaded, stateOf("loaded", point, data, programs));
  };
  const place = (values) => { programs.places(prepared(values), places); return places; };
  const placeOf = (matrix, i, j) => {
    const [a, b] = i < j ? [i, j] : [j, i];
    return (matrix === "K" ? 21 : 0) + 6 * a - (a * (a - 1)) / 2 + b - a;
  };
  const entry = (matrix, i, j) => answers[placeOf(matrix, i, j)];

  // The program against numbers that Python computed pose by pose.
  function selfCheck() {
    let worst = 0, wrong = 0;
    for (const { values, expected } of samples) {
      const status = answer(values);
      if (status !== 0) wrong++;
      for (const first of [0, 21]) {
        const diagonal = (k) => Math.abs(expected[first + 6 * k - (k * (k - 1)) / 2]);
        for (let i = 0; i < 6; i++) for (let j = i; j < 6; j++) {
          const k = first + 6 * i - (i * (i - 1)) / 2 + j - i, wanted = expected[k] ?? null;
          const number = wanted === null ? NaN : wanted === "inf" ? Infinity : wanted === "-inf" ? -Infinity : wanted;
          if (!Number.isFinite(number)) { if (!Object.is(answers[k], number)) wrong++; continue; }
          const scale = Math.sqrt(diagonal(i) * diagonal(j)), off = Math.abs(answers[k] - number) / (Number.isFinite(scale) && scale > 0 ? scale : Math.max(Math.abs(number), 1e-300));
          worst = Math.max(worst, off);
        }
      }
    }
    const good = !wrong && worst < 1e-10;
    $("check").textContent = good
      ? `The formulas in this page agree with kinetostat at ${samples.length === 1 ? "a pose" : `${samples.length} poses`}, ${worst ? `to ${worst.toExponential(0)}` : "to the last digit"}.`
      : `The formulas in this page differ from kinetostat: by ${worst.toExponential(1)}, ${wrong} numbers altogether. Do not use them.`;
    $("check").classList.toggle("bad", !good);
    document.documentElement.dataset.check = good ? "ok" : "failed";
  }

  // Sliders, and the pose in the address.
  function readAddress() {
    const given = addressFields();
    inputs.forEach((input, k) => {
      const value = Number(given.get(input.name));
      if (given.has(input.name) && Number.isFinite(value)) at[k] = value;
    });
  }
  function writeAddress() {
    const words = inputs.map((input, k) => [input.name, at[k]]).filter(([, value], k) => value !== inputs[k].home);
    const fields = new URLSearchParams(words.map(([name, value]) => [name, String(value)]));
    const machine = addressFields().get(MACHINE);
    const text = [...(machine ? [`${MACHINE}=${machine}`] : []), ...(words.length ? [String(fields)] : [])].join("&");
    // A page inside of another one has no address of its own.
    try { history.replaceState(null, "", text ? `#${text}` : location.pathname + location.search); } catch { /* nothing to do */ }
  }
  function buildSliders() {
    inputs.forEach((input, k) => {
      const [factor, word] = unit(input.si);
      const row = document.createElement("label");
      row.className = "slider";
      row.innerHTML = `<span class="name"></span><input type="range" step="any"><input type="number" step="any"><span class="unit"></span>`;
      const [name, range, number, unitWord] = row.children;
      name.textContent = input.name;
      unitWord.textContent = word;
      for (const field of [range, number]) field.setAttribute("aria-label", `${input.name}, ${word}`);
      range.min = input.low * factor; range.max = input.high * factor;
      const take = (text) => { const value = Number(text); if (text !== "" && Number.isFinite(value)) { at[k] = value / factor; show(); } };
      range.addEventListener("input", () => take(range.value));
      number.addEventListener("change", () => take(number.value));
      input.follow = () => {
        range.value = at[k] * factor;
        if (document.activeElement !== number) number.value = Number((at[k] * factor).toPrecision(6));
      };
      $("sliders").append(row);
    });
  }

  // Matrices and actuators.
  let matrix = "K";
  function showMatrix() {
    const rows = planar ? [2, 3, 4] : [0, 1, 2, 3, 4, 5];
    const head = `<tr><th></th>${rows.map((j) => `<th class="n">${NAMES[j]}</th>`).join("")}</tr>`;
    const body = rows.map((i) => `<tr><th>${NAMES[i]}</th>${rows.map((j) => {
      const value = entry(matrix, i, j) * BLOCKS[matrix][block(i, j)][0];
      const small = Math.abs(entry(matrix, i, j)) < 1e-12 * Math.sqrt(Math.abs(entry(matrix, i, i) * entry(matrix, j, j)));
      return `<td class="n${i === j ? " diagonal" : ""}">${shown(small ? 0 : value)}</td>`;
    }).join("")}</tr>`).join("");
    $("matrix").innerHTML = head + body;
    const [turn, mixed, move] = BLOCKS[matrix].map(([, word]) => word);
    $("matrix-units").textContent = `${matrix === "K" ? "Stiffness" : "Compliance"} at the tool point in axes of the base: rotations ${turn}, couplings ${mixed}, translations ${move}.`;
  }
  function buildActuators() {
    actuators.forEach((actuator, k) => {
      const [factor, word] = unit(actuator.si), row = document.createElement("tr");
      row.innerHTML = `<td></td><td class="n"></td><td></td>`;
      const [name, cell, unitWord] = row.children;
      name.textContent = actuator.name; unitWord.textContent = word;
      if (!data.forward) { actuator.follow = () => { cell.textContent = shown(places[k] * factor, 7); }; }
      else {
        const field = document.createElement("input");
        field.type = "number"; field.step = "any";
        field.setAttribute("aria-label", `${actuator.name}, ${word}`);
        field.addEventListener("change", () => drive(k, Number(field.value) / factor));
        actuator.follow = () => {
          if (document.activeElement !== field) field.value = Number.isFinite(places[k]) ? Number((places[k] * factor).toPrecision(8)) : "";
        };
        cell.append(field);
      }
      $("actuators").append(row);
    });
    $("actuators-hint").hidden = !data.forward;
  }
  // The pose follows an actuator that is set.
  function drive(k, coordinate) {
    const wanted = Array.from(places.slice(0, actuators.length));
    wanted[k] = coordinate;
    const pose = wanted.every(Number.isFinite) && poseOf(wanted, prepared(at), data, programs);
    document.activeElement.blur();
    if (pose) { pose.forEach((value, j) => { at[j] = value; }); show(); }
    else { show("No pose nearby has these coordinates of the actuators."); }
  }
  const MOTIONS = NAMES.map((name, k) => (k < 3 ? [`rotation ${name}`, 1e6, "µrad"] : [`displacement ${name}`, 1e6, "µm"]));
  function showQuantities() {
    const line = (name, value, word) => `<tr><td>${escaped(name)}</td><td class="n">${shown(value, 5)}</td><td>${escaped(word)}</td></tr>`;
    const named = ({ name, si }, value) => line(spaced(name), value * unit(si)[0], si === "1" ? "" : unit(si)[1]);
    number(at);
    $("quantities").innerHTML = free.map((quantity, k) => named(quantity, numbers[k])).join("");
    $("rest").hidden = !rest;
    if (!rest) return;
    const status = answerAtRest(at);
    $("rest-status").textContent = status === 0 ? "" : STATUSES[status];
    const moved = data.components.map((k) => line(MOTIONS[k][0], loaded[k] * MOTIONS[k][1], MOTIONS[k][2]));
    const others = quantities.filter((quantity) => quantity.loaded).map((quantity, k) => named(quantity, loaded[6 + k]));
    $("rest-table").innerHTML = [...moved, ...others].join("");
  }
  // Shares of the parts in an entry on the diagonal of C.
  const MOST_PARTS = 12;
  function showParts() {
    $("parts").hidden = !parts;
    if (!parts) return;
    programs.shares(prepared(at), shares);
    const k = Number($("parts-of").value), whole = entry("C", k, k);
    const rows = parts.map((name, n) => [name, shares[6 * n + k] / whole]).filter(([, share]) => share > 5e-4).sort((a, b) => Math.round(1e9 * (b[1] - a[1])));
    const other = rows.slice(MOST_PARTS).reduce((sum, [, share]) => sum + share, 0);
    const shownRows = [...rows.slice(0, MOST_PARTS), ...(other ? [["others", other]] : [])];
    const most = rows.length ? rows[0][1] : 0; // the others together may be more, and have no bar
    $("parts-table").innerHTML = shownRows.map(([name, share], n) =>
      `<tr><td>${escaped(name)}</td><td class="bar">${n < MOST_PARTS ? `<i style="width:${((100 * share) / most).toFixed(1)}%"></i>` : ""}</td><td class="n">${(100 * share).toFixed(1)} %</td></tr>`).join("");
    $("parts-none").hidden = shownRows.length > 0;
  }
  function buildParts() {
    for (const k of data.components) $("parts-of").append(option(k, `C ${NAMES[k]}`));
    $("parts-of").value = data.components.includes(5) ? 5 : data.components.at(-1);
    $("parts-of").addEventListener("change", showParts);
  }
  const option = (value, text) => { const one = document.createElement("option"); one.value = value; one.textContent = text; return one; };

  const picture = pictureOf($("picture"), data, actuators.length);

  // The map: a quantity over two inputs, the others as they are, by the part of its program that gives it alone. Quantities for
  // which modes are looked for at each point take too long.
  const described = ({ name, si }) => ({ label: spaced(name), unit: si === "1" ? "" : unit(si)[1], factor: unit(si)[0] });
  const mapped = [
    ...["K", "C"].flatMap((name) => data.components.map((k) => {
      const [factor, word] = BLOCKS[name][block(k, k)];
      return { label: `${name} ${NAMES[k]}`, unit: word, factor, of: ["answers", placeOf(name, k, k)] };
    })),
    ...free.map((quantity, k) => ({ ...described(quantity), of: ["quantities", k], slow: quantity.slow })),
    ...quantities.filter((quantity) => quantity.loaded).map((quantity, k) => ({ ...described(quantity), of: ["loaded", 6 + k], slow: quantity.slow })),
  ].filter(({ slow }) => !slow);
  const STOPS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
  const CELLS = 41;
  function paint(share) {
    const place = Math.max(0, Math.min(1, share)) * (STOPS.length - 1), k = Math.min(STOPS.length - 2, Math.floor(place));
    return STOPS[k].map((value, c) => value + (place - k) * (STOPS[k + 1][c] - value));
  }
  let latest = 0;
  async function drawMap() {
    const [choice, first, second] = ["map-of", "map-x", "map-y"].map((id) => Number($(id).value));
    const of = mapped[choice], turn = ++latest, run = await result(...of.of);
    if (turn !== latest) return; // another map has been asked for meanwhile
    const values = new Float64Array(CELLS * CELLS), point = [...at];
    const step = (k, n) => inputs[k].low + ((inputs[k].high - inputs[k].low) * n) / (CELLS - 1);
    const cell = (n) => {
      point[first] = step(first, n % CELLS); point[second] = step(second, Math.floor(n / CELLS));
      const here = prepared(point);
      return [here, of.of[0] === "loaded" ? restOf(here, rest, programs) : undefined];
    };
    const began = performance.now();
    for (let n = 0; n < values.length; n += 2) {
      const [one, other] = run.pair(cell(n), cell(Math.min(n + 1, values.length - 1)));
      values[n] = one * of.factor;
      if (n + 1 < values.length) values[n + 1] = other * of.factor;
    }
    document.documentElement.dataset.mapTime = performance.now() - began;
    let low = Infinity, high = -Infinity;
    for (const value of values) if (Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
    const image = new ImageData(CELLS, CELLS);
    values.forEach((value, k) => {
      const at = 4 * ((CELLS - 1 - Math.floor(k / CELLS)) * CELLS + (k % CELLS));
      if (Number.isNaN(value)) return;
      image.data.set([...paint(high > low ? (value - low) / (high - low) : 0.5), 255], at);
    });
    const small = document.createElement("canvas");
    small.width = small.height = CELLS;
    small.getContext("2d").putImageData(image, 0, 0);
    const canvas = $("map"), ratio = devicePixelRatio || 1, box = canvas.getBoundingClientRect();
    canvas.width = Math.round(box.width * ratio); canvas.height = Math.round(box.height * ratio);
    const pen = canvas.getContext("2d");
    pen.imageSmoothingEnabled = false;
    pen.drawImage(small, 0, 0, canvas.width, canvas.height);
    const share = (k) => (at[k] - inputs[k].low) / (inputs[k].high - inputs[k].low);
    const [x, y] = [share(first) * canvas.width, (1 - share(second)) * canvas.height];
    for (const [width, style] of [[4, "#fff"], [2, "#000"]]) {
      pen.lineWidth = width * ratio; pen.strokeStyle = style; pen.beginPath(); pen.arc(x, y, 6 * ratio, 0, 7); pen.stroke();
    }
    const known = Number.isFinite(low);
    $("map-low").textContent = known ? shown(low) : "–";
    $("map-high").textContent = known ? `${shown(high)} ${of.unit}` : "no pose here has an answer";
    for (const [id, k] of [["map-x-range", first], ["map-y-range", second]]) {
      const [factor, word] = unit(inputs[k].si);
      $(id).textContent = `${inputs[k].name}: ${shown(inputs[k].low * factor)} to ${shown(inputs[k].high * factor)} ${word}`;
    }
  }
  function buildMap() {
    mapped.forEach(({ label }, k) => $("map-of").append(option(k, label)));
    inputs.forEach((input, k) => { for (const id of ["map-x", "map-y"]) $(id).append(option(k, input.name)); });
    $("map-of").value = mapped.findIndex(({ label }) => label === (data.components.includes(5) ? "K z" : `K ${NAMES[data.components.at(-1)]}`));
    $("map-x").value = 0; $("map-y").value = Math.min(1, inputs.length - 1);
    for (const id of ["map-of", "map-x", "map-y"]) $(id).addEventListener("change", drawMap);
    $("map").addEventListener("pointerdown", (event) => {
      const box = $("map").getBoundingClientRect();
      const put = (id, share) => { const k = Number($(id).value); at[k] = inputs[k].low + share * (inputs[k].high - inputs[k].low); };
      put("map-x", (event.clientX - box.left) / box.width); put("map-y", 1 - (event.clientY - box.top) / box.height);
      show();
    });
  }

  let waiting = false, refusal = "";
  function show(message) {
    refusal = typeof message === "string" ? message : "";
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      place(at);
      const status = answer(at);
      $("status").textContent = refusal || STATUSES[status];
      $("status").classList.toggle("bad", status !== 0 || refusal !== "");
      [...inputs, ...actuators].forEach((row) => row.follow());
      showMatrix(); showQuantities(); showParts(); picture.draw(places); drawMap(); writeAddress();
    });
  }
  for (const name of ["K", "C"]) $(`show-${name}`).addEventListener("click", () => {
    matrix = name;
    for (const other of ["K", "C"]) $(`show-${other}`).setAttribute("aria-pressed", String(other === name));
    showMatrix();
  });
  $("home").addEventListener("click", () => { inputs.forEach((input, k) => { at[k] = input.home; }); show(); });
  $("file").hidden = !data.file;
  $("file").addEventListener("click", () => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([data.file], { type: "application/toml" }));
    link.download = data.fileName; link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
  $("link").hidden = location.protocol === "about:";
  $("link").addEventListener("click", async () => {
    try { await navigator.clipboard.writeText(location.href); $("link").textContent = "Copied"; }
    catch { prompt("The address with this pose:", location.href); }
    setTimeout(() => { $("link").textContent = "Copy the link"; }, 1500);
  });
  const opened = addressFields().get(MACHINE);
  addEventListener("hashchange", () => { if (addressFields().get(MACHINE) !== opened) { location.reload(); return; } readAddress(); show(); });
  addEventListener("resize", show);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", show);
  document.title = $("name").textContent = data.name;
  if (inputs.some(({ name }) => name.includes("."))) $("pose").textContent = "Pose and parameters";
  selfCheck(); readAddress(); buildSliders(); buildActuators(); buildParts(); buildMap();
  picture.measure(place(inputs.map((input) => input.home))); show();
}

// The machine is in the address, or else in the page.
const MACHINE = "m";
const addressFields = () => new URLSearchParams(location.hash.slice(1));
async function openAddress() {
  const own = JSON.parse($("machine").textContent), given = addressFields().get(MACHINE);
  if (!given && !own) {
    $("status").textContent = "This page shows the machine that its address describes, and this address describes none: kinetostat export MACHINE --to link writes one.";
    document.body.classList.add("closed");
    return;
  }
  try {
    openMachine(globalThis.opened = await functionsOf(given ? await inflated(given) : own));
  } catch (error) {
    document.body.classList.add("closed");
    $("status").textContent = `The machine in this address cannot be opened: ${error.message}.`;
    $("status").classList.add("bad");
  }
}
openAddress();
