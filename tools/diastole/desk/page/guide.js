// The desk of cines: guide points with handles, and the fitted ventricle's walls under them. Every change goes to the server, which has it in
// the file before it answers; what is shown is its points.
const desk = (() => {
  const { byId, ask, complain, clamp, inside, sizeButton, toolBar } = deskCommon;
  const hints = {
    look: "Point at a point for what it is. Lines are the fitted walls. Double-click makes a picture large; the slider above the pictures moves them all.",
    move: "Pull a point to where this wall is seen. Then fit again.",
    endo: "Click on the cavity's edge, or draw along it: points of the inner wall.",
    epi: "Click on the heart's outer edge, or draw along it: points of the outer wall.",
    base: "Click where the wall ends below the valve, in long-axis images: the plane that closes the cavity.",
    remove: "Click on a point, or draw around points that are wrong.",
  };
  const colours = { endo: "#ffd84a", epi: "#8dff9e", base: "#6db8ff", apex_endo: "#ffa640", apex_epi: "#4fe0c0" };
  const names = { endo: "inner wall", epi: "outer wall", base: "base", apex_endo: "inner apex", apex_epi: "outer apex" };
  const apartMm = 4; // of points that are drawn along an edge
  let tool = "look", state = {}, points = [], fit, players = [], drag, playing, known = { points: 0, fit: 0, problem: "" };

  // ---- what stands ----
  const here = (player, point, phase = player.phase) => point.slice === player.index && point.phase === phase;
  const pixelMm = (player) => player.slice.pixel_mm;
  const measures = () => {
    const phase = Number(byId("phase").value), one = fit?.phases[phase], image = players[0]?.slice.images[phase];
    if (!image) return;
    const number = (value) => value?.toFixed(1) ?? "?"; // null: not a number
    const words = one ? `cavity ${number(one.cavity_mL)} \u00b1 ${number(one.cavity_sigma_mL)} mL, wall ${number(one.wall_mL)} mL` : "not fitted";
    byId("measures").textContent = `phase ${image.frame}: ${words}`;
  };
  const showFindings = () => {
    const sentences = [`Points lie ${fit.rms_mm.toFixed(2)} mm RMS from the fitted walls, ${fit.noise_factor.toFixed(2)} times the errors that they state.`];
    if (!fit.converged) sentences.push("The fit did not settle.");
    for (const finding of fit.problems) sentences.push(`${finding.where ? `${finding.where}: ` : ""}${finding.what}`);
    byId("findings").replaceChildren(...sentences.map((text) => {
      const item = document.createElement("li");
      item.textContent = text;
      return item;
    }));
  };
  const redraw = () => players.forEach((player) => player.draw());
  const take = async (answer) => {
    state = answer;
    if (state.version !== known.points) {
      const answered = await ask("/points");
      known.points = answered.version;
      points = answered.points.map(([id, slice, phase, surface, column, row, sigma]) => ({ id, slice, phase, surface, at: [column, row], sigma }));
    }
    if (state.fitted_version !== known.fit) {
      fit = await ask("/fit");
      known.fit = fit.version;
      showFindings();
    }
    byId("undo").disabled = state.undoable === 0;
    byId("fit").disabled = state.fitting || state.points === 0 || state.fitted_version === state.version;
    const elsewhere = state.elsewhere ? ` (${state.elsewhere} of them in none of these images)` : "";
    byId("progress").textContent = `${state.points} points${elsewhere}; ` + (state.fitting ? "fitting \u2026" : state.fitted_version === state.version ? "the walls are fitted to them" : "the walls are not fitted to them yet");
    // Once: what is complained of since is not to be covered.
    if (state.problem !== known.problem) complain(known.problem = state.problem);
    measures();
    redraw();
  };
  const change = async (path, body) => {
    complain("");
    try {
      await take(await ask(path, body));
    } catch (error) {
      complain(error.message);
      redraw();
    }
  };
  const send = (choice) => change("/points", JSON.stringify(choice));
  const follow = async () => {
    try {
      await take(await ask("/state"));
    } catch (error) {
      complain(error.message);
    }
    setTimeout(follow, state.fitting ? 250 : 1500);
  };

  // ---- a picture ----
  const dot = (context, player, at, colour, large) => {
    const [x, y] = player.xy(...at);
    context.beginPath();
    context.arc(x, y, (large ? 0.8 : 0.5) * Math.max(player.scale, 3), 0, 7);
    context.fillStyle = colour;
    context.fill();
    context.strokeStyle = "#000000a0";
    context.lineWidth = 1.2;
    context.stroke();
  };
  const walls = (player) => ["inner", "outer"].map((wall) => fit?.slices[player.index][wall][player.phase] ?? []);
  const overlay = (player) => (context) => {
    walls(player).forEach((pieces, i) => {
      context.strokeStyle = i === 0 ? `${colours.endo}b0` : `${colours.epi}b0`;
      context.lineWidth = Math.max(1.5, 0.3 * player.scale);
      context.beginPath();
      for (let k = 0; k < pieces.length; k += 4) {
        context.moveTo(...player.xy(pieces[k], pieces[k + 1]));
        context.lineTo(...player.xy(pieces[k + 2], pieces[k + 3]));
      }
      context.stroke();
    });
    for (const point of points)
      if (here(player, point)) dot(context, player, drag?.point === point ? drag.path.at(-1) : point.at, colours[point.surface], drag?.point === point);
    if (drag?.player !== player || drag.point) return;
    if (tool === "remove") {
      player.path(context, drag.path.flat());
      context.fillStyle = "#ff5a4d40";
      context.strokeStyle = "#ff5a4d";
      context.fill();
      context.stroke();
    } else {
      for (const at of alongPath()) dot(context, player, at, colours[tool], true);
    }
  };
  const apart = (player, p, q) => Math.hypot((p[0] - q[0]) * pixelMm(player)[0], (p[1] - q[1]) * pixelMm(player)[1]);
  const nearest = (player, at, mostMm) => {
    let best, least = mostMm;
    for (const point of points) {
      if (!here(player, point)) continue;
      const far = apart(player, point.at, at);
      if (far < least) [best, least] = [point, far];
    }
    return best;
  };
  // Millimetres from a wall's line in this image.
  const fromWall = (player, point) => {
    const pieces = walls(player)[point.surface.endsWith("endo") ? 0 : 1];
    let least = Infinity;
    for (let k = 0; k < pieces.length; k += 4) {
      const [ax, ay, bx, by] = pieces.slice(k, k + 4).map((v, i) => v * pixelMm(player)[i % 2]);
      const [x, y] = point.at.map((v, i) => v * pixelMm(player)[i]), length = (bx - ax) ** 2 + (by - ay) ** 2;
      const part = length > 0 ? Math.min(Math.max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length, 0), 1) : 0;
      least = Math.min(least, Math.hypot(x - ax - part * (bx - ax), y - ay - part * (by - ay)));
    }
    return least;
  };
  const describe = (player, at) => {
    const point = nearest(player, at, 3);
    if (!point) return "";
    const off = point.surface === "base" ? Infinity : fromWall(player, point);
    return `${names[point.surface]}, stated error ${point.sigma} mm` + (Number.isFinite(off) ? `, ${off.toFixed(1)} mm from the fitted wall` : "");
  };

  // ---- the mouse ----
  const alongPath = () => { // every few millimetres of what was drawn, its beginning included
    const { player, path } = drag, chosen = [path[0]];
    for (const at of path) if (apart(player, at, chosen.at(-1)) >= apartMm) chosen.push(at);
    // A drawn ring ends where it began.
    if (chosen.length > 3 && apart(player, chosen[0], chosen.at(-1)) < 0.5 * apartMm) chosen.pop();
    return chosen;
  };
  const rounded = (at) => at.map((v) => Math.round(100 * v) / 100);
  const end = () => {
    const { player, phase, point, path } = drag;
    const chosen = point || tool === "remove" ? undefined : alongPath();
    drag = undefined;
    if (tool === "move") {
      if (point && apart(player, point.at, path.at(-1)) > 0.1) return send({ action: "move", point: point.id, to: rounded(path.at(-1)) });
    } else if (tool === "remove") {
      const one = nearest(player, path[0], 3), isClick = path.every((at) => apart(player, at, path[0]) < 1.5);
      const ids = isClick ? (one ? [one.id] : []) : points.filter((p) => here(player, p, phase) && inside(p.at, path)).map((p) => p.id);
      if (ids.length) return send({ action: "remove", points: ids });
    } else {
      return send({ action: "set", slice: player.index, phase, surface: tool, at: chosen.map(rounded) });
    }
    return player.draw();
  };
  const equip = (player) => {
    const { canvas } = player, at = (event) => { const place = player.place(event); return clamp(player, [place.column, place.row]); };
    player.overlays.push(overlay(player));
    canvas.addEventListener("pointerdown", (event) => {
      if (tool === "look" || event.button !== 0) return;
      event.preventDefault();
      player.play(false);
      playAll(false);
      const place = at(event), point = tool === "move" ? nearest(player, place, 4) : undefined;
      if (tool === "move" && !point) return;
      if (!player.image.picture) return complain(`Slice ${player.slice.name} has no image of this phase.`);
      drag = { player, phase: player.phase, point, path: [place] };
      canvas.setPointerCapture(event.pointerId);
      player.draw();
    });
    canvas.addEventListener("pointermove", (event) => {
      player.holder.querySelector(".cine-at").textContent = describe(player, at(event));
      if (drag?.player !== player) return;
      drag.path.push(at(event));
      player.draw();
    });
    canvas.addEventListener("pointerup", () => { if (drag?.player === player) end(); });
    canvas.addEventListener("pointercancel", () => { drag = undefined; player.draw(); });
    sizeButton(player, () => tool === "look");
  };
  const figure = (slice) => {
    const holder = document.createElement("figure");
    holder.className = "cine";
    holder.innerHTML = '<div class="cine-view"><canvas role="img"></canvas><output class="cine-at"></output></div><div class="cine-bar"><button type="button" class="cine-play" aria-label="play or stop">&#9654;</button><input type="range" class="cine-phase" min="0" value="0" aria-label="phase"><output class="cine-time"></output></div><figcaption></figcaption>';
    holder.querySelector("canvas").setAttribute("aria-label", `${slice.name}, ${slice.view}`);
    holder.querySelector(".cine-phase").max = slice.images.length - 1;
    holder.querySelector("figcaption").textContent = `${slice.name}, ${slice.view}: ${slice.rows} \u00d7 ${slice.columns} pixels of ${slice.pixel_mm[1].toFixed(2)} \u00d7 ${slice.pixel_mm[0].toFixed(2)} mm.`;
    byId("cines").append(holder);
    return holder;
  };

  // ---- all pictures together ----
  const setPhase = (phase) => {
    byId("phase").value = phase;
    for (const player of players) player.range.value = phase;
    measures();
    redraw();
  };
  byId("phase").addEventListener("input", () => setPhase(Number(byId("phase").value)));
  const playAll = (on) => {
    clearInterval(playing);
    playing = on ? setInterval(() => setPhase((Number(byId("phase").value) + 1) % (Number(byId("phase").max) + 1)), 120) : undefined;
    byId("play").textContent = on ? "\u25a0" : "\u25b6";
  };
  byId("play").addEventListener("click", () => playAll(playing === undefined));
  const pick = toolBar(hints, (name) => {
    tool = name;
    drag = undefined;
    redraw();
  });
  byId("undo").addEventListener("click", () => send({ action: "undo" }));
  byId("fit").addEventListener("click", () => change("/fit", ""));
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && drag) { drag = undefined; redraw(); }
    if ((event.ctrlKey || event.metaKey) && event.key === "z" && state.undoable) { event.preventDefault(); send({ action: "undo" }); }
  });
  const begin = async () => {
    const { folder, guide, slices } = await ask("/images");
    byId("folder").textContent = `${folder}: guide points in ${guide}`;
    byId("phase").max = slices[0].images.length - 1;
    players = slices.map((slice, index) => Object.assign(new CinePlayer(figure(slice), slice), { index }));
    players.forEach(equip);
    follow();
  };
  pick("look");
  begin().catch((error) => complain(error.message));
  return { get players() { return players; }, get points() { return points; }, get state() { return state; }, get fit() { return fit; } };
})();
