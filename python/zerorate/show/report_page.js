(function () {
  "use strict";
  var folded = [];
  window.addEventListener("beforeprint", function () {
    folded = Array.prototype.slice.call(document.querySelectorAll("details:not([open])"));
    folded.forEach(function (one) { one.open = true; });
  });
  window.addEventListener("afterprint", function () {
    folded.forEach(function (one) { one.open = false; });
  });
  var plots = Array.prototype.slice.call(document.querySelectorAll("svg.plot"));
  if (!plots.length) { return; }
  var whole = Number(plots[0].dataset.seconds), from = 0, to = whole;
  function show() {
    plots.forEach(function (plot) {
      plot.setAttribute("viewBox", (1000 * from / whole) + " 0 " + (1000 * (to - from) / whole) + " 200");
    });
    var rough = (to - from) / 6, power = Math.pow(10, Math.floor(Math.log10(rough)));
    var step = power * [1, 2, 5, 10].filter(function (k) { return k * power >= 0.999 * rough; })[0];
    var digits = Math.max(0, -Math.floor(Math.log10(step))), ticks = "";
    for (var k = Math.ceil(from / step); k * step <= to; k += 1) {
      ticks += '<span style="left:' + (100 * (k * step - from) / (to - from)) + '%">' +
        Number((k * step).toFixed(digits)) + "</span>";
    }
    document.querySelectorAll(".columns").forEach(function (e) { e.innerHTML = ticks; });
  }
  function set(a, b) {
    var width = Math.min(whole, Math.max(whole / 500, b - a));
    from = Math.min(Math.max(0, (a + b - width) / 2), whole - width);
    to = from + width;
    show();
  }
  var steps = {
    closer: function () { var w = (to - from) / 4; set(from + w, to - w); },
    wider: function () { var w = (to - from) / 2; set(from - w, to + w); },
    left: function () { var w = (to - from) / 4; set(from - w, to - w); },
    right: function () { var w = (to - from) / 4; set(from + w, to + w); },
    all: function () { set(0, whole); }
  };
  document.querySelectorAll("button[data-step]").forEach(function (button) {
    button.addEventListener("click", steps[button.dataset.step]);
  });
  document.querySelectorAll("a[data-from]").forEach(function (link) {
    link.addEventListener("click", function () {
      var a = Number(link.dataset.from), b = Number(link.dataset.to), room = Math.max(b - a, whole / 100);
      set(a - room, b + room);
    });
  });
  document.querySelector(".bar").hidden = false;
}());
