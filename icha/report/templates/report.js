"use strict";
// A click enlarges a figure. Arrow keys and buttons show the next or the previous figure. Escape or a click closes it.
const viewer = document.getElementById("viewer");
const figures = [...document.querySelectorAll("figure")];
let shown = 0;
function show(at) {
  shown = (at + figures.length) % figures.length;
  const image = viewer.querySelector("img");
  image.src = figures[shown].querySelector("img").src;
  image.alt = figures[shown].querySelector("img").alt;
  const words = viewer.querySelector(".words");
  words.replaceChildren(...figures[shown].querySelector("figcaption p").cloneNode(true).childNodes);
  words.scrollTop = 0;
  if (!viewer.open) viewer.showModal();
}
figures.forEach((figure, at) => figure.querySelector("button").addEventListener("click", () => show(at)));
viewer.querySelector("img").addEventListener("click", () => viewer.close());
viewer.querySelector(".close").addEventListener("click", () => viewer.close());
viewer.querySelector(".next").addEventListener("click", () => show(shown + 1));
viewer.querySelector(".previous").addEventListener("click", () => show(shown - 1));
viewer.addEventListener("keydown", (event) => {
  if (event.key === "ArrowRight") show(shown + 1);
  if (event.key === "ArrowLeft") show(shown - 1);
});

// The table of contents marks the present section: the last heading above the top of the window.
const links = [...document.querySelectorAll("nav a")];
const places = links.map((link) => document.getElementById(link.hash.slice(1)));
let marked = null;
function mark() {
  const end = window.innerHeight + window.scrollY >= document.documentElement.scrollHeight - 2;
  let at = 0;
  places.forEach((place, k) => { if (end || place.getBoundingClientRect().top < 120) at = k; });
  if (links[at] === marked) return;
  if (marked) marked.removeAttribute("aria-current");
  marked = links[at];
  marked.setAttribute("aria-current", "true");
  if (window.matchMedia("(max-width: 60rem)").matches) {
    const bar = document.querySelector("nav");
    bar.scrollLeft = marked.offsetLeft - bar.clientWidth / 2;
  }
}
document.addEventListener("scroll", mark, { passive: true });
mark();

// A link to a folded part of the page unfolds this part.
document.querySelectorAll("a[href^='#']").forEach((link) => link.addEventListener("click", () => {
  const target = document.getElementById((link.hash || link.getAttribute("href")).slice(1));
  const folded = target && target.closest("details");
  if (folded) folded.open = true;
}));

const theme = document.getElementById("theme");
theme.hidden = false;
theme.addEventListener("click", () => {
  const root = document.documentElement;
  const chosen = root.style.colorScheme || (window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  root.style.colorScheme = chosen === "dark" ? "light" : "dark";
});
