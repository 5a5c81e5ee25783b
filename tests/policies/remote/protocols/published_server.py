"""A policy behind vla-eval's own server: its first two actions say what it was given."""

from __future__ import annotations

import sys
import threading

import anyio
import numpy as np
from vla_eval.model_servers.predict import PredictModelServer
from vla_eval.model_servers.serve import serve_async


class Echo(PredictModelServer):
    """Answers with a mean of the first picture and with the size of the batch."""

    def predict_batch(self, obs_batch, ctx_batch):
        answers = []
        for seen in obs_batch:
            picture = next(iter(seen["images"].values()))
            actions = np.zeros((12,), np.float32)
            actions[0] = float(np.mean(picture)) / 255
            actions[1] = len(obs_batch) / 10
            actions[2] = len(seen["task_description"]) / 100
            answers.append({"actions": actions})
        return answers


async def main(batch: int) -> None:
    """Serve on any port, and print it."""
    server = Echo(max_batch_size=batch, max_wait_time=0.3)
    async with anyio.create_task_group() as group:
        port = await group.start(
            lambda task_status: serve_async(server, "127.0.0.1", 0, task_status=task_status)
        )
        print(port, flush=True)  # noqa: T201


threading.Thread(target=lambda: (sys.stdin.read(), sys.exit(0)), daemon=True).start()
anyio.run(main, int(sys.argv[1]))
