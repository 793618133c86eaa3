(function () {
  "use strict";
  var SPAN = 60, views = [], ended = false;
  var get = function (id) { return document.getElementById(id); };
  var ink = function (name) { return getComputedStyle(document.documentElement).getPropertyValue(name); };

  function canvas(id) {
    var element = get(id), ratio = window.devicePixelRatio || 1;
    var width = element.clientWidth, height = element.clientHeight;
    if (element.width !== Math.round(width * ratio)) { element.width = Math.round(width * ratio); }
    if (element.height !== Math.round(height * ratio)) { element.height = Math.round(height * ratio); }
    var pen = element.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    return { pen: pen, width: width, height: height };
  }

  // Least and greatest of what is drawn, a little apart where it is one number. Of a band that was
  // far wider than now, as at the start, the value counts alone.
  function limits(key, spread) {
    var low = Infinity, high = -Infinity, last = views[views.length - 1];
    views.forEach(function (view) {
      view[key].forEach(function (value, i) {
        if (value === null) { return; }
        var more = 0;
        if (spread && view[spread][i] !== null) {
          var now = last[spread][i];
          more = 2 * (now === null ? view[spread][i] : Math.min(view[spread][i], 1.5 * now));
          if (now !== null && view[spread][i] > 4 * now) { return; }
        }
        low = Math.min(low, value - more);
        high = Math.max(high, value + more);
      });
    });
    if (low > high) { return [-1, 1]; }
    var margin = 0.05 * (high - low) || Math.abs(high) * 0.1 || 1e-6;
    return [low - margin, high + margin];
  }

  // Multiples of 1, 2 or 5 times a power of ten, about four.
  function ticks(range) {
    var rough = (range[1] - range[0]) / 4, power = Math.pow(10, Math.floor(Math.log10(rough))), found = [];
    var step = power * [1, 2, 5, 10].filter(function (k) { return k * power >= 0.999 * rough; })[0];
    for (var k = Math.ceil(range[0] / step); k * step <= range[1]; k += 1) { found.push(k * step); }
    return { step: step, values: found };
  }

  function shortened(value, step) {
    return Math.abs(value) < 1e-9 * step ? "0" : String(Number(value.toPrecision(6)));
  }

  function plot(id, key, spread) {
    var to = canvas(id), pen = to.pen, range = limits(key, spread), marks = ticks(range);
    pen.font = "12px system-ui, sans-serif";
    var labels = marks.values.map(function (value) { return shortened(value, marks.step); });
    var left = 8 + Math.max.apply(null, labels.map(function (label) { return pen.measureText(label).width; }).concat([20]));
    var end = views[views.length - 1].seconds, step = 0.05 * (to.width - left) / SPAN + 0.1;
    var x = function (t) { return left + (to.width - left) * (1 - (end - t) / SPAN); };
    var y = function (v) { return to.height * (range[1] - v) / (range[1] - range[0]); };
    pen.fillStyle = ink("--ink");
    pen.strokeStyle = ink("--line");
    pen.lineWidth = 1;
    marks.values.forEach(function (value, i) {
      pen.beginPath(); pen.moveTo(left, y(value)); pen.lineTo(to.width, y(value)); pen.stroke();
      pen.fillText(labels[i], left - 4 - pen.measureText(labels[i]).width, Math.min(to.height - 4, Math.max(12, y(value) + 4)));
    });
    pen.save();
    pen.beginPath(); pen.rect(left, 0, to.width - left, to.height); pen.clip();
    views[0].names.forEach(function (name, axis) {
      var colour = ink("--axis" + axis % 4), open = false;
      pen.strokeStyle = pen.fillStyle = colour;
      if (spread) {
        pen.globalAlpha = 0.2;
        views.forEach(function (view) {
          var value = view[key][axis], two = 2 * view[spread][axis];
          if (value !== null && two !== null) { pen.fillRect(x(view.seconds), y(value + two), step, y(value - two) - y(value + two)); }
        });
        pen.globalAlpha = 1;
      }
      pen.beginPath();
      views.forEach(function (view) {
        var value = view[key][axis];
        if (value === null) { open = false; return; }
        if (open) { pen.lineTo(x(view.seconds), y(value)); } else { pen.moveTo(x(view.seconds), y(value)); }
        open = true;
      });
      pen.lineWidth = 1.5;
      pen.stroke();
    });
    pen.restore();
    legend(id + "-names");
  }

  function legend(id) {
    var element = get(id);
    if (element.dataset.names === views[0].names.join()) { return; }
    element.dataset.names = views[0].names.join();
    element.textContent = "";
    views[0].names.forEach(function (name, axis) {
      var key = document.createElement("span");
      key.className = "key axis" + axis % 4;
      key.textContent = name;
      element.appendChild(key);
    });
  }

  function turned(q, v) {
    var w = q[0], x = q[1], y = q[2], z = q[3];
    return [
      (1 - 2 * (y * y + z * z)) * v[0] + 2 * (x * y - w * z) * v[1] + 2 * (x * z + w * y) * v[2],
      2 * (x * y + w * z) * v[0] + (1 - 2 * (x * x + z * z)) * v[1] + 2 * (y * z - w * x) * v[2],
      2 * (x * z - w * y) * v[0] + 2 * (y * z + w * x) * v[1] + (1 - 2 * (x * x + y * y)) * v[2]
    ];
  }

  // A box, longest along x, seen from the south, a little from above.
  function cube(q) {
    var to = canvas("cube"), pen = to.pen, size = Math.min(to.width, to.height) / 3.2;
    var at = function (v) {
      var e = turned(q, v);
      return [to.width / 2 + size * e[0], to.height / 2 - size * (0.9 * e[2] + 0.35 * e[1])];
    };
    var corner = function (i) { return [i & 1 ? 1 : -1, i & 2 ? 0.7 : -0.7, i & 4 ? 0.25 : -0.25]; };
    pen.strokeStyle = ink("--ink");
    pen.lineWidth = 1.5;
    for (var i = 0; i < 8; i++) {
      [1, 2, 4].forEach(function (bit) {
        if (i & bit) { return; }
        var a = at(corner(i)), b = at(corner(i | bit));
        pen.beginPath(); pen.moveTo(a[0], a[1]); pen.lineTo(b[0], b[1]); pen.stroke();
      });
    }
    ["x", "y", "z"].forEach(function (name, axis) {
      var v = [0, 0, 0], o = at(v);
      v[axis] = 1.4;
      var tip = at(v);
      pen.strokeStyle = pen.fillStyle = ink("--axis" + axis);
      pen.lineWidth = 3;
      pen.beginPath(); pen.moveTo(o[0], o[1]); pen.lineTo(tip[0], tip[1]); pen.stroke();
      pen.fillText(name, tip[0] + 4, tip[1]);
    });
  }

  var text = function (value) { return value === null ? "missing" : value.toPrecision(4); };

  function draw() {
    if (!views.length) { return; }
    var last = views[views.length - 1], rows = get("numbers");
    get("state").textContent = last.seconds.toFixed(1) + " s, " + last.status + (ended ? ", ended" : "");
    document.querySelectorAll(".unit").forEach(function (e) { e.textContent = last.unit ? "in " + last.unit : ""; });
    plot("rate", "rate", null);
    plot("bias", "bias", "bias_sigma");
    get("body").hidden = !last.quaternion;
    if (last.quaternion) {
      cube(last.quaternion);
      get("angles").textContent = ["roll", "pitch", "yaw"].map(function (name, i) {
        return name + " " + (last.euler_deg[i] === null ? "missing" : last.euler_deg[i].toFixed(1) + "°");
      }).join(", ");
    }
    rows.textContent = "";
    last.names.forEach(function (name, i) {
      var row = rows.insertRow(), head = document.createElement("th");
      head.textContent = name;
      row.appendChild(head);
      [last.rate[i], last.bias[i], last.bias_sigma[i]].forEach(function (value) { row.insertCell().textContent = text(value); });
    });
  }

  var pending = false;
  function soon() {
    if (pending) { return; }
    pending = true;
    window.requestAnimationFrame(function () { pending = false; draw(); });
  }

  var events = new EventSource("/events");
  events.onmessage = function (event) {
    var view = JSON.parse(event.data);
    if (views.length && (view.seconds < views[views.length - 1].seconds || view.names.length !== views[0].names.length)) { views = []; }
    views.push(view);
    while (views[0].seconds < view.seconds - SPAN) { views.shift(); }
    soon();
  };
  events.addEventListener("end", function () { ended = true; events.close(); soon(); });
  events.onerror = function () { if (!ended) { get("state").textContent = "no connection to the stream"; } };
  window.addEventListener("resize", soon);
})();
