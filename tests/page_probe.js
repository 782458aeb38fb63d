// Stands at the end of a copy of a report page that tests/it/report.rs opens in a browser: takes the
// first player through its trial and writes, as JSON, what is to be seen into the page.
"use strict";
window.spikeloop.ready.then(() => {
  const [player] = window.spikeloop.players;
  // Pixels that are drawn on, of every canvas.
  const inked = () => Array.from(document.querySelectorAll(".player canvas"), (canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return data.filter((_, at) => at % 4 === 3 && data[at] > 0).length;
  });
  const pictures = () => Array.from(document.querySelectorAll(".player canvas"), (c) => c.toDataURL()).join();
  const seen = [0, Math.floor(player.last() / 2), player.last()].map((at) => {
    player.slider.value = String(at);
    player.slider.dispatchEvent(new Event("input"));
    return { at: player.at, text: player.root.innerText, inked: inked(), pictures: pictures() };
  });
  const still = document.querySelector(".still");
  const said = {
    errors: window.errors,
    texts: seen.map((tick) => tick.text),
    inked: seen.map((tick) => tick.inked),
    moves: seen[0].pictures !== seen[1].pictures && seen[1].pictures !== seen[2].pictures,
    still_hidden: getComputedStyle(still).display === "none",
    page_px: [document.documentElement.scrollWidth, window.innerWidth],
    // Parts that reach out of the page and cannot be scrolled into view.
    cut_off: Array.from(document.querySelectorAll("main *"))
      .filter((part) => part.getBoundingClientRect().right > window.innerWidth + 1)
      .filter((part) => !part.closest(".table, .picture"))
      .map((part) => part.tagName + "." + part.className),
  };
  const pre = document.createElement("pre");
  pre.id = "probe";
  pre.textContent = JSON.stringify(said);
  document.body.append(pre);
});
