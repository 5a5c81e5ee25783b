"""``safemanip serve``."""

from __future__ import annotations

import argparse
import signal
import sys
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.serve import ServedPolicy, load, make_server

EXAMPLE = "safemanip serve my_model:Model --port 8000"

ENDING = (signal.SIGINT, signal.SIGTERM)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "policy",
        metavar="MODULE:ATTRIBUTE",
        nargs="?",
        default="",
        help="an object with infer(request) or act(request), a class or factory of one, or a "
        "function of the request",
    )
    parser.add_argument(
        "--lerobot",
        default="",
        metavar="PATH",
        help="instead, any policy of LeRobot's: a folder with a checkpoint, or a repository on the "
        "Hub; in LeRobot's environment",
    )
    parser.add_argument(
        "--device", default="", help="of LeRobot's policy, cuda or cpu; as in its checkpoint"
    )
    parser.add_argument(
        "--camera",
        action="append",
        default=[],
        metavar="FEATURE=IMAGE",
        help="which picture a feature of LeRobot's policy is: left, right or wrist (repeatable)",
    )
    parser.add_argument("--host", default="127.0.0.1", help="default: %(default)s, this machine")
    parser.add_argument("--port", type=int, default=8000, help="default: %(default)s; 0: any")


def run(options: argparse.Namespace) -> int:
    """Serve until Ctrl-C or SIGTERM, which is how a server ends: the exit status is 0."""
    sys.path.insert(0, "")
    served = _served(options)
    server = make_server(served, options.host, options.port)
    for number in ENDING:
        signal.signal(number, _interrupt)
    port = server.socket.getsockname()[1]
    print(f"serving {options.policy or options.lerobot} at ws://{options.host}:{port}", flush=True)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        # Before websockets 16, clients keep a server that was shut down alive.
        for client in list(served.clients):
            client.close(1001, "the server was stopped")
        server.shutdown()
    return 0


def _served(options: argparse.Namespace) -> ServedPolicy:
    if bool(options.policy) == bool(options.lerobot):
        raise ConfigError("expected either MODULE:ATTRIBUTE or --lerobot PATH")
    if not options.lerobot:
        if options.device or options.camera:
            raise ConfigError("--device and --camera are for --lerobot")
        return load(options.policy)
    from pytest_safemanip.policies.lerobot import LeRobotModel, parse_cameras

    model = LeRobotModel(options.lerobot, options.device, parse_cameras(options.camera))
    return ServedPolicy(f"lerobot:{options.lerobot}", model)


def _interrupt(number: int, frame: Any) -> None:
    # A second signal ends it at once, however soon it comes and whatever the policy is doing.
    for each in ENDING:
        signal.signal(each, signal.SIG_DFL)
    raise KeyboardInterrupt
