// The page: asks the daemon some times a second, shows what it says, and passes on orders.

import { Daemon, Refused, codes, takeToken } from "./daemon.js";
import { ExperimentChoice, askName, askTakeover, by, showProblem, describeError } from "./dialogs.js";
import { Trace } from "./trace.js";

const keptName = "diastole-name";
const keptTheme = "diastole-theme";
const staleAfter_ms = 1500;
const lostAfter_ms = 6000;
const sleptAfter_ms = 2000;  // a look that comes so late: the browser let the page sleep
const stopTimeout_ms = 700;
const mostEvents = 500;
const rowsAtOnce = 1000;  // that the daemon sends in one answer

const stateWords = {
  unhomed: ["Not homed", "The pump does not know its place: home it before a run."],
  homed: ["Ready", "The pump is homed and at rest."],
  armed: ["Armed", "The next start moves the pump."],
  running: ["Running", ""],
  stopping: ["Stopping", "The pump is being brought to rest."],
  faulted: ["Fault", "The pump stands still until the fault is cleared."],
  homing: ["Homing", "The pump withdraws to its home switch."],
  jogging: ["Moving", "The pump is being moved by hand."],
  loading: ["Loading", "The controller checks the experiment."],
  writing: ["Writing", "The run has ended; its file is being written."],
  clearing_fault: ["Clearing", "The fault is being cleared."],
  self_testing: ["Self-test", "The controller measures its own outputs."],
  zeroing: ["Zeroing", "The pressure channels are averaged at rest."],
  calibrating: ["Measuring", "The pressure channels are averaged at rest."],
};
const moving = new Set(["running", "stopping", "homing", "jogging", "loading"]);
const phaseWords = { waiting: "waiting for the scanner", dummy: "dummy cycles", imaging: "imaging", pause: "pause", done: "done" };

const trace = new Trace(by("chart"));
const choice = new ExperimentChoice();
let name = sessionStorage.getItem(keptName) ?? "";
let status = null, progress = null, heardAt_ms = -Infinity, problem = "", nextRemark = 0, shownRun = "", behind = false;
let lookedAt_ms = performance.now(), wokeAt_ms = 0;
let controlled = false, letGo = false; // when the daemon was last heard; by this page's own wish
const daemon = new Daemon(takeToken(), { heard, changed });

const text = (id, words) => { if (by(id).textContent !== words) by(id).textContent = words; };
const grouped = (number) => String(number).replace(/\B(?=(\d{3})+$)/g, "\u2009");
const plural = (count, word) => `${grouped(count)} ${word}${count === 1 ? "" : "s"}`;
const pendingSleeps = new Set();
const sleep = (ms) => new Promise((done) => {
  const end = () => { pendingSleeps.delete(end); done(); };
  pendingSleeps.add(end);
  setTimeout(end, ms);
});

function duration(seconds) {
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) return `${whole} s`;
  return `${Math.floor(whole / 60)} min ${String(whole % 60).padStart(2, "0")} s`;
}

// ---- the connection

function heard() { heardAt_ms = performance.now(); }

async function changed(open, why) {
  problem = why;
  if (open) heard();
  if (open && name) await daemon.call("console.sign_in", { name }).catch(() => { name = ""; });
  showFreshness();
}

/// A page behind others looks and asks once a minute only, and is answered at once: that it has heard nothing for long
/// says nothing. A question that finds no answer while the page is awake does.
function showFreshness() {
  const now_ms = performance.now(), age_ms = now_ms - heardAt_ms;
  if (now_ms - lookedAt_ms > sleptAfter_ms) wokeAt_ms = now_ms;
  lookedAt_ms = now_ms;
  const silent_ms = now_ms - Math.max(wokeAt_ms, heardAt_ms, daemon.unansweredSince_ms);
  if (daemon.isOpen && silent_ms > lostAfter_ms) daemon.giveUp("The daemon is silent.");
  const stale = !daemon.isOpen || age_ms > staleAfter_ms;
  document.body.classList.toggle("stale", stale);
  by("lost").hidden = !stale || (heardAt_ms < 0 && !problem);
  const age = heardAt_ms < 0 ? "" : ` What is shown here is ${duration(age_ms / 1000)} old.`;
  text("lost-text", (problem || "The daemon is silent.") + age + " Trying again …");
  text("link-text", stale ? "not connected" : daemon.role === "watch" ? "watching" : "connected");
  by("link").classList.toggle("good", !stale);
}

/// Calls `ask` again and again, each time after the last answer; what is lost with the connection is asked for anew.
async function repeat(interval_ms, ask) {
  for (;;) {
    await sleep(interval_ms());
    if (daemon.isOpen) await ask().catch(() => {});
  }
}

async function askStatus() {
  const refused = (error) => (error instanceof Refused ? { problem: error } : Promise.reject(error));
  status = await daemon.call("rig.status").catch(refused);
  showAll();
}

async function askRun() {
  const [newTrace, newProgress] = await Promise.all([
    daemon.call("run.trace", trace.wanted), daemon.call("run.progress", { first_remark: nextRemark })]);
  progress = newProgress;
  behind = newTrace.time_s.length >= rowsAtOnce;
  const fresh = trace.add(newTrace);
  showEvents();
  if (status) showAll();
  if (fresh) trace.show();
}

// ---- what is shown

function showAll() {
  showState();
  showCounters();
  showControl();
  by("chart-empty").hidden = trace.length > 0;
  document.body.dataset.state = status.state ?? "away";
  by("start").disabled = daemon.role === "watch" || !["homed", "armed"].includes(status.state);
  by("home").disabled = daemon.role === "watch" || !["homed", "unhomed", "armed"].includes(status.state);
  by("clear").hidden = status.problem !== undefined;
  by("clear").disabled = daemon.role === "watch" || moving.has(status.state);
}

function showState() {
  const [words, explanation] = status.problem ? ["Not there", "The controller does not answer."]
    : stateWords[status.state] ?? [status.state.replaceAll("_", " "), ""];
  text("state", words);
  text("state-detail", runDetail() || explanation || "\u00a0");
  const share = status.state === "running" && progress?.planned_s > 0 ? Math.min(1, trace.last_s / progress.planned_s) : 0;
  by("progress-bar").style.width = 100 * share + "%";
  by("progress").setAttribute("aria-valuenow", Math.round(100 * share));
  const live = status.state === "running" || status.state === "stopping";  // between runs nothing is measured
  text("pressure", live && trace.last_kPa != null ? trace.last_kPa.toFixed(2) : "–");
  showBanners();
}

function runDetail() {
  if (!progress) return "";
  if (status.state === "running") {
    const slice = progress.schedule;
    const where = slice ? `Slice ${slice.slice + 1} of ${slice.slices} (${slice.block}): ${phaseWords[slice.phase]}, ${plural(slice.cycles_left, "cycle")} left`
      : `Cycle ${progress.triggers} of ${progress.planned_cycles}`;
    return `${where} · ${duration(progress.planned_s - trace.last_s)} left`;
  }
  const result = progress.result;
  if (status.state !== "homed" || !result) return "";
  const end = result.end.replaceAll("_", " ");
  return result.run_file ? `The last run: ${end}, ${plural(result.cycles, "cycle")}, ${plural(result.gaps, "sample")} missing. ${result.run_file}`
    : `The last run: ${end}. ${result.problem ?? ""} ${result.journal ?? ""}`;
}

function showBanners() {
  const away = status.problem?.message.split("\n");
  by("fault").hidden = !status.fault && !away;
  if (away) {
    text("fault-title", "The controller");
    text("fault-text", away[0]);
    text("fault-remedy", away.slice(1).join(" ").trim());
  } else if (status.fault) {
    text("fault-title", `Fault ${status.fault_number}: ${status.fault.replaceAll("_", " ")}`);
    text("fault-text", status.fault_text);
    text("fault-remedy", status.remedy);
  }
  const notice = [status.notice, status.settings_problem].filter(Boolean).join(" ");
  by("notice").hidden = !notice;
  text("notice-text", notice);
  const prompt = status.state === "running" && progress?.schedule?.prompt;
  by("prompt").hidden = !prompt;
  text("prompt-title", prompt ? `Slice ${progress.schedule.slice + 1} of ${progress.schedule.slices} waits` : "");
  text("prompt-text", prompt || "");
}

function counter(id, value, note, bad) {
  text(id, value);
  text(id + "-note", note);
  by("box-" + id).classList.toggle("bad", bad);
}

function showCounters() {
  if (progress) {
    const gate = progress.gate_pulses;
    counter("triggers", grouped(progress.triggers),
            gate == null ? `of ${grouped(progress.planned_cycles)} cycles` : `host counts ${grouped(gate)}`,
            gate != null && Math.abs(gate - progress.triggers) > 1);
    counter("samples", grouped(progress.received), "received", false);
    counter("missing", grouped(progress.missing), progress.missing ? "see the events" : "every sample is there", progress.missing > 0);
  }
  if (status.problem) return;
  const inputs = status.inputs.map((input) => input.replaceAll("_", " ")).join(", ");
  counter("position", status.position_mL.toFixed(1) + " mL",
          inputs ? inputs + " active" : status.motor_powered ? "motor powered" : "motor off", status.inputs.includes("estop"));
  const { crc_errors: errors, retransmissions: repeats } = status.link;
  counter("line", errors + repeats === 0 ? "good" : plural(errors, "error"), plural(repeats, "repetition"), errors > 0);
  text("rig-name", status.board === undefined ? "" : "· " + status.controller.split("/").pop());
  text("footer", `firmware ${status.firmware} at ${status.controller} · ${status.instrument}`
    + (status.journals ? ` · ${plural(status.journals.count, "journal")} in ${status.journals.directory}` : ""));
}

/// Who held the control and has it no more is told, however long the page was not looked at: it ends with the connection, as when
/// the computer slept, or another has taken it over.
function showLoss(control, holder) {
  if (status.problem) return; // unknown
  if (controlled && !control?.own && !letGo) {
    showProblem("You no longer control the rig", new Error(control
      ? `${holder} has taken the control over.`
      : "The connection was broken, and the control ended with it. Take it again if you need it."));
  }
  controlled = Boolean(control?.own);
  letGo = letGo && controlled;
}

function showControl() {
  const control = status.control;
  const holder = !control ? (status.problem ? "unknown" : "") : control.own ? "you" : `${control.user} (${control.console ? "console at " + control.console : "process " + control.pid})`;
  text("control-text", daemon.role === "watch" ? `watching and stopping only${holder ? " · control: " + holder : ""}`
    : `${name ? name + " · " : ""}control: ${holder || "free"}`);
  by("take").hidden = daemon.role === "watch" || Boolean(control?.own);
  by("release").hidden = !control?.own;
  showLoss(control, holder);
}

function showEvents() {
  if (!progress) return;
  if (progress.run_id !== shownRun) {
    shownRun = progress.run_id;
    nextRemark = 0;
    by("events").replaceChildren();
    return;
  }
  nextRemark = progress.next_remark;
  for (const remark of progress.remarks) {
    const item = document.createElement("li");
    item.className = remark.level;
    const time = document.createElement("time");
    time.textContent = new Date(remark.utc).toLocaleTimeString("en-GB");
    item.append(time, `${remark.level === "info" ? "" : remark.level + ": "}${remark.text}`);
    by("events").prepend(item);
  }
  while (by("events").children.length > mostEvents) by("events").lastChild.remove();
  by("events-empty").hidden = by("events").children.length > 0;
}

// ---- orders

async function signIn(typed) {
  await daemon.call("console.sign_in", { name: typed });
  name = typed;
  sessionStorage.setItem(keptName, name);
}

/// Calls with the control that it needs: asks for a name, and for a takeover by name. Throws what the daemon refuses;
/// false if the person gave up.
async function withControl(method, params = {}) {
  if (!name && !(await askName(signIn))) return false;
  try {
    await daemon.call(method, params);
  } catch (error) {
    if (!(error instanceof Refused) || error.code !== codes.controlHeld) throw error;
    const sentence = `${error.message.split(";")[0]}. If that is agreed between you, take the control over: the log and the run’s events will tell both names.`;
    const confirmed = await askTakeover(sentence[0].toUpperCase() + sentence.slice(1),
                                    (holder) => daemon.call("control.take", { take_over: holder }));
    if (!confirmed) return false;
    if (method !== "control.take") await daemon.call(method, params);
  }
  return true;
}

function order(button, title, method) {
  by(button).addEventListener("click", () => withControl(method).catch((error) => showProblem(title, error)));
}

/// Says at once when nobody confirms it: who wants a stop is not to wait for a time-out.
async function stop(how) {
  const title = daemon.isOpen ? "The daemon has not confirmed the stop: press the emergency stop"
    : "The stop did not reach the daemon: press the emergency stop";
  let reported = false;
  const reportProblem = (error) => { reported = true; showProblem(title, error); };
  const late = setTimeout(() => reportProblem(new Error("It was sent, and nothing came back.")), stopTimeout_ms);
  try {
    const { stopping } = await daemon.call("run.stop", { how });
    if (reported) by("problem-dialog").close();
    flash(stopping ? "Stopping …" : "Nothing was moving");
  } catch (error) {
    reportProblem(error);
  }
  clearTimeout(late);
}

function flash(words) {
  const label = by("stop").firstElementChild;
  label.textContent = words;
  clearTimeout(flash.timer);
  flash.timer = setTimeout(() => { label.textContent = "Stop"; }, 2000);
}

order("home", "The pump was not homed", "rig.home");
order("clear", "The fault was not cleared", "rig.clear_fault");
order("take", "The control was not granted", "control.take");
by("release").addEventListener("click", () => { letGo = true; daemon.call("control.release"); });
by("stop").addEventListener("click", () => stop("now"));
by("stop-cycle").addEventListener("click", () => stop("cycle_end"));
by("halt").addEventListener("click", () => by("halt-dialog").showModal());
by("halt-now").addEventListener("click", () => { by("halt-dialog").close(); stop("halt"); });
by("continue").addEventListener("click", goOn);
by("start").addEventListener("click", () => { by("start-problem").hidden = true; by("start-dialog").showModal(); });
by("start-now").addEventListener("click", async () => {
  by("start-now").disabled = true;
  try {
    if (await withControl("run.start", choice.order)) by("start-dialog").close();
  } catch (error) {
    describeError(by("start-problem"), error);
  }
  by("start-now").disabled = false;
});

function goOn() {
  const slice = progress?.schedule?.slice;
  if (slice !== undefined) daemon.call("run.continue", { slice }).catch((error) => showProblem("The run did not go on", error));
}

// Escape stops whatever is open and shown: what is shown may be old. Enter is the scanner's "ready".
addEventListener("keydown", (event) => {
  if (event.key === "Escape" && !event.repeat) stop("now");
  const elsewhere = document.querySelector("dialog[open]") || event.target.closest("button, input, textarea");
  if (event.key === "Enter" && !event.repeat && !elsewhere && !by("prompt").hidden) goOn();
}, true);

for (const button of document.querySelectorAll("[data-window]")) {
  button.addEventListener("click", () => {
    document.querySelectorAll("[data-window]").forEach((each) => each.setAttribute("aria-pressed", each === button));
    trace.show(Number(button.dataset.window));
  });
}

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  localStorage.setItem(keptTheme, theme);
  text("theme", theme === "dark" ? "Light" : "Dark");
  trace.repaint();
}
by("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
setTheme(localStorage.getItem(keptTheme) ?? (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark"));

setInterval(showFreshness, 250);
addEventListener("visibilitychange", () => {
  showFreshness();
  for (const end of pendingSleeps) end();
});
daemon.connect();
repeat(() => 200, askStatus);
repeat(() => (behind ? 20 : status && moving.has(status.state) ? 100 : 300), askRun);
