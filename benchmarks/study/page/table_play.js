// Plays a table: the pointer is the hand. Sampled every frame, sent in batches; the server moves what there is to move.
import { announce, el, isCoarse, word } from "./dom.js";
import { Motion } from "./motion.js";
import { TableBoard } from "./table_board.js";

const BATCH = 50, MOST_SAMPLES = 500, MOST_UNANSWERED = 12;
const NEAR = 0.035;  // metres from the hand's middle at which a pointer takes it up
const WAYS = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] };
const SLOWEST = 5, FASTEST = 60, SPEED = 30;  // of the keys, cm/s

export function play({ screen, connection, measures, stage, hud, panel, over }) {
  const { scene } = screen, board = new TableBoard(scene, measures), [width, depth] = scene.layout.table.size;
  const frame = el("div", { class: "board table", role: "application", tabindex: "0", "aria-label": word("table_label") }, board.floor, board.top);
  const status = el("p", { class: "served" }), hint = el("p", { class: "count" });
  const rate = el("input", { type: "range", min: SLOWEST, max: FASTEST, value: SPEED, step: 5, "aria-label": word("hand_speed") });
  const motion = new Motion(screen.state, screen.clock);
  const keys = new Set();
  let state = screen.state, clock = screen.clock, begun = 0, isRunning = false, isClosed = false;
  let at = [...state.hand], samples = [], lastSample = clock, unanswered = 0, shown = null, lastFrame = 0;
  let grip = null;  // touch: where the finger and the hand were when it came down

  const clamp = ([x, y]) => [Math.min(width, Math.max(0, x)), Math.min(depth, Math.max(0, y))];
  const timeOf = (stamp) => clock + stamp - begun;

  function place(event) {
    const box = frame.getBoundingClientRect(), scale = (width * 1000 + 2 * board.margin) / box.width;
    const [x, y] = [(event.clientX - box.left) * scale - board.margin, (event.clientY - box.top) * scale - board.margin];
    return [x / 1000, depth - y / 1000];
  }

  // -- the round's clock ------------------------------------------------------------------------------------------------

  // The clock starts when the pointer takes up the hand, so that the hand never has to run after it.
  function start(stamp) {
    if (isRunning || state.over || !connection.isOpen) return;
    isRunning = true;
    begun = stamp;
    lastSample = clock;
    frame.classList.add("running");
    tell();
  }

  function stop() {
    if (isRunning) {
      flush();
      clock = lastSample;
    }
    isRunning = false;
    samples = [];
    unanswered = 0;
    keys.clear();
    grip = null;
    at = [...state.hand];
    board.point(null);
    frame.classList.remove("running");
    tell();
  }

  function sample(stamp, [x, y]) {
    const time = timeOf(stamp);
    if (time <= lastSample || samples.length >= MOST_SAMPLES) return;
    lastSample = time;
    samples.push([Math.round(time * 100) / 100, Math.round(x * 1e5) / 1e5, Math.round(y * 1e5) / 1e5]);
  }

  function flush() {
    if (!samples.length || unanswered >= MOST_UNANSWERED) return;
    if (connection.send({ type: "pointer", n: state.n, samples, shown })) {
      unanswered += 1;
      samples = [];
    }
  }

  const timer = setInterval(() => {
    if (!isRunning || state.over) return;
    sample(performance.now(), at);  // a hand that rests is a hand too: the robot's time goes on
    flush();
  }, BATCH);

  // -- pointer ----------------------------------------------------------------------------------------------------------

  function moved(event) {
    const isTouch = event.pointerType === "touch";
    if (isTouch && !grip) return;
    if (!isRunning) {
      const here = place(event), reach = Math.max(NEAR, scene.hand * 1.5);
      if (!isTouch && Math.hypot(here[0] - state.hand[0], here[1] - state.hand[1]) > reach) return;
      if (document.querySelector("dialog[open]")) return;
      start(event.timeStamp);
      if (!isRunning) return;
    }
    const events = event.getCoalescedEvents?.() || [];
    for (const one of events.length ? events : [event]) {
      const here = place(one);
      at = clamp(isTouch ? [grip.hand[0] + here[0] - grip.finger[0], grip.hand[1] + here[1] - grip.finger[1]] : here);
      sample(one.timeStamp, at);
    }
    board.point(at, isTouch);
  }

  function down(event) {
    frame.focus({ preventScroll: true });
    if (event.pointerType !== "touch" || (grip && grip.id !== event.pointerId)) return;
    event.preventDefault();
    frame.setPointerCapture(event.pointerId);
    // A finger moves the hand as far as itself, wherever it comes down: it need not cover it.
    grip = { id: event.pointerId, finger: place(event), hand: isRunning ? [...at] : [...state.hand] };
    moved(event);
  }

  function up(event) {
    if (grip?.id === event.pointerId) grip = null;
  }

  // -- keys -------------------------------------------------------------------------------------------------------------

  function pressed(event) {
    if (!WAYS[event.code] || document.querySelector("dialog[open]") || document.activeElement === rate) return;
    event.preventDefault();
    if (event.repeat) return;
    keys.add(event.code);
    panel.hidden = false;
    start(event.timeStamp);
  }
  const released = (event) => keys.delete(event.code);
  const away = () => keys.clear();
  const hidden = () => { if (document.hidden) stop(); };

  function walk(now) {
    const passed = Math.min(0.1, (now - lastFrame) / 1000);
    if (!isRunning || !keys.size) return;
    const [dx, dy] = [...keys].reduce((sum, key) => [sum[0] + WAYS[key][0], sum[1] + WAYS[key][1]], [0, 0]);
    const length = Math.hypot(dx, dy);
    if (!length) return;
    const step = (passed * Number(rate.value)) / 100 / length;
    at = clamp([at[0] + dx * step, at[1] + dy * step]);
    sample(now, at);
    board.point(at);
  }

  // -- what is seen -----------------------------------------------------------------------------------------------------

  function tell() {
    const total = scene.wanted || Object.keys(scene.slots).length, n = scene.wanted ? state.reaches : state.done;
    status.textContent = total ? word("placed", { n, total }) : word("placed_open", { n });
    hint.textContent = isRunning ? board.describe(state) : word(isCoarse() ? "take_finger" : "take_pointer");
  }

  function look(now) {
    if (isClosed) return;
    walk(now);
    lastFrame = now;
    if (shown === undefined) shown = now;
    const time = isRunning ? timeOf(now) : Infinity;
    board.show(...motion.at(time));
    requestAnimationFrame(look);
  }

  function say(before) {
    const now = [];
    if (before.holding !== state.holding) now.push(board.describe(state));
    if (before.reaches !== state.reaches || before.done !== state.done) now.push(status.textContent);
    if (now.length) announce(now.join(". "));
  }

  function change(next, time) {
    const before = state;
    state = next;
    motion.add(next, time, isRunning ? timeOf(performance.now()) : time);
    shown = undefined;
    tell();
    say(before);
    if (state.over && !before.over) {
      isRunning = false;
      board.point(null);
      over(scene.wanted ? state.reaches >= scene.wanted : state.n < scene.max_steps);
    }
  }

  frame.style.setProperty("--ratio", board.ratio);
  stage.replaceChildren(frame);
  hud.replaceChildren(status, hint);
  panel.replaceChildren(el("label", { class: "rate" }, el("span", {}, word("hand_speed")), rate));
  panel.hidden = true;
  tell();
  frame.addEventListener("pointerdown", down);
  frame.addEventListener("pointermove", moved);
  for (const kind of ["pointerup", "pointercancel"]) frame.addEventListener(kind, up);
  frame.addEventListener("contextmenu", (event) => event.preventDefault());
  addEventListener("keydown", pressed);
  addEventListener("keyup", released);
  addEventListener("blur", away);
  document.addEventListener("visibilitychange", hidden);
  requestAnimationFrame(look);

  return {
    focus: () => frame.focus({ preventScroll: true }),
    take(message) {
      unanswered = Math.max(0, unanswered - 1);
      if (message.state) change(message.state, message.t ?? (message.state.n * 1000) / scene.rate);
    },
    again(next) {
      clock = next.clock;
      isRunning = false;
      motion.reset(next.state, next.clock);
      state = next.state;
      stop();
    },
    lost: stop,
    close() {
      isClosed = true;
      clearInterval(timer);
      removeEventListener("keydown", pressed);
      removeEventListener("keyup", released);
      removeEventListener("blur", away);
      document.removeEventListener("visibilitychange", hidden);
    },
  };
}
