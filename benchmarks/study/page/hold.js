// Keys and buttons that repeat while they are held: once at once, then after a while again and again.
const FIRST = 220, NEXT = 1000 / 7;

export class Hold {
  // `act(what, down)` is called for each press and repetition; `repeats(what)` says what is repeated at all.
  constructor(act, repeats) {
    this.act = act;
    this.repeats = repeats;
    this.held = [];
  }

  press(key, what, down) {
    if (this.held.some((one) => one.key === key)) return;
    this.act(what, down, false);
    if (!this.repeats(what)) return;
    this.held.push({ key, what, down });
    this.wait(FIRST);
  }

  release(key) {
    const last = this.held.at(-1);
    this.held = this.held.filter((one) => one.key !== key);
    if (last && last !== this.held.at(-1)) this.wait(FIRST);
  }

  clear() {
    this.held = [];
    clearTimeout(this.timer);
  }

  wait(time) {
    clearTimeout(this.timer);
    if (!this.held.length) return;
    this.timer = setTimeout(() => {
      const last = this.held.at(-1);
      if (last) this.act(last.what, last.down, true);
      this.wait(NEXT);
    }, time);
  }
}
