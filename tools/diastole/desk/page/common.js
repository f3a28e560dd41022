// What the desks' pages share: the way to the program, the bar of tools, and pictures that become large.
const deskCommon = (() => {
  const byId = (id) => document.getElementById(id);
  // The token comes behind # and is taken out of sight; it stays with this tab.
  if (location.hash.startsWith("#token=")) {
    sessionStorage.setItem("token", location.hash.slice(7));
    history.replaceState(null, "", location.pathname);
  }
  const ask = async (path, body) => {
    let answer;
    try {
      answer = await fetch(path, {
        method: body === undefined ? "GET" : "POST", body,
        headers: { Authorization: `Bearer ${sessionStorage.getItem("token") ?? ""}` } });
    } catch {
      throw new Error("The desk has ended: its program does not answer. What was chosen stands in the file.");
    }
    if (!answer.ok) throw new Error((await answer.text()).trim());
    return answer.json();
  };
  const complain = (text) => {
    byId("problem").textContent = text;
    byId("problem").hidden = !text;
  };
  const clamp = (player, [column, row]) => [Math.min(Math.max(column, -0.5), player.slice.columns - 0.5), Math.min(Math.max(row, -0.5), player.slice.rows - 0.5)];

  // Whether a place lies within a closed path of places.
  const inside = (place, path) => {
    let odd = false;
    for (let i = 0, j = path.length - 1; i < path.length; j = i++)
      if ((path[i][1] > place[1]) !== (path[j][1] > place[1]) && place[0] < (path[j][0] - path[i][0]) * (place[1] - path[i][1]) / (path[j][1] - path[i][1]) + path[i][0]) odd = !odd;
    return odd;
  };

  // A button that makes a picture large; a double click does, where `mayClick` lets it.
  const sizeButton = (player, mayClick) => {
    const size = document.createElement("button");
    size.type = "button";
    size.className = "desk-size";
    const name = () => { size.textContent = player.holder.classList.contains("cine-large") ? "smaller" : "larger"; };
    const toggle = () => { player.holder.classList.toggle("cine-large"); name(); player.holder.scrollIntoView({ block: "nearest" }); };
    name();
    size.addEventListener("click", toggle);
    player.canvas.addEventListener("dblclick", () => { if (mayClick()) toggle(); });
    player.holder.querySelector(".cine-bar").append(size);
  };

  // Buttons of tools, by mouse and by the keys 1, 2, ...; `hints` by their names. Returns what picks one.
  const toolBar = (hints, picked) => {
    const buttons = [...document.querySelectorAll("button[data-tool]")];
    const pick = (name) => {
      document.body.dataset.tool = name;
      byId("hint").textContent = hints[name];
      for (const button of buttons) button.setAttribute("aria-pressed", String(button.dataset.tool === name));
      picked(name);
    };
    buttons.forEach((button) => button.addEventListener("click", () => pick(button.dataset.tool)));
    document.addEventListener("keydown", (event) => {
      const button = buttons[Number(event.key) - 1];
      if (button && !event.ctrlKey && !event.altKey && !event.metaKey) pick(button.dataset.tool);
    });
    return pick;
  };
  return { byId, ask, complain, clamp, inside, sizeButton, toolBar };
})();
