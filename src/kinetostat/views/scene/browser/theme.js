// The page's colours for what is drawn on a canvas, and a call whenever light and dark change.

export function isDark() {
  return document.body.classList.contains("body--dark");
}

export function colour(name) {
  return getComputedStyle(document.body).getPropertyValue(`--${name}`).trim();
}

export function onTheme(callback) {
  const observer = new MutationObserver(callback);
  observer.observe(document.body, { attributes: true, attributeFilter: ["class"] });
  return observer;
}
