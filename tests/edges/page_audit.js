// What a browser can say of a page's accessibility: text that is hard to read, and what the keyboard cannot reach.
window.audit = {
  rgba(text) {
    const pen = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d");
    pen.fillStyle = text;
    pen.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = pen.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  },
  over([r, g, b, a], below) {
    return [r, g, b].map((c, k) => a * c + (1 - a) * below[k]);
  },
  luminance(rgb) {
    const [r, g, b] = rgb.map((c) => c / 255).map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  },
  ground(element) {
    const chain = [];
    for (let at = element; at; at = at.parentElement) chain.unshift(this.rgba(getComputedStyle(at).backgroundColor));
    return chain.reduce((below, own) => this.over(own, below), [255, 255, 255]);
  },
  shown(element) {
    const box = element.getBoundingClientRect();
    return box.width > 1 && box.height > 1 && element.checkVisibility({ opacityProperty: true, visibilityProperty: true });
  },
  contrast(element) {
    const ground = this.ground(element);
    const ink = this.over(this.rgba(getComputedStyle(element).color), ground);
    const [high, low] = [this.luminance(ink), this.luminance(ground)].sort((a, b) => b - a);
    return (high + 0.05) / (low + 0.05);
  },
  faint() {
    const found = [];
    for (const element of document.body.querySelectorAll("*")) {
      const own = element.matches("input") ? element.value : [...element.childNodes].map((n) => (n.nodeType === 3 ? n.data : "")).join("");
      const off = element.closest(".disabled, :disabled, [aria-disabled=true], [aria-hidden=true], .machine-labels, .q-tooltip, .q-icon, [type=range], script, style");
      if (!own.trim() || off || !this.shown(element)) continue;
      const { fontSize, fontWeight } = getComputedStyle(element);
      const large = parseFloat(fontSize) >= 24 || (parseFloat(fontSize) >= 18.66 && fontWeight >= 700);
      const contrast = this.contrast(element);
      if (contrast < (large ? 3 : 4.5)) found.push(`${own.trim().slice(0, 40)}: ${contrast.toFixed(2)} ${element.className}`);
    }
    return found;
  },
  controls() {
    const all = document.querySelectorAll("button, input, a[href], [tabindex='0']");
    const off = ":disabled, .disabled, [aria-disabled=true], [type=file]";
    return [...all].filter((one) => one.tabIndex >= 0 && !one.matches(off) && this.shown(one.closest(".q-field") ?? one));
  },
  name(element) {
    const labels = [...(element.labels ?? [])].map((label) => label.innerText).join(" ");
    return (element.getAttribute("aria-label") || labels || element.innerText || element.title || "").trim();
  },
  number() {
    const all = this.controls(); // a tab that has the focus is no stop of the keyboard any more: count before
    all.forEach((one, k) => (one.auditNumber = k));
    return all.length;
  },
  unnamed() {
    return this.controls().filter((one) => !this.name(one)).map((one) => one.outerHTML.slice(0, 120));
  },
  focused() {
    const at = document.activeElement;
    if (!at || at === document.body) return null;
    const ring = (one) => {
      const style = getComputedStyle(one);
      return (style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1) || style.boxShadow !== "none";
    };
    const field = at.closest(".q-field__control");
    return { number: at.auditNumber ?? -1, name: this.name(at), ring: ring(at) || (field !== null && ring(field)) };
  },
};
