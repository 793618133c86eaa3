(function () {
  "use strict";
  var scene = document.getElementById("scene"), slider = document.getElementById("time");
  var clock = document.getElementById("clock"), play = document.getElementById("play");
  var numbers = document.getElementById("numbers"), count = VIEW.time.length;
  var azimuth = 0.5, elevation = 0.35, playing = false, shown = 0, begun = 0, offset = 0;
  slider.max = count - 1;

  function ink(name) { return getComputedStyle(document.documentElement).getPropertyValue(name); }

  function turned(q, v) {
    var w = q[0], x = q[1], y = q[2], z = q[3];
    return [
      (1 - 2 * (y * y + z * z)) * v[0] + 2 * (x * y - w * z) * v[1] + 2 * (x * z + w * y) * v[2],
      2 * (x * y + w * z) * v[0] + (1 - 2 * (x * x + z * z)) * v[1] + 2 * (y * z - w * x) * v[2],
      2 * (x * z - w * y) * v[0] + 2 * (y * z + w * x) * v[1] + (1 - 2 * (x * x + y * y)) * v[2]
    ];
  }

  // To east, north and up, whatever the axes of the earth are.
  var toEnu = {
    enu: function (v) { return v; },
    ned: function (v) { return [v[1], v[0], -v[2]]; },
    nwu: function (v) { return [-v[1], v[0], v[2]]; }
  }[VIEW.frame];

  function draw() {
    var ratio = window.devicePixelRatio || 1, width = scene.clientWidth, height = scene.clientHeight;
    if (scene.width !== Math.round(width * ratio)) { scene.width = Math.round(width * ratio); }
    if (scene.height !== Math.round(height * ratio)) { scene.height = Math.round(height * ratio); }
    var pen = scene.getContext("2d"), size = Math.min(width / 4.4, height / 5.2);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "13px system-ui, sans-serif";
    pen.lineJoin = "round";
    var ca = Math.cos(azimuth), sa = Math.sin(azimuth), ce = Math.cos(elevation), se = Math.sin(elevation);

    function at(e) {
      var across = ca * e[0] + sa * e[1], along = -sa * e[0] + ca * e[1];
      return [width / 2 + size * across, 0.45 * height - size * (ce * e[2] + se * along)];
    }
    function line(a, b, colour, thick, dashes) {
      var p = at(a), r = at(b);
      pen.strokeStyle = colour;
      pen.lineWidth = thick;
      pen.setLineDash(dashes || []);
      pen.beginPath(); pen.moveTo(p[0], p[1]); pen.lineTo(r[0], r[1]); pen.stroke();
      pen.setLineDash([]);
    }
    function arrow(a, b, colour, name, thick) {
      line(a, b, colour, thick);
      var p = at(a), r = at(b), angle = Math.atan2(r[1] - p[1], r[0] - p[0]);
      pen.fillStyle = colour;
      pen.beginPath();
      pen.moveTo(r[0] + 7 * Math.cos(angle), r[1] + 7 * Math.sin(angle));
      [2.5, -2.5].forEach(function (side) { pen.lineTo(r[0] + 6 * Math.cos(angle + side), r[1] + 6 * Math.sin(angle + side)); });
      pen.fill();
      pen.fillText(name, r[0] + 10, r[1] + 4);
    }
    function box(q, colour, thick, dashes) {
      function corner(i) {
        return toEnu(turned(q, [i & 1 ? 1 : -1, i & 2 ? 0.6 : -0.6, i & 4 ? 0.2 : -0.2]));
      }
      for (var i = 0; i < 8; i += 1) {
        [1, 2, 4].forEach(function (bit) { if (!(i & bit)) { line(corner(i), corner(i | bit), colour, thick, dashes); } });
      }
    }

    var ground = -1.7, faint = ink("--line");
    for (var k = -2; k <= 2; k += 1) {
      line([k, -2, ground], [k, 2, ground], faint, 1);
      line([-2, k, ground], [2, k, ground], faint, 1);
    }
    arrow([0, 0, ground], [0, 2.2, ground], ink("--z"), VIEW.mag ? "north" : "start", 2.5);
    arrow([0, 0, 0], [0, 0, ground + 0.15], ink("--faint"), "gravity", 2);
    var q = VIEW.q[shown], reference = VIEW.reference && VIEW.reference[shown];
    if (reference) { box(reference, ink("--faint"), 1.2, [5, 4]); }
    if (q) {
      box(q, ink("--ink"), 1.6);
      ["x", "y", "z"].forEach(function (name, axis) {
        var v = [0, 0, 0];
        v[axis] = [1.6, 1.3, 1.0][axis];
        arrow([0, 0, 0], toEnu(turned(q, v)), ink("--" + name), name, 3);
      });
    }
    write();
  }

  function angle(value, sigma) {
    if (value === null) { return "missing"; }
    var text = value.toFixed(1) + "°";
    return sigma === null || sigma === undefined ? text : text + " ± " + sigma.toFixed(1) + "°";
  }

  function write() {
    var euler = VIEW.euler[shown] || [null, null, null], tilt = VIEW.tilt[shown];
    var rows = [["roll", angle(euler[0], tilt)], ["pitch", angle(euler[1], tilt)],
      [VIEW.mag ? "yaw" : "yaw from start", angle(euler[2], VIEW.heading[shown])]];
    if (VIEW.error) { rows.push(["error", angle(VIEW.error[shown])]); }
    var state = VIEW.rest[shown] === "1" ? "at rest" : "moving";
    rows.push(["state", VIEW.disturbed[shown] === "1" ? state + ", field disturbed" : state]);
    numbers.textContent = "";
    rows.forEach(function (row) {
      var group = document.createElement("div");
      ["dt", "dd"].forEach(function (tag, i) {
        var cell = document.createElement(tag);
        cell.textContent = row[i];
        group.appendChild(cell);
      });
      numbers.appendChild(group);
    });
    clock.textContent = VIEW.time[shown].toFixed(2) + " s";
    document.documentElement.dataset.frame = shown;
  }

  function show(index) {
    shown = Math.max(0, Math.min(count - 1, index));
    slider.value = shown;
    slider.setAttribute("aria-valuetext", VIEW.time[shown].toFixed(2) + " s");
    draw();
  }

  function tick(now) {
    if (!playing) { return; }
    var seconds = offset + (now - begun) / 1000, index = shown;
    while (index < count - 1 && VIEW.time[index + 1] <= seconds) { index += 1; }
    show(index);
    if (index === count - 1) { set(false); return; }
    window.requestAnimationFrame(tick);
  }

  function set(on) {
    playing = on;
    play.textContent = on ? "Pause" : "Play";
    play.setAttribute("aria-pressed", String(on));
    if (!on) { return; }
    if (shown === count - 1) { show(0); }
    begun = performance.now();
    offset = VIEW.time[shown];
    window.requestAnimationFrame(tick);
  }

  play.addEventListener("click", function () { set(!playing); });
  slider.addEventListener("input", function () { set(false); show(Number(slider.value)); });
  scene.addEventListener("pointermove", function (event) {
    if (!event.buttons) { return; }
    azimuth += 0.01 * event.movementX;
    elevation = Math.max(-0.2, Math.min(1.5, elevation + 0.01 * event.movementY));
    draw();
  });
  scene.addEventListener("keydown", function (event) {
    var step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (step) { set(false); show(shown + step); event.preventDefault(); }
  });
  window.addEventListener("resize", draw);
  var start = Number((window.location.hash.match(/^#t=([\d.]+)$/) || [0, 0])[1]), first = 0;
  while (first < count - 1 && VIEW.time[first] < start) { first += 1; }
  show(first);
}());
