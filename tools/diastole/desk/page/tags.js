// The desk: tracked slices with handles. What is drawn becomes a choice (one line of the edits file) on the server, which answers with
// all choices that stand; what is shown is theirs.
const desk = (() => {
  const { byId, ask, complain, clamp, inside, sizeButton, toolBar } = deskCommon;
  const hints = {
    look: "Point at a line for its tag and its error, at a cross for why it was left out. Double-click makes a picture large.",
    line: "Pull a line to where this tag is seen; its neighbourhood comes along, with Shift the whole line. Then track again.",
    mask: "Draw around pixels that are not to count.",
    outer: "Pull the dashed or drawn outer edge, or draw a new one around the wall.",
    inner: "Pull the dashed or drawn inner edge, or draw a new one around the cavity.",
  };
  let tool = "look", edits = [], state = {}, shownVersion = -1, players = [], lines, drag;

  // ---- what stands ----
  const here = (player, edit) => edit.slice === player.slice.name && (edit.phase === "all" || edit.phase === player.image.frame);
  const words = (edit) => {
    if (edit.action === "height") return `${edit.slice} lies ${edit.height_mm} mm over mid-height`;
    const what = { line: () => `line of tag ${edit.tag}`, mask: () => "mask", contour: () => `${edit.contour} edge` }[edit.action]();
    return `${edit.slice}, ${edit.phase === "all" ? "all phases" : `phase ${edit.phase}`}: ${what}, ${edit.points.length} points`;
  };
  const showChoices = () => {
    byId("choices").replaceChildren(...edits.map((edit) => {
      const item = document.createElement("li"), back = document.createElement("button");
      item.value = edit.line;
      item.textContent = words(edit);
      back.textContent = "take back";
      back.type = "button";
      back.addEventListener("click", () => choose({ action: "undo", line: edit.line }));
      item.append(back);
      return item;
    }));
    byId("undo").disabled = edits.length === 0;
  };
  const take = (answer) => {
    state = answer;
    edits = answer.edits;
    showChoices();
    byId("track").disabled = state.tracking || state.changed === 0;
    byId("progress").textContent = state.tracking ? `tracking: ${state.done} of ${state.of} slices …`
      : state.changed ? `${state.changed} ${state.changed === 1 ? "slice is" : "slices are"} not tracked with the choices yet` : "tracked with all choices";
    if (state.problem) complain(state.problem);
    players.forEach((player) => player.draw());
  };
  const choose = async (choice) => {
    complain("");
    try {
      take(await ask("/edits", JSON.stringify(choice)));
    } catch (error) {
      complain(error.message);
      players.forEach((player) => player.draw());
    }
  };
  const follow = async () => {
    try {
      take(await ask("/state"));
      if (state.version !== shownVersion && state.version > 0) await show();
    } catch (error) {
      complain(error.message);
    }
    setTimeout(follow, state.tracking ? 250 : 1500);
  };
  const show = async () => {
    const phases = players.map((player) => player.phase), large = players.map((player) => player.holder.classList.contains("cine-large"));
    players.forEach((player) => player.play(false));
    shownVersion = state.version;
    const { html, record } = await ask("/tracking");
    byId("folder").textContent = `${record.folder}: ${record.points} tag points, standard errors ${record.rms_px.toFixed(3)} px RMS`;
    byId("tracking").innerHTML = html;
    ({ players, lines } = cinePlayers(record));
    players.forEach((player, i) => {
      player.range.value = phases[i] ?? 0;
      player.holder.classList.toggle("cine-large", large[i] ?? false);
      equip(player);
      player.draw();
    });
  };

  // ---- drawing on a picture ----
  const pairs = (flat) => Array.from({ length: flat.length / 2 }, (_, i) => [flat[2 * i], flat[2 * i + 1]]);
  const kinds = (player) => { // the found outlines: those within another are inner
    const all = player.image.outlines ?? [], found = { inner: [], outer: [] };
    for (const one of all) found[all.some((other) => other !== one && inside(one.slice(0, 2), pairs(other))) ? "inner" : "outer"].push(one);
    return found;
  };
  const edge = (player, kind) => { // the one that counts: as drawn last, or the only one that was found
    const drawn = edits.filter((edit) => edit.action === "contour" && edit.contour === kind && here(player, edit)).at(-1);
    if (drawn) return drawn.points;
    const found = kinds(player)[kind];
    return found.length === 1 ? pairs(found[0]) : undefined;
  };
  const stroke = (context, player, points, closed) => {
    context.beginPath();
    points.forEach((point) => context.lineTo(...player.xy(...point)));
    if (closed) context.closePath();
    context.stroke();
  };
  const dots = (context, player, points) => points.forEach((point) => {
    const [x, y] = player.xy(...point);
    context.beginPath();
    context.arc(x, y, 0.6 * player.scale, 0, 7);
    context.fill();
    context.save();
    context.strokeStyle = "#000000a0";
    context.lineWidth = 1.5;
    context.stroke();
    context.restore();
  });
  const colours = { outer: "#8dff9e", inner: "#ffd84a", mask: "#ff5a4d", line: "#ffffff" };
  const overlay = (player) => (context) => {
    context.lineWidth = Math.max(2, 0.35 * player.scale);
    const paint = (action, points, kind) => {
      context.strokeStyle = context.fillStyle = colours[kind];
      if (action === "mask") {
        player.path(context, points.flat());
        context.fillStyle = "#ff5a4d40";
        context.fill();
        context.stroke();
      } else if (action === "contour") {
        stroke(context, player, points, true);
      } else {
        stroke(context, player, points, false);
        dots(context, player, points);
      }
    };
    for (const edit of edits) {
      if (!here(player, edit)) continue;
      const is_replaced = edit.action === "contour" && edit !== edits.filter((one) => one.action === "contour" && one.contour === edit.contour && here(player, one)).at(-1);
      if (!is_replaced) paint(edit.action, edit.points, edit.contour ?? edit.action);
    }
    if (["outer", "inner"].includes(tool) && drag?.player !== player) {
      context.fillStyle = colours[tool];
      dots(context, player, edge(player, tool) ?? []);
    }
    if (drag?.player === player) paint(drag.action, drag.points, drag.kind);
  };

  // ---- the mouse ----
  const nearest = (points, at) => points.reduce((best, point, index) => {
    const apart = Math.hypot(point[0] - at[0], point[1] - at[1]);
    return apart < best.apart ? { apart, index } : best;
  }, { apart: Infinity, index: -1 });
  /// The piece of a tag's line next to a place.
  const lineAt = (player, at) => {
    let best = { apart: 4 };
    for (const line of lines(player.slice, player.image)) {
      const places = line.points.map((p) => [p.column, p.row]), found = nearest(places, at);
      if (found.apart >= best.apart) continue;
      let first = found.index, last = found.index + 1;
      while (!line.breaks[first]) --first;
      while (last < places.length && !line.breaks[last]) ++last;
      best = { apart: found.apart, line, places: places.slice(first, last), index: found.index - first };
    }
    return best.line && best;
  };
  const begin = (player, at) => {
    if (tool === "line") {
      const found = lineAt(player, at);
      if (!found) return undefined;
      const direction = player.slice.directions[found.line.direction];
      return { player, action: "line", kind: "line", from: at, start: found.places, index: found.index, points: [], reach: direction.spacing_mm / player.slice.pixel_mm[0],
        choice: { tag: found.line.tag, direction: found.line.direction + 1 } };
    }
    if (tool === "mask") return { player, action: "mask", kind: "mask", from: at, points: [at], choice: {} };
    const known = edge(player, tool), found = known && nearest(known, at);
    if (found && found.apart < 3) return { player, action: "contour", kind: tool, from: at, start: known, index: found.index, points: known, reach: 3, choice: { contour: tool } };
    return { player, action: "contour", kind: tool, from: at, points: [at], choice: { contour: tool } };
  };
  const move = (at, whole) => {
    const { player, start } = drag;
    if (!start) { // freehand
      const last = drag.points.at(-1);
      if (Math.hypot(at[0] - last[0], at[1] - last[1]) >= 1) drag.points.push(at);
      return;
    }
    const by = [at[0] - drag.from[0], at[1] - drag.from[1]], middle = start[drag.index];
    const share = (p) => whole ? 1 : Math.exp(-0.5 * (Math.hypot(p[0] - middle[0], p[1] - middle[1]) / drag.reach) ** 2);
    const moved = start.map((p) => [share(p), clamp(player, [p[0] + share(p) * by[0], p[1] + share(p) * by[1]])]);
    // Of a line what was moved counts; of an edge all of it.
    drag.points = moved.filter(([part]) => drag.action !== "line" || part > 0.6).map(([, p]) => p);
    drag.far = Math.hypot(...by);
  };
  const end = () => {
    const { player, action, start, points, far, choice } = drag;
    drag = undefined;
    const area = Math.abs(points.reduce((sum, p, i) => { const q = points[(i + 1) % points.length]; return sum + 0.5 * (p[0] * q[1] - q[0] * p[1]); }, 0));
    const counts = start ? far > 0.3 : points.length > 2 && area > 4;
    if (!counts) return player.draw();
    const all = action === "mask" && byId("all-phases").checked;
    choose({ slice: player.slice.name, phase: all ? "all" : player.image.frame, action, ...choice, points: points.map((p) => p.map((v) => Math.round(100 * v) / 100)) });
  };
  const equip = (player) => {
    player.overlays.push(overlay(player));
    const { canvas } = player, at = (event) => { const place = player.place(event); return clamp(player, [place.column, place.row]); };
    canvas.addEventListener("pointerdown", (event) => {
      if (tool === "look" || event.button !== 0) return;
      event.preventDefault();
      player.play(false);
      drag = begin(player, at(event));
      if (drag) canvas.setPointerCapture(event.pointerId);
      player.draw();
    });
    canvas.addEventListener("pointermove", (event) => {
      if (drag?.player !== player) return;
      move(at(event), event.shiftKey);
      player.draw();
    });
    canvas.addEventListener("pointerup", () => { if (drag?.player === player) end(); });
    canvas.addEventListener("pointercancel", () => { drag = undefined; player.draw(); });
    sizeButton(player, () => tool === "look");
  };

  // ---- the bar ----
  const pick = toolBar(hints, (name) => {
    tool = name;
    drag = undefined;
    players.forEach((player) => player.draw());
  });
  byId("undo").addEventListener("click", () => choose({ action: "undo" }));
  byId("track").addEventListener("click", async () => {
    complain("");
    try { take(await ask("/track", "")); } catch (error) { complain(error.message); }
  });
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && drag) { drag = undefined; players.forEach((player) => player.draw()); }
    if ((event.ctrlKey || event.metaKey) && event.key === "z" && edits.length) { event.preventDefault(); choose({ action: "undo" }); }
  });
  pick("look");
  follow();
  return { get players() { return players; }, get edits() { return edits; }, get state() { return state; } };
})();
