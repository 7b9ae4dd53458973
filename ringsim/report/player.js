"use strict";
(() => {
  const data = JSON.parse(document.getElementById("player-data").textContent);
  const UNKNOWN = -32768;
  const ints = (text) =>
    new Int16Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const unpacked = (places) => places && { ...places, points: ints(places.points) };
  const samples = data.samples.map(
    (each) => ({ ...each, angles: ints(each.angles), places: unpacked(each.places) }));
  const ring = { ...data.ring, points: ints(data.ring.points) };
  const joints = ring.joints;
  const LOOKS = {
    diagonals: ["#0072b2", 1.5], bars: ["#b5552a", 1.5], "hinge assemblies": ["#222222", 3],
    boom: ["#6e6e6e", 5], net: ["#8fcfb5", 0.9], spacecraft: ["#cc79a7", 2],
  };
  const byId = (name) => document.getElementById(name);
  const canvas = byId("scene"), pen = canvas.getContext("2d");
  const slider = byId("moment"), button = byId("play"), told = byId("told");
  let sample = samples[0], time = 0, azimuth = 0.75, elevation = 0.45, playing = false, last = 0;

  const end = () => sample.end;

  // The frame after a value, and how far that is on the way to it.
  function between(values, value) {
    let k = 1;
    while (k < values.length - 1 && values[k] < value) k += 1;
    return [k, Math.min(1, Math.max(0, (value - values[k - 1]) / (values[k] - values[k - 1])))];
  }

  // Point n of the points of all frames, [x, y, z] in m, linear between two frames.
  function mixed({ points, unit }, all, k, w, n) {
    return [0, 1, 2].map((i) => {
      const a = points[((k - 1) * all + n) * 3 + i], b = points[(k * all + n) * 3 + i];
      return unit * (a + w * (b - a));
    });
  }

  // Opening angles in degree of all V-joints at a time, linear between frames and to their locks.
  function anglesAt(moment) {
    const [k, w] = between(sample.times, moment), found = [];
    const late = moment > sample.times[k], from = late ? k : k - 1, begin = sample.times[from];
    for (let j = 0; j < joints; j += 1) {
      const a = sample.angles[from * joints + j], lock = sample.locks[j];
      const locks = lock !== null && (late || lock <= sample.times[k]);
      const b = locks ? 18000 : sample.angles[k * joints + j];
      const share = !locks ? w : moment >= lock ? 1 : (moment - begin) / (lock - begin);
      found.push(a === UNKNOWN || b === UNKNOWN ? NaN : (a + share * (b - a)) / 100);
    }
    return found;
  }

  // Points of the ring, [x, y, z] in m, the V-joints last: as computed, or from the angles.
  function pointsAt(angles, mean) {
    if (sample.places) {
      const [k, w] = between(sample.places.times, time), count = ring.fixed + joints;
      return Array.from({ length: count }, (_, n) => mixed(sample.places, count, k, w, n));
    }
    const [k, w] = between(ring.means, mean), found = [];
    const at = (n) => mixed(ring, ring.fixed + 2 * joints, k, w, n);
    for (let n = 0; n < ring.fixed; n += 1) found.push(at(n));
    for (let j = 0; j < joints; j += 1) {
      const middle = at(ring.fixed + j), aside = at(ring.fixed + joints + j);
      const folded = Math.cos((angles[j] * Math.PI) / 360);
      found.push(middle.map((m, i) => m + folded * aside[i]));
    }
    return found;
  }

  // Orange ahead, grey with the mean, purple behind: safe for the colour-blind.
  function colour(lag, most) {
    const share = Math.max(-1, Math.min(1, lag / most)), full = share > 0 ? [200, 90, 0] : [84, 39, 136];
    const mix = full.map((c) => Math.round(190 + Math.abs(share) ** 0.7 * (c - 190)));
    return `rgb(${mix})`;
  }

  // V-joint and opening angle in degree of each encoder that has readings about a time.
  function measuredAt(moment) {
    return data.measured
      .filter(({ times }) => times.length > 1 && moment >= times[0] && moment <= times[times.length - 1])
      .map(({ joint, times, angles }) => {
        const [k, w] = between(times, moment);
        return [joint, angles[k - 1] + w * (angles[k] - angles[k - 1])];
      });
  }

  const largest = new Map();
  function mostLag() {
    if (!largest.has(sample)) {
      let most = 0.01;
      for (const moment of sample.times) {
        const angles = anglesAt(moment), mean = angles.reduce((a, b) => a + b, 0) / joints;
        const every = [...angles, ...measuredAt(moment).map((each) => each[1])];
        for (const angle of every) if (Math.abs(angle - mean) > most) most = Math.abs(angle - mean);
      }
      largest.set(sample, most);
    }
    return largest.get(sample);
  }

  function dot(x, y, size, lag, locked) {
    pen.globalAlpha = 1;
    pen.beginPath();
    pen.arc(x, y, size, 0, 2 * Math.PI);
    pen.fillStyle = colour(lag, mostLag());
    pen.fill();
    if (locked) { pen.lineWidth = 1.5; pen.strokeStyle = "#222"; pen.stroke(); }
  }

  // The size of the deployed ring, so that it grows into the sheet.
  const reach = (() => {
    let flat = 0, high = 0;
    for (const { points, unit } of [ring, ...samples.map((each) => each.places).filter(Boolean)]) {
      for (let n = 0; n < points.length; n += 3) {
        flat = Math.max(flat, unit * Math.hypot(points[n], points[n + 1]));
        high = Math.max(high, unit * Math.abs(points[n + 2]));
      }
    }
    return [flat, high];
  })();

  function drawRing(width, height, angles, mean) {
    const points = pointsAt(angles, mean);
    const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
    const scale = 0.94 * Math.min(width / 2 / reach[0], height / 2 / (reach[0] * Math.abs(se) + reach[1] * ce));
    const seen = points.map(([x, y, z]) => {
      const out = ca * x + sa * y;
      return [width / 2 + scale * (ca * y - sa * x), height / 2 - scale * (ce * z - se * out), ce * out + se * z];
    });
    const order = ring.lines.map((line) => [line, seen[line[0]][2] + seen[line[1]][2]]);
    order.sort((a, b) => a[1] - b[1]);
    pen.lineCap = "round";
    for (const [[from, to, group], near] of order) {
      const [ink, thick] = LOOKS[ring.groups[group]] || ["#6e6e6e", 1.2];
      pen.globalAlpha = Math.max(0.3, Math.min(1, 0.7 + (0.3 * near) / 2 / reach[0]));
      pen.strokeStyle = ink;
      pen.lineWidth = thick;
      pen.beginPath();
      pen.moveTo(seen[from][0], seen[from][1]);
      pen.lineTo(seen[to][0], seen[to][1]);
      pen.stroke();
    }
    if (ring.craft !== null) {
      const [x, y] = seen[ring.craft];
      pen.globalAlpha = 1;
      [pen.fillStyle] = LOOKS.spacecraft;
      pen.fillRect(x - 6, y - 6, 12, 12);
    }
    const faces = angles.map((angle, j) => [angle, seen[ring.fixed + j]]).sort((a, b) => a[1][2] - b[1][2]);
    for (const [angle, [x, y]] of faces) dot(x, y, 4.5, angle - mean, angle > 179.99);
  }

  function drawLag(width, height, angles, mean) {
    const most = mostLag(), count = data.sections.length, left = 46, low = height - 34, top = 14;
    const x = (n) => left + ((n + 0.5) * (width - left - 8)) / count;
    const y = (lag) => (top + low) / 2 - (lag / most) * 0.46 * (low - top);
    pen.globalAlpha = 1;
    pen.fillStyle = pen.strokeStyle = "#6e6e6e";
    pen.lineWidth = 0.8;
    pen.font = "12px system-ui, sans-serif";
    for (const lag of [-most, 0, most]) {
      pen.beginPath(); pen.moveTo(left, y(lag)); pen.lineTo(width, y(lag)); pen.stroke();
      pen.fillText(lag.toPrecision(2), 4, y(lag) + 4);
    }
    const step = Math.ceil(count / (width / 40));
    data.sections.forEach((name, n) => { if (n % step === 0) pen.fillText(name, x(n) - 4, low + 14); });
    pen.fillText(`deviation from the mean (deg) by section: ${data.planes.join(" solid, ")} dashed`, left, height - 4);
    data.planes.forEach((_, plane) => {
      pen.setLineDash(plane ? [5, 3] : []);
      pen.beginPath();
      for (let n = 0; n < count; n += 1) pen.lineTo(x(n), y(angles[plane * count + n] - mean));
      pen.stroke();
      pen.setLineDash([]);
      for (let n = 0; n < count; n += 1) {
        const angle = angles[plane * count + n];
        dot(x(n), y(angle - mean), 4.5, angle - mean, angle > 179.99);
      }
    });
    for (const [joint, angle] of measuredAt(time)) {
      const [across, down] = [x(joint % count), y(angle - mean)];
      pen.beginPath();
      for (const [i, j] of [[-7, 0], [0, -7], [7, 0], [0, 7]]) pen.lineTo(across + i, down + j);
      pen.closePath();
      pen.lineWidth = 2;
      pen.strokeStyle = "#d55e00";
      pen.setLineDash(joint < count ? [] : [3, 2]);
      pen.stroke();
      pen.setLineDash([]);
    }
  }

  function draw() {
    const width = canvas.clientWidth, height = canvas.clientHeight, sharp = window.devicePixelRatio || 1;
    if (canvas.width !== Math.round(width * sharp)) {
      canvas.width = Math.round(width * sharp);
      canvas.height = Math.round(height * sharp);
    }
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    pen.clearRect(0, 0, width, height);
    const angles = anglesAt(time), mean = angles.reduce((a, b) => a + b, 0) / joints;
    (byId("view").value === "ring" ? drawRing : drawLag)(width, height, angles, mean);
    const spread = Math.max(...angles) - Math.min(...angles);
    told.textContent = `${time.toFixed(2)} s of ${end().toFixed(2)} s, mean opening angle ` +
      `${mean.toFixed(1)} deg, asynchrony ${spread.toFixed(2)} deg.`;
    slider.value = Math.round((1000 * time) / end());
  }

  function tick(now) {
    if (!playing) return;
    // A whole run lasts ten seconds, whatever the run's own clock says.
    // The first frame may have begun before the click.
    time += (end() * Math.min(100, Math.max(0, now - last))) / 10000;
    last = Math.max(last, now);
    if (time >= end()) { time = end(); setPlaying(false); }
    draw();
    if (playing) requestAnimationFrame(tick);
  }

  function setPlaying(on) {
    playing = on;
    button.textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (time >= end()) time = 0;
    last = performance.now();
    requestAnimationFrame(tick);
  }

  button.addEventListener("click", () => setPlaying(!playing));
  byId("view").addEventListener("change", draw);
  byId("sample").addEventListener("change", (event) => {
    sample = samples[Number(event.target.value)];
    time = Math.min(time, end());
    draw();
  });
  for (const show of document.querySelectorAll("button.show")) {
    show.addEventListener("click", () => {
      byId("sample").value = show.dataset.place;
      byId("sample").dispatchEvent(new Event("change"));
      byId("player").scrollIntoView();
    });
  }
  slider.addEventListener("input", () => { time = (slider.value / 1000) * end(); draw(); });
  let held = null;
  canvas.addEventListener("pointerdown", (event) => {
    held = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (held === null) return;
    azimuth -= (event.clientX - held[0]) / 150;
    elevation = Math.max(-1.5, Math.min(1.5, elevation + (event.clientY - held[1]) / 150));
    held = [event.clientX, event.clientY];
    draw();
  });
  for (const word of ["pointerup", "pointercancel"]) canvas.addEventListener(word, () => { held = null; });
  window.addEventListener("resize", draw);
  // Half open says more than a folded bundle; a sheet, which nobody plays, has three moments.
  const mean = (moment) => anglesAt(moment).reduce((a, b) => a + b, 0) / joints;
  const halfway = () => {
    const middle = (mean(0) + mean(end())) / 2;
    return sample.times.find((moment) => mean(moment) >= middle) || end();
  };
  window.addEventListener("beforeprint", () => {
    const moments = [0, halfway(), end()], now = time, side = 600, high = 400;
    [canvas.width, canvas.height] = [3 * side, high];
    moments.forEach((moment, place) => {
      time = moment;
      pen.setTransform(1.5, 0, 0, 1.5, place * side, 0);
      drawRing(side / 1.5, high / 1.5, anglesAt(moment), mean(moment));
    });
    time = now;
    const words = moments.map((moment) => `${mean(moment).toFixed(1)} deg at ${moment.toFixed(2)} s`);
    told.textContent = `${sample.name}; mean opening angle ${words.join(", ")}.`;
  });
  window.addEventListener("afterprint", () => { canvas.width = 0; draw(); });
  time = halfway();
  draw();
})();
