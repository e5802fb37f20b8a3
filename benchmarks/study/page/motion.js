// What is seen between two states of the table: a little behind the newest one, so that everything glides.
const MOST = 12, LEAST_LAG = 40, MOST_LAG = 400;
const between = (a, b, share) => a + (b - a) * share;

export class Motion {
  constructor(state, time) {
    this.reset(state, time);
  }

  reset(state, time) {
    this.states = [{ time, state }];
    this.lag = 90;
  }

  get newest() { return this.states.at(-1).state; }

  // A state that was reached at `time` of the round's clock, which says `now`.
  add(state, time, now) {
    const lag = Math.min(MOST_LAG, Math.max(LEAST_LAG, now - time + 15));
    this.lag = lag > this.lag ? lag : between(this.lag, lag, 0.03);
    if (time <= this.states.at(-1).time) this.states.at(-1).state = state;
    else this.states.push({ time, state });
    if (this.states.length > MOST) this.states.shift();
  }

  // `[state, positions, hand, robot]` to draw now.
  at(now) {
    const time = now - this.lag;
    while (this.states.length > 1 && this.states[1].time <= time) this.states.shift();
    const [a, b] = this.states;
    if (!b || time <= a.time) return [a.state, a.state.positions, a.state.hand, a.state.robot];
    const share = (time - a.time) / (b.time - a.time);
    const point = (p, q) => p.map((v, i) => (i < 2 ? between(v, q[i], share) : q[i]));
    const positions = a.state.positions.map((p, i) => point(p, b.state.positions[i]));
    return [a.state, positions, point(a.state.hand, b.state.hand), a.state.robot && point(a.state.robot, b.state.robot)];
  }
}
