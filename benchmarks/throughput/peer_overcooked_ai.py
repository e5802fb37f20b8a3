"""Runs in Overcooked-AI's own environment: for each line "seconds observe", answer with "rate steps_per_second"."""

import os
import queue
import random
import sys
import threading
import time
from collections.abc import Iterator


def requests() -> Iterator[str]:
    """Lines of standard input. Where it is closed, nobody waits for an answer any more, and the process ends."""
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            lines.put(line)
        os._exit(0)

    threading.Thread(target=read, daemon=True).start()
    while True:
        yield lines.get()


def main() -> None:
    """Step one game of two players with random actions, restarting it as it ends."""
    from overcooked_ai_py.mdp.actions import Action  # type: ignore[import-not-found]
    from overcooked_ai_py.mdp.overcooked_env import OvercookedEnv  # type: ignore[import-not-found]
    from overcooked_ai_py.mdp.overcooked_mdp import OvercookedGridworld  # type: ignore[import-not-found]

    env = OvercookedEnv.from_mdp(OvercookedGridworld.from_layout_name("cramped_room"), horizon=400, info_level=0)
    rng = random.Random(0)
    joint = [(rng.choice(Action.ALL_ACTIONS), rng.choice(Action.ALL_ACTIONS)) for _ in range(400)]
    print("ready", flush=True)
    for line in requests():
        seconds, observe = float(line.split()[0]), line.split()[1] == "1"
        steps, start, passed = 0, time.process_time(), 0.0
        while passed < seconds:
            env.reset()
            for actions in joint:
                state, _, done, _ = env.step(actions)
                if observe:
                    env.lossless_state_encoding_mdp(state)
                steps += 1
                if done:
                    break
            passed = time.process_time() - start
        print("rate", steps / passed, flush=True)


if __name__ == "__main__":
    main()
